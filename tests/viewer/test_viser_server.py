"""A viser server works in the running loop, and is reached through its endpoint and in no other way."""

import ast
import asyncio
import inspect
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any
from unittest.mock import AsyncMock, Mock

import msgspec
import psutil
import pytest
import viser
from viser.infra import _infra

from pftrack_server.viewer import viser_server as server
from pftrack_server.viewer.viser_server import Endpoint, start
from tests.viewer.host import PROTOCOL, names_of
from tests.viewer.test_viser_contracts import SAID
from tests.waiting import wait_for

VERSION = f"viser {viser.__version__}"
CAMERA = msgspec.msgpack.encode({"type": "ViewerCameraMessage", **SAID["ViewerCameraMessage"]})


class Websocket:
    """A browser's websocket, as Starlette has it, which takes what it is sent once it may."""

    def __init__(self, *, takes: bool = True) -> None:
        self.taken: list[bytes] = []
        self.begun, self.free = asyncio.Event(), asyncio.Event()
        self.said: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        if takes:
            self.free.set()

    async def send_bytes(self, message: bytes) -> None:
        self.taken.append(message)
        self.begun.set()
        await self.free.wait()

    async def receive(self) -> dict[str, Any]:
        return await self.said.get()


def listening() -> set[tuple[int, str]]:
    """Return the sockets of this process on which somebody may connect."""
    mine = psutil.Process().net_connections("inet")
    return {(each.fd, str(each.laddr)) for each in mine if each.status == psutil.CONN_LISTEN}


def test_what_viser_is_to_be_for_a_server_to_work_without_a_port() -> None:
    """It opens its port where that is replaced, and uses no more of a connection than there is.

    `Connection` stands in for that of websockets with four members. A server makes one loop and runs one coroutine in
    it; beside that it gives work to it, and disposes of it at the end, which is never reached here.
    """
    source, tree = inspect.getsource(_infra.WebsockServer._background_worker), ast.parse(inspect.getsource(_infra))
    assert server.OPENING in source, f"{VERSION} no longer opens its port by {server.OPENING}...)"
    handlers = {"ws_handler", "_message_producer", "_message_consumer"}
    functions = [each for each in ast.walk(tree) if isinstance(each, ast.AsyncFunctionDef) and each.name in handlers]
    used = {name for each in functions for name in names_of(ast.unparse(each), "connection", "websocket")}
    assert used == {"subprotocol", "send", "recv", "close"}, f"{VERSION} uses {sorted(used)} of a connection"
    used = set(names_of(source, "event_loop"))
    assert used == {"create_task", "run_until_complete", "stop", "close"}, f"{VERSION} uses {sorted(used)}"
    assert "event_loop = asyncio.new_event_loop()" in source, f"{VERSION} makes its loop in another way"
    made = names_of(inspect.getsource(_infra), "asyncio")
    assert made.count("new_event_loop") == made.count("set_event_loop") == 1, f"{VERSION} makes other loops"
    assert not {"run", "get_event_loop", "Runner"} & set(made), f"{VERSION} takes a loop from elsewhere"


def test_a_server_of_visers_is_started_by_its_worker() -> None:
    """Which is called here without the thread, and says by a semaphore that it is ready."""
    source = inspect.getsource(server._start_thread)
    assert "self._background_worker(ready_sem)" in source, f"{VERSION} starts a server in another way"
    for stop in (_infra.WebsockServer.stop, viser.ViserServer.stop):
        used = set(names_of(inspect.getsource(stop), "loop_thread")) | {"join"}
        assert used == {"join"}, f"{VERSION} waits for its thread by {sorted(used)}"


