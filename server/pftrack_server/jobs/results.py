"""Results that are computed once and kept on disk until the program changes.

A cache holds JSON objects by a hash of their subject. Pictures of experiments and results of failures are computed in a
child process at the first request, and concurrent requests wait for the same one. Results of our own experiments are
kept on disk; those of other packages only in memory while the server runs, since it cannot see when such a package
changes.
"""

import asyncio
import contextlib
import hashlib
import json
import shutil
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Annotated, Any

from pftrack.core.files import write_whole
from pftrack.core.numerics import machine
from pftrack.doctor.memory import source_hash
from pftrack.experiments import EXPERIMENTS
from pftrack_server.core.requests import service
from pftrack_server.jobs.child_tasks import ChildTasks


def digest(about: str) -> str:
    """Return the name under which a result is kept.

    Args:
        about: Everything that it depends on, except the program.
    """
    return hashlib.sha256(about.encode()).hexdigest()[:32]


class DiskCache:
    """A folder of results, one file each; a result that cannot be read or written is computed again.

    Args:
        folder: The folder.
    """

    def __init__(self, folder: Path) -> None:
        """Delete results of other versions of the program."""
        on = json.dumps(machine.describe_platform(), sort_keys=True)
        self._folder = folder / hashlib.sha256(on.encode() + source_hash()).hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        for other in folder.iterdir():
            if other != self._folder:
                shutil.rmtree(other, ignore_errors=True)
        self._folder.mkdir(exist_ok=True, mode=0o700)

    def read(self, name: str) -> dict[str, Any] | None:
        """Return the result of a name; None if there is none."""
        try:
            kept = json.loads((self._folder / name).read_bytes())
        except (OSError, ValueError):
            return None
        return kept if isinstance(kept, dict) else None

    def write(self, name: str, result: dict[str, Any]) -> None:
        """Keep a result under a name."""
        with contextlib.suppress(OSError):  # full disk: the result is computed again after the next start
            write_whole(self._folder / name, json.dumps(result).encode())


class ExperimentResults:
    """Cached results of functions, as JSON objects."""

    def __init__(self, kept: DiskCache, tasks: ChildTasks, wait_for: Callable[[str], Awaitable[None]]) -> None:
        """Begin with the results that this version of the program has kept.

        Args:
            kept: Cache on disk.
            tasks: Runs the functions.
            wait_for: Waits for an experiment to be compiled; raises an error if it takes longer.
        """
        self._kept = kept
        self._tasks = tasks
        self._wait_for = wait_for
        self._known: dict[str, dict[str, Any]] = {}
        self._under_way: dict[str, asyncio.Lock] = {}

    async def get(self, experiment: str, function: Callable[[str], dict[str, Any]], subject: str) -> dict[str, Any]:
        """Return the result of a function.

        Args:
            experiment: Identifier of the experiment that it runs.
            function: The function, called in a child process.
            subject: Its argument.

        Raises:
            ApiError: The experiment is still being compiled, or the function takes too long (503).
            RefusedError: The result cannot be computed.
        """
        name = digest(f"{function.__name__} {subject}")
        async with self._under_way.setdefault(name, asyncio.Lock()):
            if name not in self._known:
                is_own = experiment in EXPERIMENTS.own
                result = await asyncio.to_thread(self._kept.read, name) if is_own else None
                if result is None:
                    await self._wait_for(experiment)
                    result = await self._tasks.run(function, subject)
                    if is_own:
                        await asyncio.to_thread(self._kept.write, name, result)
                self._known[name] = result
        return self._known[name]


TheResults = Annotated[ExperimentResults, service(ExperimentResults)]
