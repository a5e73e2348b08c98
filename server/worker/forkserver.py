"""The forkserver: one process, ready and warm, from which every worker is forked in a few milliseconds."""

import asyncio
import contextlib
import multiprocessing
import os
import sys
import threading
import types
from collections.abc import Callable, Iterator
from multiprocessing import forkserver
from multiprocessing.context import ForkServerProcess

from pftrack.process import environment

__all__ = ["spawn", "start"]

CONTEXT = multiprocessing.get_context("forkserver")
PRELOAD = "server.worker.preload"
LOCK = threading.Lock()


def start() -> None:
    """Start the forkserver unless it runs already; it imports its preload while the caller goes on."""
    with LOCK, _environment():
        CONTEXT.set_forkserver_preload([PRELOAD])
        forkserver.ensure_running()


async def spawn(target: Callable[..., None], *arguments: object, name: str) -> ForkServerProcess:
    """Fork a daemonic process that calls `target` with the arguments.

    A socket among the arguments is duplicated into the child. When this is cancelled, the process is made first, and
    then ended: of half a request the forkserver would die, and with it every later session.
    """
    making = asyncio.ensure_future(asyncio.to_thread(_spawn, target, arguments, name))
    try:
        return await asyncio.shield(making)
    except asyncio.CancelledError:
        await asyncio.wait((making,))
        if making.exception() is None:
            await asyncio.to_thread(_end, making.result())
        raise


def _spawn(target: Callable[..., None], arguments: tuple[object, ...], name: str) -> ForkServerProcess:
    start()
    process = CONTEXT.Process(target=target, args=arguments, name=name, daemon=True)
    with LOCK, _no_main():
        process.start()
    return process


def _end(process: ForkServerProcess) -> None:
    process.kill()
    process.join()
    process.close()


@contextlib.contextmanager
def _environment() -> Iterator[None]:
    """Give this process a child's environment while the forkserver starts, which inherits it."""
    wanted = environment()
    before = {name: os.environ.get(name) for name in wanted}
    os.environ.update(wanted)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextlib.contextmanager
def _no_main() -> Iterator[None]:
    """Hide this process's main module from the child, which would import it again: 300 ms for a command line."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = types.ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main
