"""Children as their parent sees them: their number, the pipe to them, how they are ended, and how they ended."""

import asyncio
import os
import select
import signal
import socket
import struct
import subprocess
import sys
from contextlib import suppress
from enum import Enum, auto
from typing import Literal

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
"""Environment that keeps numerical libraries to one thread: there is a process for every core already."""

NUMBER = struct.Struct("!q")
"""What a fork server says of a child, first its process number and then its exit status."""


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
        """Return its exit status, negative for a signal; None if it goes on, or if nobody knows it any more.

        Args:
            wait_s: How long to wait for its end; None for ever.
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
