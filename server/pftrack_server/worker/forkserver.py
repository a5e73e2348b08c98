"""The forkserver: one process, ready and warm, from which every worker is forked in a few milliseconds."""

import asyncio
import contextlib
import multiprocessing
import os
import sys
import tempfile
import threading
import types
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import forkserver
from multiprocessing.context import ForkServerProcess

from pftrack.process import environment

__all__ = ["socket_folder", "spawn", "start"]

CONTEXT = multiprocessing.get_context("forkserver")
PRELOAD = "pftrack_server.worker.preload"
LOCK = threading.Lock()
SPAWNING = ThreadPoolExecutor(1, thread_name_prefix="spawning")
"""One thread for all that are to be made: until the forkserver is ready each waits, and would hold a thread."""

SECRETS = ("PFTRACK_TOKEN",)
"""Variables of the environment that stay in the web process."""

LONGEST_FOLDER = 107 - len("/pymp-12345678/listener-12345678")
"""A Unix socket's name has at most 107 bytes, and this is what multiprocessing appends to the temporary directory."""
SHORT_FOLDERS = ("/tmp", "/var/tmp", "/dev/shm")  # noqa: S108 - multiprocessing makes a folder of its own in it


def socket_folder() -> str:
    """Return where the forkserver's socket can be: the temporary directory unless its name is too long.

    Raises:
        OSError: No folder will do.
    """
    usual = tempfile.gettempdir()
    for folder in (usual, *SHORT_FOLDERS):
        if len(os.fsencode(folder)) <= LONGEST_FOLDER and os.access(folder, os.W_OK | os.X_OK):
            return folder
    raise OSError(
        f"The temporary directory {usual} cannot be used: its name may have at most {LONGEST_FOLDER} bytes, and it has "
        f"{len(os.fsencode(usual))}, since a Unix socket is made in it, and none of {', '.join(SHORT_FOLDERS)} can be "
        "written; set TMPDIR to a folder with a shorter name."
    )


def start() -> None:
    """Start the forkserver unless it runs already; it imports its preload while the caller goes on."""
    with LOCK, _environment(), _folder(socket_folder()):
        CONTEXT.set_forkserver_preload([PRELOAD])
        forkserver.ensure_running()


async def spawn(target: Callable[..., None], *arguments: object, name: str) -> ForkServerProcess:
    """Fork a daemonic process that calls `target` with the arguments.

    A socket among the arguments is duplicated into the child. When this is cancelled, the process is made first, and
    then ended: of half a request the forkserver would die, and with it every later session.
    """
    making = asyncio.get_running_loop().run_in_executor(SPAWNING, _spawn, target, arguments, name)
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
    secrets = [name for name in os.environ if name.upper() in SECRETS]
    wanted = {**environment(), **dict.fromkeys(secrets)}
    before = {name: os.environ.get(name) for name in wanted}
    _set(wanted)
    try:
        yield
    finally:
        _set(before)


def _set(variables: Mapping[str, str | None]) -> None:
    """Change the environment of this process, without those that are None."""
    for name, value in variables.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value


@contextlib.contextmanager
def _folder(folder: str) -> Iterator[None]:
    """Make temporary files in a folder; multiprocessing remembers that of its first socket."""
    before, tempfile.tempdir = tempfile.tempdir, folder
    try:
        yield
    finally:
        tempfile.tempdir = before


@contextlib.contextmanager
def _no_main() -> Iterator[None]:
    """Hide this process's main module from the child, which would import it again: 300 ms for a command line."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = types.ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main
