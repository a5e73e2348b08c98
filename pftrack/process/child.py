"""Children from the parent's side: their process number, the pipe to them, and their end.

The pipe carries whole messages over a socket pair, length first. The child's end blocks, as it has nothing else to do.
The parent's end never does: a child that is stopped in the middle of a message must not stop all others, so
`multiprocessing`'s own connections do not suit.
"""

import asyncio
import os
import pickle
import select
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from enum import Enum, auto
from typing import Any, Literal, cast

Pack = Callable[[Any], bytes]
Unpack = Callable[[bytearray], Any]

LENGTH = struct.Struct("!Q")
LARGEST_MESSAGE = 256 * 1024 * 1024
BUFFER_BYTES = 1024 * 1024


def pair() -> tuple[socket.socket, socket.socket]:
    """Return two connected ends with room for a picture in between."""
    ends = socket.socketpair()
    for end in ends:
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
    return ends


def _pickle(message: object) -> bytes:
    return pickle.dumps(message, protocol=5)


def _with_length(body: bytes) -> list[bytes]:
    return [LENGTH.pack(len(body)), body]


class BlockingEnd:
    """An end that waits, as a child's does.

    Args:
        end: One end of a pair.
        pack: Writes a message, as the other end reads it.
    """

    def __init__(self, end: socket.socket, pack: Pack = _pickle) -> None:
        self._socket = end
        self._socket.setblocking(True)
        self._pack = pack

    def send(self, message: object) -> None:
        """Send a message, waiting while the other end is busy."""
        for part in _with_length(self._pack(message)):
            self._socket.sendall(part)

    def receive(self, wait_s: float | None = None) -> Any:  # noqa: ANN401 - whatever the parent has sent
        """Return the parent's next message, or None when none came in time.

        Args:
            wait_s: Longest time to wait; None for ever.

        Raises:
            EOFError: The other end is closed.
        """
        if wait_s is not None and not select.select([self._socket], [], [], max(0.0, wait_s))[0]:
            return None
        (length,) = LENGTH.unpack(self._exactly(LENGTH.size))
        return pickle.loads(self._exactly(length))  # noqa: S301 - from the process that made us

    def _exactly(self, length: int) -> bytearray:
        data = bytearray(length)
        view = memoryview(data)
        while view:
            count = self._socket.recv_into(view)
            if count == 0:
                raise EOFError
            view = view[count:]
        return data


class AsyncEnd(asyncio.BufferedProtocol):
    """The parent's end: reads straight into the buffer of the message that is coming."""

    def __init__(
        self,
        on_message: Callable[[Any], None],
        on_lost: Callable[[], None],
        unpack: Unpack,
        most_bytes: int,
    ) -> None:
        self._on_message = on_message
        self._on_lost = on_lost
        self._unpack = unpack
        self._most_bytes = most_bytes
        self._transport: asyncio.WriteTransport | None = None
        self._buffer = bytearray(LENGTH.size)
        self._filled = 0
        self._in_body = False

    @classmethod
    async def connect(
        cls,
        end: socket.socket,
        on_message: Callable[[Any], None],
        on_lost: Callable[[], None],
        unpack: Unpack = pickle.loads,
        most_bytes: int = LARGEST_MESSAGE,
    ) -> "AsyncEnd":
        """Take over one end of a pair and call back for every message, and once when the child is gone.

        Args:
            end: It.
            on_message: Is called with every message.
            on_lost: Called when the child is gone, or has sent an invalid message.
            unpack: Reads a message, or raises a `ValueError`. Pickles are read only from processes that run our own
                program.
            most_bytes: Length of a message.
        """
        end.setblocking(False)
        loop = asyncio.get_running_loop()
        _, protocol = await loop.create_unix_connection(lambda: cls(on_message, on_lost, unpack, most_bytes), sock=end)
        return protocol

    def send(self, message: object) -> None:
        """Send a message without waiting; to a child that is gone it is lost."""
        if self._transport is not None and not self._transport.is_closing():
            self._transport.write(b"".join(_with_length(_pickle(message))))

    def close(self) -> None:
        """Hang up; the child ends when it notices."""
        if self._transport is not None:
            self._transport.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the transport (asyncio)."""
        # uvloop's transports are such, too, but do not inherit from asyncio's.
        self._transport = cast("asyncio.WriteTransport", transport)

    def get_buffer(self, sizehint: int) -> memoryview:  # noqa: ARG002 - asyncio's signature
        """Offer what is left of the current message (asyncio)."""
        return memoryview(self._buffer)[self._filled :]

    def buffer_updated(self, nbytes: int) -> None:
        """Take note of what came, and hand over whole messages (asyncio)."""
        self._filled += nbytes
        if self._filled < len(self._buffer):
            return
        buffer, self._filled = self._buffer, 0
        if not self._in_body:
            (length,) = LENGTH.unpack(buffer)
            if not 0 < length <= self._most_bytes:
                self.close()
                return
            self._buffer, self._in_body = bytearray(length), True
            return
        self._buffer, self._in_body = bytearray(LENGTH.size), False
        try:
            message = self._unpack(buffer)
        except ValueError:
            self.close()
            return
        self._on_message(message)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio's signature
        """Report that the child is gone (asyncio)."""
        self._on_lost()


ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
"""Environment that keeps numerical libraries to one thread: there is a process for every core already."""

NUMBER = struct.Struct("!q")
"""A fork server's report on a child: first its process number and then its exit status."""


