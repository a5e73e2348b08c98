"""`--jobs`: on how many processes a command computes."""

import os
from typing import Annotated

import typer

from pftrack.cli.output import whole

__all__ = ["Jobs", "read_jobs"]

Jobs = Annotated[str | None, typer.Option(metavar="N", help="Processes that compute; one a core if not given.")]


def read_jobs(jobs: str | None) -> int:
    """Return the number that is said, or else that of the cores that this process may use."""
    return _cores() if jobs is None else whole("--jobs", jobs, 1, 256)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
