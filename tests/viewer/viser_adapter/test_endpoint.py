"""A viser server is reached through its endpoint, and in no other way."""

import ast
import asyncio
import inspect
from collections.abc import Callable, Coroutine
from typing import Any

import psutil
import pytest
import viser
from viser.infra import _infra

from pftrack_server.viewer import viser_adapter
from pftrack_server.viewer.viser_adapter import Endpoint, endpoint
from tests.apart import run
from tests.viewer.host import PROTOCOL

CAMERA = b"\x81\xa4type\xb3ViewerCameraMessage"


def listening() -> set[tuple[int, str]]:
    """Return the sockets of this process on which somebody may connect."""
    mine = psutil.Process().net_connections("inet")
    return {(each.fd, str(each.laddr)) for each in mine if each.status == psutil.CONN_LISTEN}


class TestContract:
    """What viser's private parts have to be for the endpoint to take the place of its port."""

    def test_viser_opens_its_port_where_it_is_replaced(self) -> None:
        """Otherwise the server would listen; it is not started then."""
        source = inspect.getsource(_infra.WebsockServer._background_worker)
        assert endpoint.OPENING in source, (
            f"viser {viser.__version__} no longer opens its port by {endpoint.OPENING}...); see endpoint.install"
        )

    def test_viser_uses_no_more_of_a_connection_than_there_is(self) -> None:
        """`Connection` stands in for that of websockets with four members."""
        tree = ast.parse(inspect.getsource(_infra))
        used = {
            node.attr
            for function in ast.walk(tree)
            if isinstance(function, ast.AsyncFunctionDef)
            and function.name in {"ws_handler", "_message_producer", "_message_consumer"}
            for node in ast.walk(function)
            if isinstance(node, ast.Attribute)
            and isinstance(node.value, ast.Name)
            and node.value.id in {"connection", "websocket"}
        }
        assert used == {"subprotocol", "send", "recv", "close"}, (
            f"viser {viser.__version__} uses {sorted(used)} of a connection; "
            "endpoint.Connection has subprotocol, send, recv and close"
        )

    def test_a_viser_that_opens_its_port_otherwise_is_not_started(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A scene that nobody sees is better than one that every page of every site sees."""
        monkeypatch.setattr(endpoint, "OPENING", "elsewhere.serve(")
        before = listening()
        with pytest.raises(RuntimeError, match=r"viser 1\.1\.\d+ does not open its port by elsewhere"):
            viser_adapter.start("Ball")
        assert listening() == before


def test_a_server_listens_nowhere() -> None:
    """Neither a port nor a socket in the file system is opened for a scene."""
    before, files = listening(), psutil.Process().net_connections("unix")
    server, _ = viser_adapter.start("Ball")
    assert listening() == before
    # The loop's own pair of sockets, which wakes it up, has no name.
    assert {each.laddr for each in psutil.Process().net_connections("unix")} <= {each.laddr for each in files} | {""}
    viser_adapter.stop(server)


def test_another_server_of_visers_still_has_a_port() -> None:
    """Only what is given an endpoint in place of a host is kept from listening."""
    viser_adapter.stop(viser_adapter.start("Ball")[0])
    before = listening()
    other = viser.ViserServer("127.0.0.1", 0, verbose=False)
    assert len(listening() - before) == 1
    viser_adapter.stop(other)


def play(scene: Callable[[viser.ViserServer, Endpoint], Coroutine[Any, Any, None]]) -> None:
    """Run a coroutine beside a server."""
    server, reached = viser_adapter.start("Ball")
    try:
        run(scene(server, reached))
    finally:
        viser_adapter.stop(server)


def test_the_sender_waits_until_a_message_is_taken() -> None:
    """So what is not sent yet can be replaced by what is newer, and no buffer fills with stale frames."""

    async def scene(server: viser.ViserServer, reached: Endpoint) -> None:
        taken: list[bytes] = []
        begun, free = asyncio.Event(), asyncio.Event()

        async def take(message: bytes) -> None:
            taken.append(message)
            begun.set()
            await free.wait()

        async with reached.connect(PROTOCOL, take):
            await begun.wait()
            for number in range(50):
                server.scene.set_global_visibility(bool(number % 2))
                server.flush()
                await asyncio.sleep(0.002)
            held = len(taken)
            free.set()
            await asyncio.sleep(0.2)
            assert held <= 2  # one for all browsers, one for this one
            assert len(taken) < held + 10

    play(scene)


def test_leaving_ends_a_connection_whose_message_is_never_taken() -> None:
    """A browser that hangs and is given up must not keep its place in the scene."""

    async def scene(server: viser.ViserServer, reached: Endpoint) -> None:
        begun = asyncio.Event()

        async def take(message: bytes) -> None:
            del message
            begun.set()
            await asyncio.Event().wait()

        async with asyncio.timeout(5):
            async with reached.connect(PROTOCOL, take):
                await begun.wait()
            assert not reached._handling

    play(scene)


def test_a_message_that_cannot_be_taken_ends_the_connection() -> None:
    """The browser has gone, which its websocket says by an error."""

    async def scene(server: viser.ViserServer, reached: Endpoint) -> None:
        async def take(message: bytes) -> None:
            raise RuntimeError(f"nobody is there for {len(message)} bytes")

        async with asyncio.timeout(5), reached.connect(PROTOCOL, take) as connection:
            await connection.wait_closed()

    play(scene)


def test_a_client_of_another_version_is_told_so() -> None:
    """Viser's own reason for closing reaches the browser."""

    async def scene(server: viser.ViserServer, reached: Endpoint) -> None:
        async def take(message: bytes) -> None:
            raise AssertionError(message)

        async with asyncio.timeout(5), reached.connect("viser-v0.0.1", take) as connection:
            code, reason = await connection.wait_closed()
        assert code == 1002
        assert "0.0.1" in reason

    play(scene)


def test_a_message_that_viser_cannot_read_ends_only_its_own_connection(caplog: pytest.LogCaptureFixture) -> None:
    """What goes wrong is logged and told; the next browser is served."""

    async def scene(server: viser.ViserServer, reached: Endpoint) -> None:
        begun = asyncio.Event()

        async def take(message: bytes) -> None:
            del message
            begun.set()

        async with asyncio.timeout(5), reached.connect(PROTOCOL, take) as connection:
            connection.deliver(CAMERA)
            code, _ = await connection.wait_closed()
        assert code == 1011
        assert "a connection to the scene failed" in caplog.text
        begun.clear()
        async with asyncio.timeout(5), reached.connect(PROTOCOL, take):
            await begun.wait()

    play(scene)


def test_a_server_that_ends_tells_its_connections_and_takes_no_more() -> None:
    """Also a connection that is made while the server ends is told."""

    async def scene(server: viser.ViserServer, reached: Endpoint) -> None:
        async def take(message: bytes) -> None:
            del message

        async with asyncio.timeout(10), reached.connect(PROTOCOL, take) as connection:
            ending = asyncio.create_task(asyncio.to_thread(viser_adapter.stop, server))
            endings = [await connection.wait_closed()]
            while reached.is_open:
                async with reached.connect(PROTOCOL, take) as late:
                    endings.append(await late.wait_closed())
            await ending
        assert {code for code, _ in endings} == {1001}
        with pytest.raises(ConnectionRefusedError):
            reached.connect(PROTOCOL, take)

    play(scene)
