"""What workers do: measure a plan, compute a chunk.

Both are functions of plain values, so that a process of the pool and a worker of a cluster do the same. A plan travels
as text and is understood once in a process.
"""

import json
import threading
from functools import lru_cache
from itertools import islice
from time import perf_counter
from typing import TypeAlias

import cv2

from pftrack.core.version import __version__
from pftrack.experiments import Setup
from pftrack.experiments.own import trust
from pftrack.runs.batch import outcomes
from pftrack.sweep import arrow
from pftrack.sweep.chunks import Chunks
from pftrack.sweep.journal import metadata
from pftrack.sweep.plan import Plan
from pftrack.sweep.recording import Packed, Recording, setup_of
from pftrack.sweep.table import compute

__all__ = ["as_text", "compute_chunk", "measure", "one_thread", "version"]

Given: TypeAlias = "Recording | Packed | None"

MEASURED_S = 0.5
"""How long a plan is measured at most, beyond the first condition."""

MEASURED_CONDITIONS = 9
MEASURED_TRIALS = 10
UNKNOWN_S = 1e-3
"""What a run is taken to cost where none of those looked at is possible."""


def as_text(plan: Plan) -> str:
    """Return a plan as it travels to workers."""
    return json.dumps(plan.as_dict(), sort_keys=True)


def compute_chunk(text: str, conditions: int, trials: int, number: int, recording: Given = None) -> bytes:
    """Carry out a chunk and return its Parquet file.

    Args:
        text: The plan.
        conditions: Whole conditions in a chunk.
        trials: Trials in a chunk.
        number: Of the chunk.
        recording: That of the plan, where it is on one.
    """
    plan, setup = _plan(text), _setup(text, recording, threading.get_ident())
    table = compute(plan, Chunks(plan, conditions, trials)[number], setup).replace_schema_metadata(metadata(plan))
    sink = arrow.BufferOutputStream()
    arrow.parquet.write_table(table, sink, compression="zstd", write_page_checksum=True)
    return bytes(sink.getvalue().to_pybytes())


def measure(text: str, recording: Given = None) -> float:
    """Return how long a run of a plan takes, s, from a few conditions all over it."""
    plan, setup = _plan(text), _setup(text, recording, threading.get_ident())

    def took(number: int, trials: int, frames: int) -> float:
        condition = plan.condition(number)
        values, seeds = {**plan.values, **condition}, plan.seeds(condition, 0, trials)
        begun = perf_counter()
        outcomes(
            plan.wiring,
            setup,
            values=values,
            trackers=plan.trackers,
            seeds=seeds,
            frames=frames,
            loss_probability=plan.loss_probability,
        )
        return perf_counter() - begun

    seconds, runs, trials = 0.0, 0, 1
    order = Chunks(plan, 1, plan.trials).spread()
    for number in map(int, islice(order, MEASURED_CONDITIONS)):
        try:
            if not runs:
                took(number, 1, min(plan.frames, 4))  # loads what is compiled
            seconds += took(number, trials, plan.frames)
        except Exception:  # noqa: BLE001, S112 - its rows will say what is wrong with it
            continue
        runs += trials * len(plan.trackers)
        if seconds > MEASURED_S:
            break
        affordable = MEASURED_S / 4 / (len(plan.trackers) * seconds / runs)
        trials = min(plan.trials, MEASURED_TRIALS, max(1, int(affordable)))
    return seconds / runs if runs else UNKNOWN_S


def version() -> str:
    """Return the version of pftrack here."""
    return __version__


def one_thread() -> None:
    """Keep the libraries from starting threads: there is a process for every core already."""
    cv2.setNumThreads(1)
    arrow.set_cpu_count(1)


@lru_cache(maxsize=4)
def _plan(text: str) -> Plan:
    raw = json.loads(text)
    # Whoever has started this process has looked at the plan already.
    trust(*(each for texts in raw.get("filters", {}).values() for each in texts))
    return Plan.from_dict(raw)


@lru_cache(maxsize=4)
def _setup(text: str, recording: Given, thread: int) -> Setup:
    """Return what a plan's runs are on; each thread has a decoder of its own."""
    del thread
    return setup_of(_plan(text), recording)
