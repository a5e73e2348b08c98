"""The scene feed: one drawing at a time, and only while somebody looks."""

import asyncio
import threading
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

import pftrack_server.viewer
from pftrack.core.model.drawing import Drawing
from pftrack_server.core.panel import PanelDescription, PanelValues
from pftrack_server.core.pictures import SceneDrawing
from pftrack_server.sessions.scene_feed import SceneFeed
from pftrack_server.sessions.spec import SessionDescription, TrackerPublic
from pftrack_server.viewer import Endpoint
from tests.apart import run

DESCRIPTION = SessionDescription(
    title="Ball", trackers=[TrackerPublic(id="apf", title="APF")], width=320, height=240, frame_rate_hz=30.0, frames=100
)

ENDPOINT = Endpoint()

NOTHING = SceneDrawing(Drawing(1, 1), {})


class Puppet:
    """A viewer that only remembers."""

    def __init__(self, description: PanelDescription, in_force: PanelValues, **requests: Any) -> None:
        self.description, self.in_force = description, in_force
        self.requests = requests
        self.endpoint = ENDPOINT
        self.shown: list[int] = []
        self.told: list[tuple[Any, ...]] = []
        self.closed = False
        self.slow = threading.Event()
        self.slow.set()

    def show(self, drawing: SceneDrawing, frame: int) -> None:
        del drawing
        self.shown.append(frame)

    def tell(self, in_force: PanelValues) -> None:
        self.slow.wait(5)
        self.told.append(("in force", in_force))

    def refuse(self, message: str) -> None:
        self.told.append(("refuse", message))

    def close(self) -> None:
        self.closed = True


class Theatre:
    """A scene feed with a puppet for a viewer."""

    def __init__(self) -> None:
        self.credits = 0
        self.requests: list[dict[str, Any]] = []
        self.scene_feed = SceneFeed(credit=self._credit, on_command=self.requests.append)

    def _credit(self) -> None:
        self.credits += 1

    async def open(self) -> Puppet:
        assert await self.scene_feed.open(DESCRIPTION, PanelValues({"n": 1}, "apf", 7)) is ENDPOINT
        puppet: Any = self.scene_feed._viewer
        return puppet


@pytest.fixture
def act(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[Theatre], Coroutine[Any, Any, None]]], None]:
    """Play a scene with puppets."""
    monkeypatch.setattr(pftrack_server.viewer, "Viewer", Puppet)

    def play(scene: Callable[[Theatre], Coroutine[Any, Any, None]]) -> None:
        async def whole() -> None:
            await scene(Theatre())

        run(whole())

    return play


def test_a_panel_that_fails_is_told_the_next_time(act: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """What cannot be shown in it ends neither the session nor the panel."""

    async def scene(theatre: Theatre) -> None:
        puppet = await theatre.open()
        refuse = puppet.refuse

        def fail(_: str) -> None:
            raise RuntimeError("on purpose")

        monkeypatch.setattr(puppet, "refuse", fail)
        theatre.scene_feed.refuse("in vain")
        assert theatre.scene_feed._pump is not None
        await asyncio.wait_for(theatre.scene_feed._pump, 10)
        monkeypatch.setattr(puppet, "refuse", refuse)
        theatre.scene_feed.refuse("too large")
        await theatre.scene_feed.close()
        assert puppet.told == [("refuse", "too large")]
        assert puppet.closed

    act(scene)


def test_no_credit_for_an_empty_room(act: Any) -> None:
    """While nobody looks the worker gets no credit; who comes in brings one, and the viewer asks for each more."""

    async def scene(theatre: Theatre) -> None:
        puppet = await theatre.open()

        async def ready() -> None:
            await asyncio.to_thread(puppet.requests["on_ready"])
            await asyncio.sleep(0)

        theatre.scene_feed.offer(NOTHING, 1)
        await ready()
        assert (puppet.shown, theatre.credits) == ([1], 0)
        with theatre.scene_feed.watch():
            assert theatre.credits == 1
            theatre.scene_feed.offer(NOTHING, 2)
            assert theatre.credits == 1
            await ready()
            assert theatre.credits == 2
            theatre.scene_feed.on_worker_started()
            assert theatre.credits == 3
        await ready()
        theatre.scene_feed.on_worker_started()
        assert theatre.credits == 3

    act(scene)


def test_one_viewer_for_all(act: Any) -> None:
    """However many come at once, there is one viewer; closed, it can be opened again."""

    async def scene(theatre: Theatre) -> None:
        await asyncio.gather(*(theatre.open() for _ in range(5)))
        first = await theatre.open()
        await theatre.scene_feed.close()
        assert first.closed
        await theatre.scene_feed.close()
        assert await theatre.open() is not first

    act(scene)


def test_what_changes_while_the_viewer_is_made_is_shown(act: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Making it takes a while; its panel does not stay at what was in force when that began."""
    made = threading.Event()

    class Late(Puppet):
        def __init__(self, *arguments: Any, **requests: Any) -> None:
            made.wait(5)
            super().__init__(*arguments, **requests)

    monkeypatch.setattr(pftrack_server.viewer, "Viewer", Late)

    async def scene(theatre: Theatre) -> None:
        opening = asyncio.create_task(theatre.open())
        await asyncio.sleep(0.02)
        theatre.scene_feed.tell(PanelValues({"n": 2}, "apf", 7))
        made.set()
        puppet = await opening
        await theatre.scene_feed.close()
        assert puppet.told == [("in force", PanelValues({"n": 2}, "apf", 7))]

    act(scene)


def test_only_the_newest_values_wait(act: Any) -> None:
    """While the panel is slow, only the newest values wait for it, and no refusal is lost."""

    async def scene(theatre: Theatre) -> None:
        puppet = await theatre.open()
        puppet.slow.clear()
        for number in range(20):
            theatre.scene_feed.tell(PanelValues({"n": number}, "apf", 7))
            await asyncio.sleep(0.002)
        theatre.scene_feed.refuse("too large")
        theatre.scene_feed.refuse("too small")
        puppet.slow.set()
        await theatre.scene_feed.close()
        values = [told[1].values["n"] for told in puppet.told if told[0] == "in force"]
        assert values[-1] == 19
        assert len(values) <= 3
        assert [told[1] for told in puppet.told if told[0] == "refuse"] == ["too large", "too small"]

    act(scene)


def test_wishes_come_home_to_the_loop(act: Any) -> None:
    """What the viewer's threads wish is told in the event loop's thread."""

    async def scene(theatre: Theatre) -> None:
        puppet = await theatre.open()
        commands: list[dict[str, Any]] = [{"kind": "change", "values": {"n": 2}}, {"kind": "play"}]
        for command in commands:
            await asyncio.to_thread(puppet.requests["on_command"], command)
        await asyncio.sleep(0)
        assert theatre.requests == commands

    act(scene)


def test_a_broken_panel_ends_nothing(act: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A panel that cannot show a value ends neither scene nor session."""

    def broken(*_: object) -> None:
        raise RuntimeError("no such control")

    async def scene(theatre: Theatre) -> None:
        puppet = await theatre.open()
        monkeypatch.setattr(puppet, "tell", broken)
        theatre.scene_feed.tell(PanelValues({"n": 1}, "apf", 7))
        await asyncio.sleep(0.05)
        monkeypatch.undo()
        theatre.scene_feed.refuse("still here")
        await theatre.scene_feed.close()
        assert ("refuse", "still here") in puppet.told

    act(scene)
