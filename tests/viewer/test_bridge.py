"""The bridge passes messages on unchanged, refuses unwanted ones, and leaves nothing behind."""

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

from pftrack_server.viewer import viser_messages as messages
from pftrack_server.viewer.viser_messages import kind_of
from pftrack_server.viewer.viser_server import MAXIMUM_BYTES, MOST_HZ, bridge
from tests.viewer.host import PROTOCOL, SAID, Peer, Session, Site, drawing
from tests.waiting import wait_for


def test_scene_and_panel_pass_in_both_directions(session: Session, site: Site) -> None:
    """Drawings and changes pass, uncompressed; unwelcome messages are dropped, and the panel still works after them."""
    with Peer(site.scene) as peer:
        assert peer.socket.subprotocol == PROTOCOL
        session.show(drawing(), 0, lambda: "/particles" in peer.nodes)
        peer.send("ShareUrlRequest")
        peer.socket.send(b"rubbish")
        peer.move("Particles", 300, lambda: session.values["sample_count"] == 300)
    with connect(site.scene, subprotocols=[PROTOCOL], proxy=None) as browser:
        assert "Sec-WebSocket-Extensions" not in browser.response.headers  # type: ignore[union-attr]


def test_text_and_large_messages_end_the_connection(session: Session, site: Site) -> None:
    """No browser sends them; they never reach viser, and the reason names the limit."""
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
def test_only_messages_that_the_scene_needs_pass(data: bytes) -> None:
    """A browser may send no upload, tunnel, attribute of a control or malformed message."""
    assert kind_of(data) is None


def test_a_follower_moves_the_camera_and_nothing_else(session: Session, site: Site) -> None:
    """Controls and drags of a follower change nothing, and a tilted camera does not change what others see."""
    cameras = session.viewer._cameras
    site.looks_only = True
    drag = msgspec.msgpack.encode({"type": "SceneNodeDragMessage", **SAID["SceneNodeDragMessage"]})
    assert (kind_of(drag), kind_of(drag, looks_only=True)) == ("SceneNodeDragMessage", None)
    with Peer(site.scene) as follower:
        wait_for(lambda: session.viewer.clients == 1)
        follower.move("Particles", 55)
        follower.move_view("Front")
        follower.look(800, 600, position=(300.0, 400.0, 90.0))
        (watcher,) = cameras._watchers.values()
        wait_for(lambda: tuple(watcher.client.camera.position) == (300.0, 400.0, 90.0))
        assert (cameras.relief, watcher.preset) == (1.0, "oblique"), "a follower alone sees depth"
        site.looks_only = False
        with Peer(site.scene) as lecturer:
            lecturer.move("Particles", 77, lambda: session.values["sample_count"] == 77)
            session.show(drawing(), 0)
            lecturer.move_view("Front", until=lambda: cameras.relief == 0.0)
        assert session.changes == [{"sample_count": 77}]


def test_values_that_a_control_cannot_take_are_dropped(
    session: Session, peer: Peer, capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    """Many of them leave one warning and no traceback, and the next valid value is taken."""
    for value in ("many", None, {"a": 1}, [1, 2], float("nan")) * 4:
        peer.move("Particles", value)
    peer.move("Particles", 300, lambda: session.values["sample_count"] == 300)
    assert peer.socket.close_code is None
    assert capsys.readouterr().out.count("cannot handle") == 1
    assert caplog.records == []


def test_a_browser_that_sends_too_much_is_slowed(session: Session, site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """So nobody can keep the server busy; no message is lost."""
    heard = Mock(return_value=None)
    monkeypatch.setattr(messages, "kind_of", heard)
    monkeypatch.setattr("pftrack_server.viewer.viser_server.BURST", 20)
    with Peer(site.scene) as peer:
        wait_for(lambda: heard.call_count == 2)  # its camera, and its answer to a question
        begun = time.monotonic()
        for _ in range(20 + 60):
            peer.send("ViewerCameraMessage")
        wait_for(lambda: heard.call_count == 20 + 62)
        assert time.monotonic() - begun > 0.8 * 60 / MOST_HZ


def test_a_browser_that_vanishes_leaves_nothing(session: Session, site: Site) -> None:
    """A connection that is cut without a closing frame ends its bridge and its place in the scene."""
    peer = Peer(site.scene)
    wait_for(lambda: session.viewer.clients == 1)
    peer.socket.socket.shutdown(socket.SHUT_RDWR)
    wait_for(lambda: site.bridges == 0 and session.viewer.clients == 0)
    peer.close()


async def test_a_browser_that_leaves_before_it_is_accepted_raises_no_error() -> None:
    """A scene takes a moment to be made; a browser that does not wait for it is not logged as an unreadable file."""
    websocket: Any = SimpleNamespace(scope={}, accept=Mock(side_effect=OSError))
    endpoint: Any = SimpleNamespace(is_open=True)
    await bridge(websocket, endpoint)
    websocket.accept.assert_called_once()


def test_a_scene_that_ends_closes_its_browsers_and_lets_nobody_in(session: Session, site: Site) -> None:
    """A browser gets a closing code; a later one is refused before the upgrade."""
    with Peer(site.scene) as peer:
        wait_for(lambda: session.viewer.clients == 1)
        session.loop.call(session.viewer.close)
        wait_for(lambda: peer.socket.close_code == 1001)
        with pytest.raises(ConnectionClosed):
            peer.socket.send(b"late")
    with pytest.raises(InvalidStatus), connect(site.scene, subprotocols=[PROTOCOL], proxy=None):
        pass
    wait_for(lambda: site.bridges == 0)


def test_sessions_and_browsers_that_end_leave_nothing_behind() -> None:
    """Neither threads nor descriptors accumulate."""

    def once() -> None:
        session = Session()
        site = Site(session)
        with Peer(site.scene) as peer:
            peer.uuid("Particles")
        wait_for(lambda: site.bridges == session.viewer.clients == 0)
        site.close()
        session.close()

    def held() -> int:
        gc.collect()
        return len(list(Path("/proc/self/fd").iterdir()))

    for _ in range(2):
        once()
    descriptors, threads = held(), threading.active_count()
    for _ in range(5):
        once()
    assert held() <= descriptors + 2
    wait_for(lambda: threading.active_count() <= threads + 2)
