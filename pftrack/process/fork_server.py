"""The fork server: a process that has imported everything and waits, from which children are forked in milliseconds.

A fresh interpreter needs most of a second of processor time before it computes; a fork of a warm one shares all imports
with its siblings. The fork server does not start threads, since a fork copies their locks, but not the threads. It can
load further modules when the first child needs them (`fork`). It lives as long as the socket between it and its owner;
its children are ended with it.
"""

import asyncio
import atexit
import gc
import importlib
import os
import pickle
import selectors
import signal
import socket
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable, Container
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

from pftrack.process.child import NUMBER, ONE_THREAD, BlockingEnd, Child, command, environment, pair
from pftrack.process.limits import adopt_orphans, close_descriptors, leave_interrupts_to_parent

GRACE_S = 5.0
NEW_CHILD, LOAD = b"+", b"="
"""A request of an owner: a call in a child, or in the fork server itself."""


class ForkServer:
    """A fork server, as its owner sees it; one that was lost is started again by the next child.

    Attributes:
        preload: The module that it imports before it forks; it may be another until the fork server runs.
    """

    def __init__(self, preload: str, *, secrets: tuple[str, ...] = ()) -> None:
        """Take note of what it shall be; it is started with its first child, or by `start`.

        Args:
            preload: The module that it imports before it forks.
            secrets: Variables of the environment that it shall not have.
        """
        self.preload = preload
        self._secrets = secrets
        self._lock = threading.Lock()
        self._socket: socket.socket | None = None
        self._loaded: set[bytes] = set()
        self._has_forked = False
        self._wait: Callable[[], object] = lambda: None
        self._forking = ThreadPoolExecutor(1, thread_name_prefix="forking")
        """One thread for all that are to be made: until the fork server is ready each waits, and would hold one."""

    def start(self) -> None:
        """Start it unless it runs; it imports its preload while the caller goes on."""
        with self._lock:
            self._running()

    def fork_off(self) -> None:
        """Import the preload here, and fork the server off this process, which must not have started a thread yet.

        So shared imports are in memory once. A secret that is in the environment of this process would be in that of
        the server, too; take it away before (`take_secret`).
        """
        os.environ.update(ONE_THREAD)
        importlib.import_module(self.preload)
        _freeze()
        ours, theirs = socket.socketpair()
        sys.stdout.flush()
        process = os.fork()
        if process == 0:
            close_descriptors(keep=theirs.fileno())
            ours.detach()
            _end_after(serve, theirs)
        theirs.close()
        self._socket, self._wait = ours, lambda: os.waitpid(process, 0)

    def fork(
        self,
        function: Callable[..., None],
        *arguments: object,
        load: tuple[Callable[..., object], object] | None = None,
    ) -> Child:
        """Fork a child that calls a function with its end of a pipe and the arguments, and ends when that returns.

        Args:
            function: A function of a module.
            arguments: Values that can be pickled.
            load: A function and its argument, which the fork server calls once before: all children that are forked
                later share what it loads. It must not start threads; its exceptions have no effect.

        Raises:
            OSError: The system makes no process, or the preload cannot be imported.
        """
        body = pickle.dumps((function, arguments), protocol=5)  # first: a failed pickle then costs no child
        first = pickle.dumps((load[0], load[1:]), protocol=5) if load else None
        ours, theirs = pair()
        try:
            with theirs:
                pid, sentinel = self._request_fork(theirs, first)
        except BaseException:
            ours.close()
            raise
        child = Child(pid, ours, sentinel)
        with suppress(BrokenPipeError, ConnectionResetError):  # its status shows that it has ended
            BlockingEnd(ours, bytes).send(body)
        return child

    async def fork_async(
        self,
        function: Callable[..., None],
        *arguments: object,
        load: tuple[Callable[..., object], object] | None = None,
    ) -> Child:
        """Fork a child as `fork` does, while others go on.

        When this is cancelled, however often, the child is made first, and then ended.
        """
        making = asyncio.get_running_loop().run_in_executor(
            self._forking, lambda: self.fork(function, *arguments, load=load)
        )
        try:
            return await asyncio.shield(making)
        except asyncio.CancelledError:
            ending = asyncio.ensure_future(_end_unwanted(making))
            while not ending.done():  # a second cancellation must not leave the child behind
                with suppress(asyncio.CancelledError):
                    await asyncio.wait((ending,))
            raise

    def close(self) -> None:
        """End it, and with it all of its children."""
        self._forking.shutdown(wait=False)
        with self._lock:
            self._let_go()

    def _request_fork(self, theirs: socket.socket, load: bytes | None) -> tuple[int, int]:
        """Have a child forked; return its number, and the descriptor that will carry its exit status."""
        with self._lock:
            for _ in range(2):
                if load is not None:
                    self._load(load)
                sentinel, told = os.pipe()
                with suppress(OSError):  # it was lost: the sentinel shows that
                    socket.send_fds(self._running(), [NEW_CHILD], [theirs.fileno(), told])
                os.close(told)
                number = os.read(sentinel, NUMBER.size)
                if len(number) == NUMBER.size:
                    self._has_forked = True
                    (pid,) = NUMBER.unpack(number)
                    if pid > 0:
                        return pid, sentinel
                    os.close(sentinel)
                    raise OSError(-pid, os.strerror(-pid))
                os.close(sentinel)
                self._let_go()
        raise ChildProcessError(f"no process can be made: the one that makes them could not import {self.preload}")

    def _load(self, call: bytes) -> None:
        """Have it call something unless it has; where it is lost meanwhile, the next fork finds that out."""
        if call in self._loaded:
            return
        self._loaded.add(call)
        ours, theirs = pair()
        with ours, suppress(OSError, EOFError):
            with theirs:
                socket.send_fds(self._running(), [LOAD], [theirs.fileno()])
            pipe = BlockingEnd(ours, bytes)
            pipe.send(call)
            pipe.receive()

    def _running(self) -> socket.socket:
        if self._socket is None:
            ours, theirs = socket.socketpair()
            # In the owner's own group, so ending the group of a driver ends everything that belongs to it.
            own = {name: value for name, value in environment().items() if name.upper() not in self._secrets}
            with theirs:
                process = subprocess.Popen(  # noqa: S603 - this very Python and a module of ours
                    command("pftrack.process", str(theirs.fileno()), self.preload),
                    pass_fds=[theirs.fileno()],
                    stdin=subprocess.DEVNULL,
                    env=own,
                )

            def wait() -> None:
                if self._has_forked:  # one that still imports has no children to end
                    with suppress(subprocess.TimeoutExpired):
                        process.wait(GRACE_S)
                process.kill()
                process.wait()

            atexit.register(self.close)

            self._socket, self._wait = ours, wait
        return self._socket

    def _let_go(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._wait()
            self._socket, self._has_forked = None, False
            self._loaded.clear()
            atexit.unregister(self.close)


async def _end_unwanted(making: asyncio.Future[Child]) -> None:
    """End the child that is being made, if it can be made, and let go of what belongs to it."""
    await asyncio.wait((making,))
    if making.exception() is None:
        child = making.result()
        child.kill()
        child.end.close()
        await child.wait()


def main(descriptor: int, preload: str) -> None:
    """Be a fork server for the owner at the other end of a socket."""
    owner = socket.socket(fileno=descriptor)
    leave_interrupts_to_parent()
    importlib.import_module(preload)
    serve(owner)


def serve(owner: socket.socket) -> None:
    """Fork children until the owner lets go of the socket.

    Signals are the owner's business: a terminal sends Ctrl-C to the whole group, and the owner decides.
    """
    leave_interrupts_to_parent()
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    adopt_orphans()
    _freeze()
    woken, wakes = os.pipe()
    os.set_blocking(woken, False)
    os.set_blocking(wakes, False)
    signal.set_wakeup_fd(wakes, warn_on_full_buffer=False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    children: dict[int, int] = {}
    with selectors.DefaultSelector() as selector:
        selector.register(owner, selectors.EVENT_READ)
        selector.register(woken, selectors.EVENT_READ)
        mine = [owner.fileno(), woken, wakes, selector.fileno()]
        while True:
            for key, _ in selector.select():
                if key.fileobj is owner:
                    if not _serve_request(owner, children, mine):
                        for pid in children:
                            os.kill(pid, signal.SIGKILL)
                            _end_group(pid)
                        while _end_orphans({}):
                            with suppress(ChildProcessError):
                                os.wait()
                        return
                else:
                    with suppress(BlockingIOError):
                        os.read(woken, 4096)
                    _reap(children)


def _freeze() -> None:
    """Keep what is here from children's garbage collectors, which would copy the pages that all of them share."""
    gc.collect()
    gc.freeze()


def _serve_request(owner: socket.socket, children: dict[int, int], mine: list[int]) -> bool:
    """Do what the owner wants; return whether the owner is there."""
    try:
        wish, ends, *_ = socket.recv_fds(owner, 1, 2)
    except OSError:
        return False
    if wish == NEW_CHILD:
        _fork(owner, children, mine, *ends)
    elif wish == LOAD:
        _load(*ends)
    return bool(wish)


def _load(end: int) -> None:
    """Call the owner's loading function, and report when it is done."""
    with socket.socket(fileno=end) as ours, suppress(EOFError, OSError):
        pipe = BlockingEnd(ours)
        try:
            function, arguments = pipe.receive()
            function(*arguments)
        except Exception:  # noqa: BLE001 - the child that needs it says what is wrong
            traceback.print_exc()
        _freeze()
        pipe.send(None)


def _fork(owner: socket.socket, children: dict[int, int], mine: list[int], end: int, told: int) -> None:
    """Fork a child that gets one end of a pipe, and whose status is written to a descriptor."""
    try:
        pid = os.fork()
    except OSError as error:
        pid = -(error.errno or 1)
    if pid == 0:
        for descriptor in (*mine, told, *children.values()):
            os.close(descriptor)
        signal.set_wakeup_fd(-1)
        for number in (signal.SIGCHLD, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        owner.detach()
        _end_after(_call, socket.socket(fileno=end))
    os.close(end)
    _tell(told, pid)
    if pid > 0:
        children[pid] = told
    else:
        os.close(told)


def _reap(children: dict[int, int]) -> None:
    """Take note of children that have ended, and end what they leave behind."""
    with suppress(ChildProcessError):  # there are none
        while (ended := os.waitpid(-1, os.WNOHANG))[0]:
            pid, status = ended
            if pid in children:
                _end_group(pid)
                told = children.pop(pid)
                _tell(told, os.waitstatus_to_exitcode(status))
                os.close(told)
            _end_orphans(children)


def _end_orphans(children: Container[int]) -> bool:
    """End what was started by children that have ended, in whatever group; return whether there was any.

    Orphans become children of this process (`adopt_orphans`), and so do their own children.
    """
    try:
        listed = Path(f"/proc/self/task/{os.getpid()}/children").read_text(encoding="ascii").split()
    except OSError:  # another system than Linux
        return False
    orphans = [pid for pid in map(int, listed) if pid not in children]
    for pid in orphans:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    return bool(orphans)


def _end_group(pid: int) -> None:
    """End all processes that a child has started, if it led its own group."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(pid, signal.SIGKILL)


def _tell(told: int, number: int) -> None:
    with suppress(BrokenPipeError):  # the owner has gone
        os.write(told, NUMBER.pack(number))


def _call(end: socket.socket) -> None:
    """Be a child: call what the owner wants."""
    try:
        function, arguments = BlockingEnd(end).receive()
    except (EOFError, ConnectionResetError):  # nobody needs it any more
        return
    function(end, *arguments)


def _end_after(function: Callable[..., None], *arguments: object) -> NoReturn:
    """Call a function in a process that was forked, and end the process as if it had never been anything else."""
    status = 1
    try:
        function(*arguments)
        status = 0
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
    except BaseException:  # noqa: BLE001 - nothing may come back to where this process was forked
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        os._exit(status)
