"""The stream of drawings: from the worker to whoever looks on, over a real socket."""

import json
from collections.abc import Callable
from typing import Any, Self

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from pftrack.core.model.drawing import Drawing, Picture, Points
from pftrack_server.flat.codec import decode
from tests.server.host import Server, begin, steer
from tests.waiting import wait_for


class Page:
    """A page that reads drawings, and paints them at once unless it is told not to."""

    def __init__(self, server: Server, session: str) -> None:
        self.socket: ClientConnection = connect(f"{server.ws}/api/v1/sessions/{session}/drawings", max_size=None)
        self.frames: list[int] = []
        self.paints = True
        self._pictures: dict[int, bytes] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def read(self, seconds: float = 60) -> Drawing:
        """Return the next drawing."""
        message = self.socket.recv(timeout=seconds)
        assert isinstance(message, bytes)
        frame, drawing, self._pictures = decode(message, self._pictures)
        self.frames.append(frame)
        if self.paints:
            self.paint()
        return drawing

    def paint(self) -> None:
        self.say(type="painted", count=len(self.frames))

    def say(self, **words: Any) -> None:
        self.socket.send(json.dumps(words))

    def until(self, frame: int) -> Drawing:
        """Read up to a frame, and return its drawing."""
        drawing = self.read()
        while self.frames[-1] != frame:
            drawing = self.read()
        return drawing

    def reads_until_sent_away(self) -> None:
        while True:
            self.read()

    def silent(self, seconds: float = 0.4) -> bool:
        """Whether nothing comes for a while."""
        try:
            self.read(seconds)
        except TimeoutError:
            return True
        return False


@pytest.fixture
def look(server: Server, session: dict[str, Any]) -> Callable[[], Page]:
    return lambda: Page(server, session["id"])


def test_who_comes_sees_the_frame_that_is_shown(
    client: httpx.Client, session: dict[str, Any], look: Callable[[], Page]
) -> None:
    """The first drawing is the current frame, whole: picture, particles, caption."""
    steer(client, session["id"], "seek", frame=9)
    with look() as page:
        drawing = page.read()
        assert page.frames == [9]
        assert (drawing.width, drawing.height) == (session["width"], session["height"])
        assert isinstance(drawing.primitives["picture"], Picture)
        particles = drawing.primitives["particles"]
        assert isinstance(particles, Points)
        assert len(particles.positions) == session["parameters"]["sample_count"]
        assert drawing.caption.startswith("frame 9 ")
        assert page.silent()


def test_every_seek_is_seen_by_everybody(
    client: httpx.Client, session: dict[str, Any], look: Callable[[], Page]
) -> None:
    """Two pages see the same frames, whoever came first, and one that comes back sees where the run is now."""
    with look() as first:
        first.until(0)
        steer(client, session["id"], "seek", frame=4)
        first.until(4)
        with look() as second:
            second.until(4)
            steer(client, session["id"], "seek", frame=2)
            assert first.until(2).caption == second.until(2).caption
    steer(client, session["id"], "seek", frame=7)
    with look() as again:
        again.until(7)


def test_a_page_that_paints_nothing_is_not_flooded(
    client: httpx.Client, session: dict[str, Any], look: Callable[[], Page]
) -> None:
    """It gets two drawings, the others see all meanwhile; when it has painted it gets the newest."""
    with look() as slow, look() as quick:
        slow.paints = False
        slow.read()
        for frame in range(1, 6):
            steer(client, session["id"], "step")
            quick.until(frame)
        slow.read()
        assert slow.silent()
        slow.paint()
        slow.read()
        assert slow.frames == [0, 1, 5]


def test_a_run_that_plays_is_sent_frame_by_frame(
    client: httpx.Client, session: dict[str, Any], look: Callable[[], Page]
) -> None:
    """A page that keeps up with seven frames a second is sent most of them, each once and in order."""
    steer(client, session["id"], "speed", speed=0.25)
    with look() as page:
        page.until(0)
        steer(client, session["id"], "play")
        while page.frames[-1] < 12:
            page.read()
        assert page.frames == sorted(set(page.frames))
        assert len(page.frames) > 6


def test_a_scene_beside_it_changes_nothing(
    client: httpx.Client, session: dict[str, Any], server: Server, look: Callable[[], Page]
) -> None:
    """Both forms of a drawing are sent where both are wanted."""
    feed = server.manager.get(session["id"]).scene_feed
    offered: list[int] = []
    feed.offer = lambda _, frame: (offered.append(frame), feed._credit())
    with look() as page:
        page.until(0)
        feed._loop.call_soon_threadsafe(feed._credit)
        wait_for(lambda: offered == [0])
        for frame in range(1, 4):
            steer(client, session["id"], "step")
            page.until(frame)
        wait_for(lambda: offered[-1:] == [3])
        assert offered == [0, 1, 2, 3]


def test_drawings_go_on_after_a_crash(client: httpx.Client, server: Server, look: Callable[[], Page]) -> None:
    """A page that looked on while the worker died sees the resumed run without coming anew."""
    session = begin(client)["id"]
    with Page(server, session) as page:
        page.until(0)
        steer(client, session, "seek", frame=6)
        page.until(6)
        server.manager.get(session).worker.kill("The test killed it.")
        wait_for(lambda: client.get(f"/api/v1/sessions/{session}").json()["state"] == "crashed")
        client.post(f"/api/v1/sessions/{session}/resume").raise_for_status()
        assert isinstance(page.until(6).primitives["picture"], Picture)
        steer(client, session, "step")
        page.until(7)


def test_the_end_of_the_session_ends_it(
    client: httpx.Client, session: dict[str, Any], look: Callable[[], Page]
) -> None:
    """A page is told that the session was ended, not that the connection was lost."""
    with look() as page:
        page.read()
        client.delete(f"/api/v1/sessions/{session['id']}")
        with pytest.raises(ConnectionClosed, match="The session was ended") as caught:
            page.read()
        assert caught.value.rcvd is not None
        assert caught.value.rcvd.code == 4404


def test_a_session_that_is_not_there(server: Server) -> None:
    """Who asks for a session that there is not is told so."""
    with Page(server, "0123456789abcdef") as page, pytest.raises(ConnectionClosed, match="no such session"):
        page.read()


@pytest.mark.parametrize(
    "words",
    [
        {"type": "painted", "count": 5},
        {"type": "painted", "count": -1},
        {"type": "painted"},
        {"type": "ping", "sent": 1.0},
        {"type": "painted", "count": 0, "action": "play"},
    ],
)
def test_a_page_says_nothing_else(look: Callable[[], Page], words: dict[str, Any]) -> None:
    """Whoever claims to have painted what was not sent, or sends commands, is sent away."""
    with look() as page:
        page.paints = False
        page.read()
        page.say(**words)
        with pytest.raises(ConnectionClosed, match="takes no commands"):
            page.reads_until_sent_away()


def test_a_page_of_another_site_sees_nothing(server: Server, session: dict[str, Any]) -> None:
    """The stream carries pictures of people's videos: another origin is refused before the upgrade."""
    address = f"{server.ws}/api/v1/sessions/{session['id']}/drawings"
    with pytest.raises(InvalidStatus, match="403"), connect(address, origin=Origin("http://elsewhere.example")):
        pass


def test_who_looks_on_is_a_visitor(server: Server, session: dict[str, Any], look: Callable[[], Page]) -> None:
    """A session is not put to sleep while somebody looks at its drawings."""
    found = server.manager.get(session["id"])
    with look() as page:
        page.read()
        assert found.visitors == 1
    wait_for(lambda: found.visitors == 0)
