"""A viser server works in the running loop, and is reached through its endpoint and in no other way."""

import ast
import asyncio
import inspect
import textwrap
import threading
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from typing import Any

import msgspec
import psutil
import pytest
import viser
from viser.infra import _infra

from pftrack_server.viewer import viser_server as server
from pftrack_server.viewer.viser_server import Endpoint, start
from tests.viewer.host import PROTOCOL
from tests.viewer.test_viser_contracts import SAID
from tests.waiting import wait_for

VERSION = f"viser {viser.__version__}"
CAMERA = msgspec.msgpack.encode({"type": "ViewerCameraMessage", **SAID["ViewerCameraMessage"]})


class Websocket:
    """A browser's websocket, as Starlette has it; what it is sent goes to a function."""

    def __init__(self, take: Callable[[bytes], Coroutine[Any, Any, None]]) -> None:
        self.send_bytes = take
        self.said: asyncio.Queue[dict[str, Any]] = asyncio.Queue()

    async def receive(self) -> dict[str, Any]:
        return await self.said.get()

    def leave(self) -> None:
        self.said.put_nowait({"type": "websocket.disconnect"})


def listening() -> set[tuple[int, str]]:
    """Return the sockets of this process on which somebody may connect."""
    mine = psutil.Process().net_connections("inet")
    return {(each.fd, str(each.laddr)) for each in mine if each.status == psutil.CONN_LISTEN}


def names_of(source: str, *objects: str) -> list[str]:
    """Return which attributes of objects are used in a source."""
    return [
        node.attr
        for node in ast.walk(ast.parse(textwrap.dedent(source)))
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in objects
    ]


