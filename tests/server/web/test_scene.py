"""The scene behind the server's one port: drawings reach it, changes in its panel reach the run."""

import os
import signal
import time
from typing import Any

import httpx
from websockets.sync.client import connect

from tests.server.host import Server, steer
from tests.server.sessions.test_duplex import changes, computed, has_changed, hear, until
from tests.server.web.test_ports import PROTOCOL
from tests.viewer.host import Peer
from tests.waiting import wait_for


def ask(server: Server, session: dict[str, Any], **command: Any) -> None:
    """Send a command as the panel of a session's scene does."""
    server.uvicorn.loop.call_soon_threadsafe(server.manager.get(session["id"]).scene_feed.ask, command)


def drawings(server: Server, session: str) -> list[int]:
    """Return a list that gets the frame of every drawing that a worker sends."""
    feed = server.manager.get(session).scene_feed
    offer, frames = feed.offer, []

    def offered(drawing: Any, frame: int) -> None:
        frames.append(frame)
        offer(drawing, frame)

    feed.offer = offered
    return frames


def test_the_scene_follows_the_session(server: Server, client: httpx.Client, session: dict[str, Any]) -> None:
    """Nothing is drawn while nobody looks; while somebody does, new frames reach the scene, also after a crash.

    A change in the scene's panel takes effect and is echoed; a wrong one is refused.
    """
    with connect(f"{server.ws}/api/v1/sessions/{session['id']}/stream") as stream:
        hear(stream)
        drawn = drawings(server, session["id"])
        steer(client, session["id"], "play")
        until(stream, computed(10))
        assert drawn == []
        ask(server, session, kind="change", values={"sample_count": 150})
        echo = changes(until(stream, lambda m: "parameters" in changes(m))[-1])
        assert echo["parameters"]["sample_count"] == 150
        ask(server, session, kind="change", values={"sample_count": -3})
        refused = until(stream, lambda m: m["type"] == "refused")[-1]
        assert (refused["field"], refused["value"]) == ("sample_count", -3)
        ask(server, session, kind="speed", speed=2.0)
        until(stream, has_changed(speed=2.0))
        with Peer(f"{server.ws}/viz/{session['id']}") as peer:
            assert peer.socket.subprotocol == PROTOCOL
            wait_for(lambda: peer.asked)
            seen = len(drawn)
            wait_for(lambda: len(drawn) >= seen + 5)
            os.kill(server.pid_of(session["id"]), signal.SIGKILL)
            until(stream, has_changed(state="crashed"))
            seen = len(drawn)
            client.post(f"/api/v1/sessions/{session['id']}/resume")
            steer(client, session["id"], "play")
            wait_for(lambda: len(drawn) > seen)
            time.sleep(0.1)
            assert peer.socket.close_code is None
