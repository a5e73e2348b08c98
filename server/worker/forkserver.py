"""The forkserver: one process, ready and warm, from which every worker is forked in a few milliseconds."""

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


def spawn(target: Callable[..., None], *arguments: object, name: str) -> ForkServerProcess:
    """Fork a daemonic process that calls `target` with the arguments.

    A socket among the arguments is duplicated into the child.
    """
    start()
    process = CONTEXT.Process(target=target, args=arguments, name=name, daemon=True)
    with LOCK, _no_main():
        process.start()
    return process


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
