"""The bridge forwards faithfully, refuses what is not wanted, and leaves nothing behind."""

import gc
import socket
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import msgspec
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from pftrack_server.viewer import viser_messages as messages
from pftrack_server.viewer.viser_messages import kind_of
from pftrack_server.viewer.viser_server import BURST, MAXIMUM_BYTES, MOST_HZ, bridge
from tests.viewer.host import PROTOCOL, Peer, Session, Site, drawing
from tests.waiting import wait_for


def test_scene_and_panel_pass_in_both_directions(session: Session, site: Site) -> None:
    """Through the bridge a browser sees the same as without it; nothing is compressed on the way.

    Messages that are not welcome are dropped; the panel still works after them.
    """
    with Peer(site.scene) as peer:
        assert peer.socket.subprotocol == PROTOCOL
        session.show(drawing(), 0, lambda: "/particles" in peer.nodes)
        peer.send("ShareUrlRequest")
        peer.socket.send(b"rubbish")
        peer.move("Particles", 300, lambda: session.values["sample_count"] == 300)
    with connect(site.scene, subprotocols=[PROTOCOL], proxy=None) as browser:
        assert "Sec-WebSocket-Extensions" not in browser.response.headers  # type: ignore[union-attr]


def test_what_no_browser_sends_ends_the_connection(session: Session, site: Site) -> None:
    """Text, and a message that is too big: it never reaches viser, and the sentence names the limit."""
    with Peer(site.scene) as talker:
        talker.socket.send("hello")
        wait_for(lambda: talker.socket.close_code == 1003)
    with Peer(site.scene) as peer:
        wait_for(lambda: session.viewer.clients == 1)
        peer.move("Layout", "x" * (MAXIMUM_BYTES + 1), lambda: peer.socket.close_code == 1009)
        assert str(MAXIMUM_BYTES) in str(peer.socket.close_reason)
    wait_for(lambda: site.bridges == 0 and session.viewer.clients == 0)
    assert session.changes == []


UNWELCOME: list[object] = [
    {"type": "GuiUpdateMessage", "uuid": "a", "updates": {"update_cb": []}},
    {"type": "GuiUpdateMessage", "uuid": "a", "updates": {"value": 1, "uuid": "b"}},
    {"type": "GuiUpdateMessage", "uuid": "a"},
    {"type": "ShareUrlRequest"},
    {"type": "FileTransferStartUpload"},
    {"type": ["ViewerCameraMessage"]},
    {},
    [1, 2],
]
RUBBISH = [b"", b"\xc1", b"\x81", b"not msgpack at all", b"\x81\xa4type" + b"\x91" * 9000]


@pytest.mark.parametrize("data", [*map(msgspec.msgpack.encode, UNWELCOME), *RUBBISH])
def test_only_what_the_scene_needs_is_let_through(data: bytes) -> None:
    """Uploads, tunnels, attributes of controls and what is no message are not for browsers."""
    assert kind_of(data) is None


def test_who_only_looks_moves_the_camera_and_nothing_else(session: Session, site: Site) -> None:
    """Controls of a follower's browser change nothing, and a tilted camera leaves what others see as it is."""
    cameras = session.viewer._cameras
    site.looks_only = True
    with Peer(site.scene) as follower:
        wait_for(lambda: session.viewer.clients == 1)
        follower.move("Particles", 55)
        follower.move_view("Front")
        follower.look(800, 600, position=(300.0, 400.0, 90.0))
        (watcher,) = cameras._watchers.values()
        wait_for(lambda: tuple(watcher.client.camera.position) == (300.0, 400.0, 90.0))
        assert (cameras.relief, watcher.preset) == (1.0, "oblique"), "who alone looks on sees depth"
        site.looks_only = False
        with Peer(site.scene) as lecturer:
            lecturer.move("Particles", 77, lambda: session.values["sample_count"] == 77)
            session.show(drawing(), 0)
            lecturer.move_view("Front", until=lambda: cameras.relief == 0.0)
        assert session.changes == [{"sample_count": 77}]