def test_a_viser_that_opens_its_port_otherwise_is_not_started(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scene that nobody sees is better than one that every page of every site sees."""
    monkeypatch.setattr(server, "OPENING", "elsewhere.serve(")
    server.install.cache_clear()
    before = listening()
    with pytest.raises(RuntimeError, match=r"viser 1\.1\.\d+ does not open its port by elsewhere"):
        start("Ball")
    assert listening() == before


async def test_a_server_has_neither_port_nor_thread(capsys: pytest.CaptureFixture[str]) -> None:
    """Neither a port nor a socket in the file system is opened for a scene, and the loop goes on after its end."""
    before, files = listening(), psutil.Process().net_connections("unix")
    threads = threading.active_count()
    made, reached = start("Ball")
    await asyncio.sleep(0.01)
    assert (listening(), threading.active_count()) == (before, threads)
    named = {each.laddr for each in psutil.Process().net_connections("unix")}
    assert named <= {each.laddr for each in files} | {""}
    made.stop()
    await reached.wait_closed()
    await asyncio.sleep(0.01)
    assert capsys.readouterr().out == "", "standard output belongs to the command"


async def test_several_servers_share_a_loop() -> None:
    """The end of one is no news for the others, and no error before it has begun: its session may have ended."""
    started = [start("Ball") for _ in range(3)]
    started[0][0].stop()
    await asyncio.wait_for(started[0][1].wait_closed(), 60)
    assert [reached.is_open for _, reached in started] == [False, True, True]
    for made, reached in started[1:]:
        made.stop()
        await reached.wait_closed()


def test_another_server_of_visers_still_has_a_port_and_a_loop() -> None:
    """Only what is given an endpoint in place of a host is kept from listening."""
    server.install()
    before = listening()
    other = viser.ViserServer("127.0.0.1", 0, verbose=False)
    assert len(listening() - before) == 1
    assert other.get_event_loop().is_running()
    other.stop()
    wait_for(other.get_event_loop().is_closed)


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
    """So what is not sent yet can be replaced by what is newer, and no buffer fills with stale frames."""
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


async def test_a_browser_that_hangs_and_is_given_up_does_not_keep_its_place() -> None:
    """Whoever comes is waited for no longer: what was shown before is drawn before they have said anything."""
    async with running() as (made, reached):
        waiting = asyncio.ensure_future(reached.wait_for_browser())
        await asyncio.sleep(0.01)
        assert not waiting.done()
        websocket = Websocket(takes=False)
        joined = join(reached, websocket)
        await waiting
        await websocket.begun.wait()
        joined.cancel()
        await asyncio.gather(joined, return_exceptions=True)
        assert not reached._connections
        assert not made._websock_server._live_connections


async def test_a_message_that_cannot_be_taken_ends_the_connection(monkeypatch: pytest.MonkeyPatch) -> None:
    """The browser has gone, which its websocket says by an error; one of another version hears viser's own reason."""
    monkeypatch.setattr(Websocket, "send_bytes", AsyncMock(side_effect=RuntimeError("nobody is there")))
    async with running() as (_, reached):
        await join(reached, Websocket())
        code, reason = await join(reached, Websocket(), "viser-v0.0.1")
        assert (code, "0.0.1" in reason) == (1002, True)


async def test_a_connection_that_fails_ends_alone(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What goes wrong is logged and told; the next browser is served."""
    async with running() as (_, reached):
        websocket, other = Websocket(), Websocket()
        with monkeypatch.context() as broken:
            joined = join(reached, websocket)
            await websocket.begun.wait()
            broken.setattr(viser.infra.Message, "deserialize", Mock(side_effect=KeyError("on purpose")))
            broken.setattr(server.messages, "kind_of", lambda *_, **__: "ViewerCameraMessage")
            websocket.said.put_nowait({"type": "websocket.receive", "bytes": CAMERA})
            code, _ = await joined
        assert code == 1011
        assert "a connection to the scene failed" in caplog.text
        again = join(reached, other)
        await other.begun.wait()
        again.cancel()


async def test_a_server_that_ends_tells_its_connections_and_takes_no_more() -> None:
    """Also a connection that is made while the server ends is told."""
    async with running() as (made, reached):
        websocket = Websocket()
        joined = join(reached, websocket)
        await websocket.begun.wait()
        made.stop()
        endings = await asyncio.gather(joined, join(reached, Websocket()))
        endings.append(await join(reached, Websocket()))
        assert {code for code, _ in endings} == {1001}
