"""A viser server works in a loop that is running already, and leaves it as it was."""

import ast
import asyncio
import inspect
import textwrap
import threading

import pytest
import viser
from viser.infra import _infra

from pftrack_server.viewer import viser_adapter
from tests.apart import run
from tests.viewer.host import PROTOCOL
from tests.waiting import wait_for

VERSION = f"viser {viser.__version__}"


class TestContract:
    """What viser does with its loop, for which another one stands in."""

    def test_the_thread_makes_a_loop_and_runs_one_coroutine_in_it(self) -> None:
        """Beside that it gives work to it, and disposes of it at the end, which does nothing to a loop of others."""
        source = textwrap.dedent(inspect.getsource(_infra.WebsockServer._background_worker))
        used = {
            node.attr
            for node in ast.walk(ast.parse(source))
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "event_loop"
        }
        assert used == {"create_task", "run_until_complete", "stop", "close"}, (
            f"{VERSION} uses {sorted(used)} of its loop; see viser_adapter.loops"
        )
        assert "event_loop = asyncio.new_event_loop()" in source, f"{VERSION} makes its loop in another way"

    def test_no_other_loop_is_made(self) -> None:
        """Where the connection layer takes a loop from, another one can be given to it."""
        made = [
            node.attr
            for node in ast.walk(ast.parse(inspect.getsource(_infra)))
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "asyncio"
        ]
        assert made.count("new_event_loop") == made.count("set_event_loop") == 1, f"{VERSION} makes other loops"
        assert not {"run", "get_event_loop", "Runner"} & set(made), f"{VERSION} takes a loop from elsewhere"


def others() -> set[threading.Thread]:
    """The threads, but for those that the loop keeps for `to_thread`."""
    return {thread for thread in threading.enumerate() if not thread.name.startswith("asyncio_")}


def test_messages_are_made_and_taken_in_the_loop() -> None:
    """No thread stands between viser's sender and whoever takes its messages."""

    async def scene() -> None:
        loop = asyncio.get_running_loop()
        server, reached = await asyncio.to_thread(viser_adapter.start, "Ball", loop)
        taken: list[threading.Thread] = []
        news = asyncio.Event()

        async def take(message: bytes) -> None:
            del message
            taken.append(threading.current_thread())
            news.set()

        before = others()
        async with asyncio.timeout(60), reached.connect(PROTOCOL, take):
            await news.wait()
            news.clear()
            await asyncio.to_thread(server.scene.set_global_visibility, False)
            server.flush()
            await news.wait()
        assert set(taken) == {threading.current_thread()}
        await asyncio.to_thread(viser_adapter.stop, server)
        await asyncio.to_thread(wait_for, lambda: others() <= before)
        assert not reached.is_open
        await asyncio.sleep(0.01)  # the loop is neither stopped nor closed

    run(scene())


def test_several_servers_share_a_loop() -> None:
    """The end of one is no news for the others."""

    async def scene() -> None:
        loop = asyncio.get_running_loop()
        started = [await asyncio.to_thread(viser_adapter.start, "Ball", loop) for _ in range(3)]
        await asyncio.to_thread(viser_adapter.stop, started[0][0])
        assert [reached.is_open for _, reached in started] == [False, True, True]
        for server, _ in started[1:]:
            await asyncio.to_thread(viser_adapter.stop, server)

    run(scene())


def test_a_server_is_not_started_in_the_thread_of_its_loop() -> None:
    """Starting waits for the loop, which would then wait for itself."""

    async def scene() -> None:
        with pytest.raises(RuntimeError, match="beside the loop"):
            viser_adapter.start("Ball", asyncio.get_running_loop())

    run(scene())


def test_a_server_without_a_loop_has_one_of_its_own() -> None:
    """So has any other server of viser's in the process."""
    server, reached = viser_adapter.start("Ball")
    assert isinstance(server.get_event_loop(), asyncio.AbstractEventLoop)
    assert server.get_event_loop().is_running()
    assert reached.is_open
    viser_adapter.stop(server)
    assert server.get_event_loop().is_closed()
