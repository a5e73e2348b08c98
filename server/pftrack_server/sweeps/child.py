"""The child: the process that computes or measures a sweep, as the server sees it.

It is a child of the same forkserver as the workers, in which all that is compiled is loaded. The socket to it stays
open: the child ends when this server is gone.
"""

import asyncio
import contextlib
import json
import os
import signal
import socket
from multiprocessing.context import ForkServerProcess
from typing import Any, Self

from pftrack.process import end_group
from pftrack_server.errors import UnavailableError
from pftrack_server.sweeps import driver
from pftrack_server.sweeps.task import Task
from pftrack_server.worker import forkserver

__all__ = ["Child", "ask"]

GRACE_S = 8.0
LONGEST_ANSWER = 1024 * 1024
LONGEST_COMPLAINT = 4000


class Child:
    """One process that computes a sweep, in a group of its own with its workers.

    Attributes:
        pid: Number of the process, and of its group.
    """

    def __init__(self, process: ForkServerProcess, talk: socket.socket, complaint: socket.socket) -> None:
        assert process.pid is not None  # noqa: S101 - it was started
        self.pid = process.pid
        self._process = process
        self._answer = asyncio.ensure_future(_read(talk, LONGEST_ANSWER))
        self._complaint = asyncio.ensure_future(_read(complaint, LONGEST_COMPLAINT))
        self._status = asyncio.ensure_future(_status(process))

    @classmethod
    async def start(cls, task: Task) -> Self:
        """Start one and give it its task."""
        talk, theirs = socket.socketpair()
        complaint, its = socket.socketpair()
        with theirs, its:
            try:
                process = await forkserver.spawn(driver.main, theirs, its, task, name="pftrack-sweep")
            except BaseException:
                talk.close()
                complaint.close()
                raise
        return cls(process, talk, complaint)

    async def wait(self) -> tuple[int, dict[str, Any]]:
        """Wait for its end; return exit status (negative for a signal) and the JSON that it printed."""
        status = await asyncio.shield(self._status)
        # Workers that outlive their driver hold its sockets open; they are of no use any more.
        self._kill()
        text, complaint = await asyncio.gather(self._answer, self._complaint)
        try:
            answer = json.loads(text.splitlines()[-1]) if text.strip() else {}
        except ValueError:
            answer = {}
        if not isinstance(answer, dict):
            answer = {}
        if "error" not in answer and status != 0:
            answer["complaint"] = complaint.strip()
        return status, answer

    async def stop(self) -> None:
        """Ask it to end, and kill it if it does not."""
        if self._status.done():
            return  # its number may be another process's by now
        # The driver alone: it lets its workers finish what they are at.
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGTERM)
        try:
            await asyncio.wait_for(asyncio.shield(self._status), GRACE_S)
        except TimeoutError:
            self._kill()
            await asyncio.shield(self._status)

    def _kill(self) -> None:
        """End driver and workers, now."""
        end_group(self.pid)
        if not self._status.done():  # it may not be the leader of a group yet
            self._process.kill()


async def ask(task: Task, *, patience_s: float) -> dict[str, Any]:
    """Return the answer of a short task.

    Raises:
        UnavailableError: It took too long or failed.
    """
    child = await Child.start(task)
    try:
        status, answer = await asyncio.wait_for(child.wait(), patience_s)
    except TimeoutError:
        raise UnavailableError(f"This took longer than {patience_s:g} s and was given up.") from None
    finally:
        await child.stop()
    if status != 0:
        raise UnavailableError(str(answer.get("error", {}).get("message") or "This could not be computed."))
    return answer


async def _read(end: socket.socket, most: int) -> str:
    """Read a socket to its end, keeping only so much of the end of it."""
    reader, writer = await asyncio.open_unix_connection(sock=end)
    kept = b""
    with contextlib.closing(writer), contextlib.suppress(ConnectionError):
        while part := await reader.read(65536):
            kept = (kept + part)[-most:]
    return kept.decode("utf-8", "replace")


async def _status(process: ForkServerProcess) -> int:
    """Wait for the end of a process in no thread, and return its exit status."""
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    loop.add_reader(process.sentinel, ended.set)
    try:
        await ended.wait()
    finally:
        loop.remove_reader(process.sentinel)
    process.join()
    status = process.exitcode
    process.close()
    assert status is not None  # noqa: S101 - it has ended
    return status
