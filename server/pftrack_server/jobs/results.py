"""Results: what was computed once, kept on the disk until the program changes.

A cache holds JSON objects by a hash of their subject. Pictures of experiments and courses of their failures are
computed in a child when somebody first asks for them, while all others wait for the same. Results
of our own experiments are kept on the disk; those of other packages' as long as the server runs, which sees no change
of theirs.
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
    """Return the name under which something is kept.

    Args:
        about: All that it depends on beside the program.
    """
    return hashlib.sha256(about.encode()).hexdigest()[:32]


class DiskCache:
    """A folder of results, each a file; what cannot be read, or written, is computed again.

    Args:
        folder: Where they are kept.
    """

    def __init__(self, folder: Path) -> None:
        """Forget what another version of the program has computed."""
        on = json.dumps(machine.describe_platform(), sort_keys=True)
        self._folder = folder / hashlib.sha256(on.encode() + source_hash()).hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        for other in folder.iterdir():
            if other != self._folder:
                shutil.rmtree(other, ignore_errors=True)
        self._folder.mkdir(exist_ok=True, mode=0o700)

    def read(self, name: str) -> dict[str, Any] | None:
        """Return what is kept under a name; None if nothing is."""
        try:
            kept = json.loads((self._folder / name).read_bytes())
        except (OSError, ValueError):
            return None
        return kept if isinstance(kept, dict) else None

    def write(self, name: str, result: dict[str, Any]) -> None:
        """Keep a result under a name."""
        with contextlib.suppress(OSError):  # a full disk: it is computed again after the next start
            write_whole(self._folder / name, json.dumps(result).encode())


class ExperimentResults:
    """Results of functions, as JSON objects."""

    def __init__(self, kept: DiskCache, tasks: ChildTasks, wait_for: Callable[[str], Awaitable[None]]) -> None:
        """Begin with what was computed by this very program.

        Args:
            kept: Where results are kept.
            tasks: Where they are computed.
            wait_for: Waits for an experiment to be compiled, or raises that it takes longer.
        """
        self._kept = kept
        self._tasks = tasks
        self._wait_for = wait_for
        self._known: dict[str, dict[str, Any]] = {}
        self._under_way: dict[str, asyncio.Lock] = {}

    async def get(self, experiment: str, function: Callable[[str], dict[str, Any]], subject: str) -> dict[str, Any]:
        """Return the result of a function.

        Args:
            experiment: Which one it runs.
            function: Is called in a child.
            subject: Its argument.

        Raises:
            ApiError: The experiment is still being compiled, or it takes too long (503).
            RefusedError: It cannot be computed.
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
