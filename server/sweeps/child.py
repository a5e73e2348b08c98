"""The child: the process that computes or measures a sweep, as the server sees it.

Its standard input carries one line of JSON, a `Task`, and stays open: the child ends when this server is gone.
"""

import asyncio
import contextlib
import json
import os
import signal
from asyncio.subprocess import PIPE, Process
from typing import Any, Self

from pftrack.process import command, end_group, environment
from server.errors import UnavailableError
from server.sweeps.task import Task

__all__ = ["Child", "ask"]

GRACE_S = 8.0
LONGEST_ANSWER = 1024 * 1024
LONGEST_COMPLAINT = 4000


class Child:
    """One process that computes a sweep, in a group of its own with its workers."""

    def __init__(self, process: Process) -> None:
        self._process = process
        self._answer = asyncio.ensure_future(_read(process.stdout, LONGEST_ANSWER))
        self._complaint = asyncio.ensure_future(_read(process.stderr, LONGEST_COMPLAINT))

    @classmethod
    async def start(cls, task: Task) -> Self:
        """Start one and give it its task."""
        process = await asyncio.create_subprocess_exec(
            *command("server.sweeps.driver"),
            stdin=PIPE,
            stdout=PIPE,
            stderr=PIPE,
            start_new_session=True,
            env=environment(),
        )
        child = cls(process)
        if process.stdin is not None:
            process.stdin.write(task.model_dump_json().encode() + b"\n")
        return child

    @property
    def pid(self) -> int:
        """Number of the process, and of its group."""
        return self._process.pid

    async def wait(self) -> tuple[int, dict[str, Any]]:
        """Wait for its end; return exit status (negative for a signal) and the JSON that it printed."""
        status = await self._process.wait()
        # Workers that outlive their driver hold its pipes open; they are of no use any more.
        self._kill()
        text, complaint = await asyncio.gather(self._answer, self._complaint)
        if self._process.stdin is not None:
            self._process.stdin.close()
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
        if self._process.returncode is not None:
            return  # its number may be another process's by now
        # The driver alone: it lets its workers finish what they are at.
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._process.pid, signal.SIGTERM)
        try:
            await asyncio.wait_for(self._process.wait(), GRACE_S)
        except TimeoutError:
            self._kill()
            await self._process.wait()

    def _kill(self) -> None:
        """End driver and workers, now."""
        end_group(self._process.pid)


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


async def _read(stream: asyncio.StreamReader | None, most: int) -> str:
    """Read a stream to its end, keeping only so much of the end of it."""
    kept = b""
    while stream is not None and (part := await stream.read(65536)):
        kept = (kept + part)[-most:]
    return kept.decode("utf-8", "replace")