def test_values_that_a_control_cannot_take_are_dropped(
    session: Session, site: Site, capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    """Thousands of them leave one warning and no traceback, and the next good value is taken."""
    with Peer(site.scene) as peer:
        for value in ("many", None, {"a": 1}, [1, 2], float("nan")) * 40:
            peer.move("Particles", value)
        peer.move("Particles", 300)
        wait_for(lambda: session.values["sample_count"] == 300, seconds=30)
        assert peer.socket.close_code is None
    assert capsys.readouterr().out.count("cannot handle") == 1
    assert caplog.records == []


def test_a_browser_that_says_too_much_is_heard_slowly(
    session: Session, site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So nobody can keep the server busy; what it says is not lost."""
    heard = 0

    def count(_: bytes, **__: object) -> None:
        nonlocal heard
        heard += 1

    monkeypatch.setattr(messages, "kind_of", count)
    with Peer(site.scene) as peer:
        wait_for(lambda: heard == 2)  # where it looks, and its answer to a question
        begun = time.monotonic()
        for _ in range(BURST + 100):
            peer.send("ViewerCameraMessage")
        wait_for(lambda: heard >= BURST)
        assert heard <= BURST + 10 + MOST_HZ * (time.monotonic() - begun)
        wait_for(lambda: heard == BURST + 102)
        assert time.monotonic() - begun > 0.8 * 100 / MOST_HZ


def test_a_browser_that_vanishes_leaves_nothing(session: Session, site: Site) -> None:
    """A connection that is cut without a word ends its bridge and its place in the scene."""
    peer = Peer(site.scene)
    wait_for(lambda: session.viewer.clients == 1)
    peer.socket.socket.shutdown(socket.SHUT_RDWR)
    wait_for(lambda: site.bridges == 0 and session.viewer.clients == 0)
    peer.close()


async def test_a_browser_that_left_before_it_was_let_in_is_no_error() -> None:
    """A scene takes a moment to be made; one who does not wait for it is not logged as a file that cannot be read."""
    websocket: Any = SimpleNamespace(scope={}, accept=Mock(side_effect=OSError))
    endpoint: Any = SimpleNamespace(is_open=True)
    await bridge(websocket, endpoint)
    websocket.accept.assert_called_once()


def test_a_scene_that_ends_closes_its_browsers_and_lets_nobody_in(session: Session, site: Site) -> None:
    """A browser is told that it need not wait; before the upgrade nothing has been promised."""
    with Peer(site.scene) as peer:
        wait_for(lambda: session.viewer.clients == 1)
        session.loop.call(session.viewer.close)
        wait_for(lambda: peer.socket.close_code == 1001)
        with pytest.raises(ConnectionClosed):
            peer.socket.send(b"late")
    with pytest.raises(InvalidStatus), connect(site.scene, subprotocols=[PROTOCOL], proxy=None):
        pass
    wait_for(lambda: site.bridges == 0)


def test_a_client_of_another_version_is_turned_away(session: Session, site: Site) -> None:
    """The version is checked by viser from the subprotocol, so it has to pass through."""
    old = Subprotocol("viser-v0.0.1")
    with connect(site.scene, subprotocols=[old], proxy=None) as browser, pytest.raises(ConnectionClosed):
        browser.recv(timeout=60)
    wait_for(lambda: site.bridges == 0)


def test_opening_and_closing_many_times_leaves_nothing_behind(session: Session, site: Site) -> None:
    """Neither threads nor descriptors nor tasks add up, for browsers and for sessions."""

    def once() -> None:
        with Peer(site.scene) as peer:
            peer.uuid("Particles")
        wait_for(lambda: site.bridges == 0)

    def held() -> int:
        wait_for(lambda: session.viewer.clients == 0)
        gc.collect()
        return len(list(Path("/proc/self/fd").iterdir()))

    for work in (once, lambda: Session().close()):
        for _ in range(5):
            work()
        descriptors, threads = held(), threading.active_count()
        for _ in range(10):
            work()
        assert held() <= descriptors + 2
        # viser's pool may still be growing towards its bound on the way; it is the same for 10 and for 500.
        wait_for(lambda most=threads + 3: threading.active_count() <= most)
