"""Children that are confined as for a probe, and do something else."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil

from pftrack_server.jobs.child_tasks import ChildTasks, Queues
from pftrack_server.uploads.intake import BUDGET
from tests.apart import run


def ask(task: Callable[..., Any], *arguments: object) -> Any:
    """Have a child that is confined as for a probe do something else, and return its answer."""
    return run(ChildTasks(Queues()).run_beside(task, *arguments, budget=BUDGET))


def children() -> list[psutil.Process]:
    """The processes that were forked from this process's fork server, or started by one of those."""
    return [each for each in psutil.Process().children(recursive=True) if _is_forked(each)]


def _is_forked(process: psutil.Process) -> bool:
    try:
        return process.ppid() != os.getpid() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:  # it has ended since it was listed
        return False


def descriptors() -> int:
    """How many this process holds."""
    return len(list(Path("/proc/self/fd").iterdir()))
