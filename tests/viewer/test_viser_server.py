"""A viser server works in the running loop, and is reached through its endpoint and in no other way."""

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any
from unittest.mock import AsyncMock, Mock

import psutil
import pytest
import viser

from pftrack_server.viewer import viser_server as server
from pftrack_server.viewer.viser_server import Endpoint, start
from tests.viewer.host import PROTOCOL, SAID, Websocket


def listening() -> set[tuple[int, str]]:
    """Return the sockets of this process on which somebody may connect."""
    mine = psutil.Process().net_connections("inet")
    return {(each.fd, str(each.laddr)) for each in mine if each.status == psutil.CONN_LISTEN}


def test_a_viser_that_opens_its_port_in_another_way_is_not_started(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scene that nobody can see is better than one that every page of every site can read."""
    monkeypatch.setattr(server, "OPENING", "elsewhere.serve(")
    server.install.cache_clear()
    before = listening()
    with pytest.raises(RuntimeError, match=r"viser 1\.1\.\d+ does not open its port by elsewhere"):
        start("Ball")
    assert listening() == before


async def test_a_server_has_neither_port_nor_thread(capsys: pytest.CaptureFixture[str]) -> None:
    """A scene opens no port and no socket in the file system; servers share the loop, which outlives each of them."""
    before, files = listening(), psutil.Process().net_connections("unix")
    threads = threading.active_count()
    (made, reached), (other, other_reached) = start("Ball"), start("Ball")
    await asyncio.sleep(0.01)
    assert (listening(), threading.active_count()) == (before, threads)
    named = {each.laddr for each in psutil.Process().net_connections("unix")}
    assert named <= {each.laddr for each in files} | {""}
    made.stop()
    await reached.wait_closed()
    assert other_reached.is_open
    other.stop()
    await other_reached.wait_closed()
    await asyncio.sleep(0.01)
    assert capsys.readouterr().out == "", "standard output belongs to the command"


@asynccontextmanager
async def running() -> AsyncIterator[tuple[viser.ViserServer, Endpoint]]:
    """Run a server for a minute at most."""
    made, reached = start("Ball")
    try:
        async with asyncio.timeout(60):
            yield made, reached
    finally:
        made.stop()
        await reached.wait_closed()


def join(reached: Endpoint, websocket: Any, subprotocol: str = PROTOCOL) -> asyncio.Task[server.Ending]:
    return asyncio.ensure_future(reached.serve(websocket, subprotocol))


async def test_the_sender_waits_until_a_message_is_taken() -> None:
    """So newer messages can replace unsent ones, and no buffer fills with stale frames."""
    async with running() as (made, reached):
        websocket = Websocket(takes=False)
        joined = join(reached, websocket)
        await websocket.begun.wait()
        for number in range(50):
            made.scene.set_global_visibility(bool(number % 2))
            made.flush()
            await asyncio.sleep(0.002)
        held = len(websocket.taken)
        websocket.free.set()
        await asyncio.sleep(0.2)
        assert held <= 2  # one for all browsers, one for this one
        assert len(websocket.taken) < held + 10
        websocket.said.put_nowait({"type": "websocket.disconnect"})
        assert await joined == (1001, "The browser has left")


async def test_a_failed_send_ends_the_connection(monkeypatch: pytest.MonkeyPatch) -> None:
    """The browser has left, which its websocket reports by an error; another version gets viser's own reason."""
    monkeypatch.setattr(Websocket, "send_bytes", AsyncMock(side_effect=RuntimeError("nobody is there")))
    async with running() as (_, reached):
        await join(reached, Websocket())
        code, reason = await join(reached, Websocket(), "viser-v0.0.1")
        assert (code, "0.0.1" in reason) == (1002, True)


async def test_what_fails_ends_alone(caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    """The failure is logged and reported to the browser; the next browser is served."""
    async with running() as (_, reached):
        websocket, other = Websocket(), Websocket()
        with monkeypatch.context() as broken:
            joined = join(reached, websocket)
            await websocket.begun.wait()
            broken.setattr(viser.infra.Message, "deserialize", Mock(side_effect=KeyError("on purpose")))
            broken.setattr(server.messages, "kind_of", lambda *_, **__: "ViewerCameraMessage")
            websocket.say("ViewerCameraMessage", **SAID["ViewerCameraMessage"])
            code, _ = await joined
        assert code == 1011
        assert "a connection to the scene failed" in caplog.text
        again = join(reached, other)
        await other.begun.wait()
        again.cancel()
