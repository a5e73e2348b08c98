"""The child: the process that computes a sweep, as the server sees it."""

import asyncio
import contextlib
import json
import os
import signal
import sys
from asyncio.subprocess import PIPE, Process
from pathlib import Path
from typing import Any, Self

from server.errors import UnavailableError

__all__ = ["Child", "ask"]

GRACE_S = 8.0
LONGEST_ANSWER = 1024 * 1024
LONGEST_COMPLAINT = 4000
HERE = str(Path(__file__).parents[2])


class Child:
    """One `pftrack sweep` in a process group of its own."""

    def __init__(self, process: Process) -> None:
        self._process = process
        self._answer = asyncio.ensure_future(_read(process.stdout, LONGEST_ANSWER))
        self._complaint = asyncio.ensure_future(_read(process.stderr, LONGEST_COMPLAINT))

    @classmethod
    async def start(cls, *arguments: str, largest_file: int) -> Self:
        """Start one, with the arguments of the command."""
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-m",
            "server.sweeps.driver",
            str(largest_file),
            *arguments,
            stdin=PIPE,
            stdout=PIPE,
            stderr=PIPE,
            start_new_session=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, [HERE, os.environ.get("PYTHONPATH")]))},
        )
        return cls(process)

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
        """Ask it to end, and make it end if it does not."""
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
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)


async def ask(*arguments: str, patience_s: float, largest_file: int) -> dict[str, Any]:
    """Return what a short `pftrack sweep` answers.

    Raises:
        UnavailableError: It took too long or failed.
    """
    child = await Child.start(*arguments, largest_file=largest_file)
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
