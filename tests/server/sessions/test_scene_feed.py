"""The session's scene: made when somebody first looks, fed while somebody looks, and a panel whose commands count."""

import asyncio
from typing import Any
from unittest.mock import Mock

import pytest

import pftrack_server.viewer
from pftrack.core.model.drawing import Drawing
from pftrack.core.refusal import RefusedError
from pftrack_server.core.panel import PanelDescription, PanelValues, TrackerPublic
from pftrack_server.core.pictures import SceneDrawing
from pftrack_server.sessions.scene_feed import SceneFeed
from pftrack_server.sessions.spec import SessionDescription
from pftrack_server.sessions.worker.protocol import ChangeValues, Command
from pftrack_server.viewer import Endpoint

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
        self.told: list[Any] = []
        self.closed = False

    def show(self, drawing: SceneDrawing, frame: int) -> None:
        del drawing
        self.shown.append(frame)

    def tell(self, in_force: PanelValues) -> None:
        self.told.append(in_force)

    def refuse(self, message: str) -> None:
        self.told.append(message)

    async def close(self) -> None:
        self.closed = True


class Theatre:
    """A scene feed with a puppet for a viewer."""

    def __init__(self) -> None:
        self.credits = 0
        self.sent: list[Command | str] = []
        self.refused: list[dict[str, Any]] = []
        self.error: Exception | None = None
        self.door = asyncio.Lock()
        self.scene_feed = SceneFeed(credit=self._credit, carry_out=self._carry_out, on_refusal=self.refused.append)

    def _credit(self) -> None:
        self.credits += 1

    async def _carry_out(self, command: Command) -> None:
        if self.error is not None:
            raise self.error
        async with self.door:
            self.scene_feed.note_turn(command)
            self.sent.append(command.model_copy(deep=True))
            await asyncio.sleep(0)

    def open(self) -> Puppet:
        assert self.scene_feed.open(DESCRIPTION, PanelValues({"n": 1}, "apf", 7)) is ENDPOINT
        return self.scene_feed._viewer


@pytest.fixture
def theatre(monkeypatch: pytest.MonkeyPatch) -> Theatre:
    """A scene feed whose viewer is a puppet."""
    monkeypatch.setattr(pftrack_server.viewer, "Viewer", Puppet)
    return Theatre()


async def test_no_credit_for_an_empty_room(theatre: Theatre) -> None:
    """While nobody looks the worker gets no credit; who comes in brings one, and the viewer asks for each more."""
    puppet = theatre.open()
    ready = puppet.requests["on_ready"]
    theatre.scene_feed.offer(NOTHING, 1)
    ready()
    assert (puppet.shown, theatre.credits) == ([1], 0)
    with theatre.scene_feed.watch():
        assert theatre.credits == 1
        theatre.scene_feed.offer(NOTHING, 2)
        assert theatre.credits == 1
        ready()
        assert theatre.credits == 2
    ready()
    assert theatre.credits == 2


async def test_one_viewer_for_all(theatre: Theatre) -> None:
    """However many come, there is one viewer, which shows what is told; closed, it can be opened again."""
    first = theatre.open()
    assert theatre.open() is first
    theatre.scene_feed.tell(PanelValues({"n": 2}, "apf", 7))
    theatre.scene_feed.refuse("too large")
    assert first.told == [PanelValues({"n": 2}, "apf", 7), "too large"]
    await theatre.scene_feed.close()
    assert first.closed
    await theatre.scene_feed.close()
    theatre.scene_feed.tell(PanelValues({"n": 3}, "apf", 7))
    assert theatre.open() is not first


async def test_a_panel_that_fails_ends_nothing(theatre: Theatre, monkeypatch: pytest.MonkeyPatch) -> None:
    """What cannot be shown in it ends neither the session nor the panel."""
    puppet = theatre.open()
    monkeypatch.setattr(puppet, "tell", Mock(side_effect=RuntimeError("on purpose")))
    theatre.scene_feed.tell(PanelValues({"n": 1}, "apf", 7))
    theatre.scene_feed.refuse("still here")
    assert puppet.told == ["still here"]


async def test_what_waits_goes_together_and_keeps_its_place(theatre: Theatre) -> None:
    """While another command is under way the newest value of each parameter waits.

    What a page asks for meanwhile comes after it; values that come once it is sent are another change.
    """
    ask = theatre.open().requests["on_command"]

    async def ask_from_page() -> None:
        async with theatre.door:
            theatre.sent.append("page")
            ask({"kind": "change", "values": {"n": 3}})

    async with theatre.door:
        for number in range(2):
            ask({"kind": "change", "values": {"n": number}})
        await asyncio.sleep(0)
        page = asyncio.create_task(ask_from_page())
        await asyncio.sleep(0)
        for values in ({"n": 2}, {"m": 1}):
            ask({"kind": "change", "values": values})
    await page
    await asyncio.sleep(0.01)
    assert theatre.sent == [ChangeValues(values={"n": 2, "m": 1}), "page", ChangeValues(values={"n": 3})]


@pytest.mark.parametrize(
    ("body", "error", "said"),
    [
        ({}, RefusedError("picture 7 cannot be read"), "Picture 7 cannot be read"),
        ({}, OSError(5, "input/output error", "/somewhere/secret"), "could not read or write"),
        ({}, RuntimeError("a mistake"), "failed unexpectedly"),
        ({"seed": "seven"}, AssertionError("never carried out"), "seed: "),
        ({"kind": "fly"}, AssertionError("never carried out"), "kind: "),
    ],
)
async def test_whatever_goes_wrong_is_told(theatre: Theatre, body: dict[str, Any], error: Exception, said: str) -> None:
    """Nobody waits for the answer: without this the control would stay where it was put, and nobody would know why."""
    theatre.error = error
    theatre.scene_feed.ask({"kind": "restart", **body})
    await asyncio.sleep(0.01)
    assert said in theatre.refused[0]["message"]
    assert "secret" not in theatre.refused[0]["message"]