class Ending(Enum):
    """How a child process ended."""

    DONE = auto()
    FAILED = auto()
    OUT_OF_TIME = auto()
    OUT_OF_CPU_TIME = auto()
    KILLED = auto()
    CRASHED = auto()


class Child:
    """A child of a fork server.

    Attributes:
        pid: Its process number.
        end: The parent's end of the pipe to it.
    """

    def __init__(self, pid: int, end: socket.socket, sentinel: int) -> None:
        """Take over a child; its exit status can be read from the descriptor `sentinel` when it has ended."""
        self.pid, self.end = pid, end
        self._sentinel = sentinel
        self._status: int | None = None
        self._is_closed = False

    def status(self, wait_s: float | None = 0.0) -> int | None:
        """Return its exit status, negative for a signal; None if it runs, or if it is unknown.

        Args:
            wait_s: Longest time to wait for its end; None for ever.
        """
        if not self._is_closed:
            poll = select.poll()
            poll.register(self._sentinel, select.POLLIN)
            if poll.poll(None if wait_s is None else 1e3 * wait_s):
                self._read_status()
        return self._status

    async def wait(self, wait_s: float | None = None) -> int | None:
        """Return its exit status as `status` does, while others go on."""
        if not self._is_closed:
            loop, ended = asyncio.get_running_loop(), asyncio.Event()
            loop.add_reader(self._sentinel, ended.set)
            try:
                with suppress(TimeoutError):
                    async with asyncio.timeout(wait_s):
                        await ended.wait()
            finally:
                loop.remove_reader(self._sentinel)
        return self.status()

    @property
    def has_ended(self) -> bool:
        """Whether it has ended, or was lost from sight with the fork server."""
        self.status()
        return self._is_closed

    def terminate(self) -> None:
        """Ask it to end."""
        self._signal(signal.SIGTERM)

    def kill(self) -> None:
        """End it, and whatever it has started; the fork server has done that where it has ended already."""
        if self.status() is None:  # otherwise its number may be another group's by now
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.pid, signal.SIGKILL)
        self._signal(signal.SIGKILL)  # it may not be the leader of a group yet

    def _signal(self, number: int) -> None:
        if not self.has_ended:  # its number may be another process's by then
            with suppress(ProcessLookupError):
                os.kill(self.pid, number)

    def _read_status(self) -> None:
        told = os.read(self._sentinel, NUMBER.size)
        os.close(self._sentinel)
        self._is_closed = True
        if len(told) == NUMBER.size:
            (self._status,) = NUMBER.unpack(told)


def command(module: str, *arguments: str) -> list[str]:
    """Return the command that runs a module in a fresh interpreter, which imports nothing from the current folder."""
    return [sys.executable, "-P", "-m", module, *arguments]


def environment() -> dict[str, str]:
    """Return the environment of a child, in which it finds the packages that this process finds."""
    return {**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


def run(*arguments: str, output: Literal["read", "shown"] = "shown") -> tuple[int, str]:
    """Run a script of ours in a fresh interpreter, and return its exit status and what it printed.

    Args:
        arguments: Its path, and what follows that.
        output: Whether its standard output is read, or goes where this process's goes.
    """
    read = subprocess.PIPE if output == "read" else None
    done = subprocess.run([sys.executable, *arguments], stdout=read, text=True, check=False)  # noqa: S603 - our own
    return done.returncode, done.stdout or ""


def ending(status: int | None) -> Ending:
    """Return how a child ended.

    Args:
        status: Its exit status, negative for the signal that ended it; None if it had to be killed for lasting too
            long.
    """
    if status is None or status == -signal.SIGALRM:
        return Ending.OUT_OF_TIME
    if status >= 0:
        return Ending.FAILED if status else Ending.DONE
    return {-signal.SIGXCPU: Ending.OUT_OF_CPU_TIME, -signal.SIGKILL: Ending.KILLED}.get(status, Ending.CRASHED)


def describe(status: int | None) -> str:
    """Return an exit status in words: "ended with status 1", "killed by SIGSEGV"."""
    if status is None:
        return "lost with the process that had started it"
    if status >= 0:
        return f"ended with status {status}"
    known = -status in set(signal.Signals)
    return f"killed by {signal.Signals(-status).name if known else f'signal {-status}'}"
