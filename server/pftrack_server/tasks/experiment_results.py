"""What is computed of experiments when it is first asked for: pictures of them, courses of their failures.

Each is computed once, in a child, by whoever asks first, while all others wait for the same. Results of our own
experiments are kept on the disk until the program changes; those of other packages' as long as the server runs, which
sees no change of theirs.
"""

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from pftrack.experiments import EXPERIMENTS
from pftrack_server.tasks.child_tasks import ChildTasks
from pftrack_server.tasks.disk_cache import DiskCache, digest


class ExperimentResults:
    """Results of functions, as JSON objects."""

    def __init__(self, folder: Path, tasks: ChildTasks, wait_for: Callable[[str], Awaitable[None]]) -> None:
        """Begin with what was computed by this very program.

        Args:
            folder: Where results are kept.
            tasks: Where they are computed.
            wait_for: Waits for an experiment to be compiled, or raises that it takes longer.
        """
        self._kept = DiskCache(folder)
        self._tasks = tasks
        self._wait_for = wait_for
        self._known: dict[str, dict[str, Any]] = {}
        self._under_way: dict[str, asyncio.Lock] = {}

    def open(self) -> None:
        """Forget what another version of the program has computed."""
        self._kept.open()

    async def get(self, experiment: str, function: Callable[[str], dict[str, Any]], subject: str) -> dict[str, Any]:
        """Return what a function comes to.

        Args:
            experiment: Which one it runs.
            function: Is called in a child.
            subject: Its argument.

        Raises:
            UnavailableError: The experiment is still being compiled, or it takes too long.
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