class TestContract:
    """What viser's private parts have to be for a server to work here without a port."""

    def test_viser_opens_its_port_where_it_is_replaced(self) -> None:
        """Otherwise the server would listen; it is not started then."""
        source = inspect.getsource(_infra.WebsockServer._background_worker)
        assert server.OPENING in source, f"{VERSION} no longer opens its port by {server.OPENING}...)"

    def test_viser_uses_no_more_of_a_connection_than_there_is(self) -> None:
        """`Connection` stands in for that of websockets with four members."""
        tree = ast.parse(inspect.getsource(_infra))
        used = {
            name
            for function in ast.walk(tree)
            if isinstance(function, ast.AsyncFunctionDef)
            and function.name in {"ws_handler", "_message_producer", "_message_consumer"}
            for name in names_of(ast.unparse(function), "connection", "websocket")
        }
        assert used == {"subprotocol", "send", "recv", "close"}, f"{VERSION} uses {sorted(used)} of a connection"

    def test_a_viser_that_opens_its_port_otherwise_is_not_started(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A scene that nobody sees is better than one that every page of every site sees."""
        monkeypatch.setattr(server, "OPENING", "elsewhere.serve(")
        server.install.cache_clear()
        before = listening()
        with pytest.raises(RuntimeError, match=r"viser 1\.1\.\d+ does not open its port by elsewhere"):
            start("Ball")
        assert listening() == before

    def test_a_server_makes_one_loop_and_runs_one_coroutine_in_it(self) -> None:
        """Beside that it gives work to it, and disposes of it at the end, which is never reached here."""
        source = inspect.getsource(_infra.WebsockServer._background_worker)
        used = set(names_of(source, "event_loop"))
        assert used == {"create_task", "run_until_complete", "stop", "close"}, f"{VERSION} uses {sorted(used)}"
        assert "event_loop = asyncio.new_event_loop()" in source, f"{VERSION} makes its loop in another way"
        made = names_of(inspect.getsource(_infra), "asyncio")
        assert made.count("new_event_loop") == made.count("set_event_loop") == 1, f"{VERSION} makes other loops"
        assert not {"run", "get_event_loop", "Runner"} & set(made), f"{VERSION} takes a loop from elsewhere"

    def test_a_server_is_started_by_its_worker(self) -> None:
        """Which is called here without the thread, and says by a semaphore that it is ready."""
        source = inspect.getsource(server._start_thread)
        assert "self._background_worker(ready_sem)" in source, f"{VERSION} starts a server in another way"
        for stop in (_infra.WebsockServer.stop, viser.ViserServer.stop):
            used = set(names_of(inspect.getsource(stop), "loop_thread")) | {"join"}
            assert used == {"join"}, f"{VERSION} waits for its thread by {sorted(used)}"


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


async def test_a_server_that_ends_before_it_has_begun_is_no_error() -> None:
    """A session may be ended while its scene is made."""
    made, reached = start("Ball")
    made.stop()
    await asyncio.wait_for(reached.wait_closed(), 10)
    assert not reached.is_open


async def test_several_servers_share_a_loop() -> None:
    """The end of one is no news for the others."""
    started = [start("Ball") for _ in range(3)]
    started[0][0].stop()
    await started[0][1].wait_closed()
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
    """Run a server for twenty seconds at most."""
    made, reached = start("Ball")
    try:
        async with asyncio.timeout(20):
            yield made, reached
    finally:
        made.stop()
        await reached.wait_closed()


def join(reached: Endpoint, websocket: Any, subprotocol: str = PROTOCOL) -> asyncio.Task[server.Ending]:
    return asyncio.ensure_future(reached.serve(websocket, subprotocol))


async def test_the_sender_waits_until_a_message_is_taken() -> None:
    """So what is not sent yet can be replaced by what is newer, and no buffer fills with stale frames."""
    async with running() as (made, reached):
        taken: list[bytes] = []
        begun, free = asyncio.Event(), asyncio.Event()

        async def take(message: bytes) -> None:
            taken.append(message)
            begun.set()
            await free.wait()

        websocket = Websocket(take)
        joined = join(reached, websocket)
        await begun.wait()
        for number in range(50):
            made.scene.set_global_visibility(bool(number % 2))
            made.flush()
            await asyncio.sleep(0.002)
        held = len(taken)
        free.set()
        await asyncio.sleep(0.2)
        assert held <= 2  # one for all browsers, one for this one
        assert len(taken) < held + 10
        websocket.leave()
        assert await joined == (1001, "The browser has left")


async def test_who_comes_is_waited_for_no_longer() -> None:
    """What was shown before anybody came is drawn for the first browser, before it has said anything."""
    async with running() as (_, reached):

        async def take(message: bytes) -> None:
            del message

        waiting = asyncio.ensure_future(reached.wait_for_browser())
        await asyncio.sleep(0.01)
        assert not waiting.done()
        joined = join(reached, Websocket(take))
        await asyncio.wait_for(waiting, 5)
        joined.cancel()


async def test_leaving_ends_a_connection_whose_message_is_never_taken() -> None:
    """A browser that hangs and is given up must not keep its place in the scene."""
    async with running() as (made, reached):
        begun = asyncio.Event()

        async def take(message: bytes) -> None:
            del message
            begun.set()
            await asyncio.Event().wait()

        joined = join(reached, Websocket(take))
        await begun.wait()
        joined.cancel()
        await asyncio.gather(joined, return_exceptions=True)
        assert not reached._connections
        assert not made._websock_server._live_connections


async def test_a_message_that_cannot_be_taken_ends_the_connection() -> None:
    """The browser has gone, which its websocket says by an error."""
    async with running() as (_, reached):

        async def take(message: bytes) -> None:
            raise RuntimeError(f"nobody is there for {len(message)} bytes")

        await join(reached, Websocket(take))


async def test_a_client_of_another_version_is_told_so() -> None:
    """Viser's own reason for closing reaches the browser."""
    async with running() as (_, reached):

        async def take(message: bytes) -> None:
            raise AssertionError(message)

        code, reason = await join(reached, Websocket(take), "viser-v0.0.1")
        assert code == 1002
        assert "0.0.1" in reason


async def test_a_connection_that_fails_ends_alone(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What goes wrong is logged and told; the next browser is served."""
    async with running() as (_, reached):
        begun = asyncio.Event()

        async def take(message: bytes) -> None:
            del message
            begun.set()

        def fail(_: bytes) -> None:
            raise KeyError("on purpose")

        websocket = Websocket(take)
        with monkeypatch.context() as broken:
            joined = join(reached, websocket)
            await begun.wait()
            broken.setattr(viser.infra.Message, "deserialize", fail)
            broken.setattr(server.messages, "kind_of", lambda *_, **__: "ViewerCameraMessage")
            websocket.said.put_nowait({"type": "websocket.receive", "bytes": CAMERA})
            code, _ = await joined
        assert code == 1011
        assert "a connection to the scene failed" in caplog.text
        begun.clear()
        again = join(reached, Websocket(take))
        await begun.wait()
        again.cancel()


async def test_a_server_that_ends_tells_its_connections_and_takes_no_more() -> None:
    """Also a connection that is made while the server ends is told."""
    async with running() as (made, reached):
        begun = asyncio.Event()

        async def take(message: bytes) -> None:
            del message
            begun.set()

        joined = join(reached, Websocket(take))
        await begun.wait()
        made.stop()
        late = join(reached, Websocket(take))
        endings = await asyncio.gather(joined, late)
        endings.append(await join(reached, Websocket(take)))
        assert {code for code, _ in endings} == {1001}
