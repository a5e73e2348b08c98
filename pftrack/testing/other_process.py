"""Another process, which computes saved runs: one for all checks, since a fresh interpreter takes a second."""

import atexit
import os
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from pftrack.process import UNLIMITED, BlockingPool, CallError, ForkServer, WorkerLostError
from pftrack.runs.opening import load
from pftrack.testing.check import CheckError


def hashes_elsewhere(paths: Sequence[str]) -> list[str]:
    """Return the hashes of the estimates that saved runs come to in another process.

    Args:
        paths: Of the files.

    Raises:
        CheckError: It cannot compute them.
    """
    try:
        hashes: list[str] = _pool(frozenset(os.environ.items())).submit(_hash_runs, tuple(paths)).result()
    except (CallError, WorkerLostError, MemoryError, OSError) as error:
        raise CheckError(f"another process cannot compute the run: {error}") from None
    return hashes


@cache
def _pool(environment: frozenset[tuple[str, str]]) -> BlockingPool:  # noqa: ARG001 - one for each environment
    """Start a process in the environment of now; it ends with this one."""
    pool = BlockingPool(ForkServer("pftrack.runs.record"), processes=1, budget=UNLIMITED)
    atexit.register(pool.close)
    return pool


def _hash_runs(paths: Sequence[str]) -> list[str]:
    hashes = []
    for path in paths:
        run = load(Path(path))
        run.finish()
        hashes.append(run.estimates_sha256)
    return hashes
