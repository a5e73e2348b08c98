"""Ensembles: not one run but what runs do.

A particle filter is a random thing: the run that one looks at is one of many that the same settings make. An ensemble
is so many of them with other seeds, and says of every frame which errors they have and what share of them still holds
the target. It shows whether a run is typical.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.experiment import Experiment, Setup
from pftrack.model.series import to_json
from pftrack.model.timeline import Timeline
from pftrack.numerics.random import LARGEST_SEED
from pftrack.runs.continuation import Continuation, Stretch, read_stretches
from pftrack.runs.run import Run

__all__ = ["QUANTILES", "RUNS", "Ensemble", "ensemble", "ensembling", "other_seeds"]

RUNS = 40
QUANTILES = 0.1, 0.5, 0.9


@dataclass(frozen=True)
class Ensemble:
    """What runs of the same settings with other seeds do, as far as they have come.

    Attributes:
        seeds: One a run.
        errors: (N, L) of the runs in frames 0..L-1, in the experiment's unit; NaN where the truth is unknown.
        lost: (N, L) 1 where a run has lost the target, else 0; NaN where nobody knows.
        unit: Of the errors.
    """

    seeds: tuple[int, ...]
    errors: NDArray[np.float64]
    lost: NDArray[np.float64]
    unit: str

    @property
    def frames(self) -> int:
        """How many frames all runs have come so far."""
        return int(self.errors.shape[1])

    @property
    def quantiles(self) -> NDArray[np.float64]:
        """(3, L) errors below which 10, 50 and 90 % of the runs are; NaN where the truth is unknown.

        Each is an error of one of the runs: between two, one of which has no estimate at all, there is nothing.
        """
        ordered = np.sort(self.errors, axis=0)  # NaN of a frame are NaN of all runs
        return np.stack([ordered[max(int(np.ceil(share * len(ordered))) - 1, 0)] for share in QUANTILES])

    @property
    def holding(self) -> NDArray[np.float64]:
        """(L,) share of the runs that have the target, 0..1; NaN where nobody knows."""
        return np.asarray(1.0 - self.lost.mean(axis=0), np.float64)

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values: a number that is not finite becomes None."""
        low, middle, high = (tuple(map(to_json, row.tolist())) for row in self.quantiles)
        return {
            "runs": len(self.seeds),
            "frames": self.frames,
            "unit": self.unit,
            "low": low,
            "middle": middle,
            "high": high,
            "holding": tuple(map(to_json, self.holding.tolist())),
        }


def other_seeds(seed: int, count: int) -> tuple[int, ...]:
    """Return so many seeds, none of which is the one given: those that follow it."""
    return tuple((seed + 1 + number) % (LARGEST_SEED + 1) for number in range(count))


def ensemble(run: Run, *, runs: int = RUNS, frames: int | None = None) -> Ensemble:
    """Return what runs of a run's settings with other seeds do.

    Args:
        run: Its timeline is that of all.
        runs: How many.
        frames: How far they go; as far as the run is long, if not given.
    """
    *_, last = ensembling(run.experiment, run.setup, run.timeline, other_seeds(run.seed, runs), frames or run.frames)
    return last


def ensembling(
    experiment: Experiment, setup: Setup, timeline: Timeline, seeds: Sequence[int], frames: int
) -> Iterator[Ensemble]:
    """Carry out the runs of an ensemble side by side, and yield what they have come to, again and again.

    A scene that depends on the seed is another one for each run, as in a sweep.

    Args:
        experiment: The wiring.
        setup: The source.
        timeline: What is in force in all runs; of its seeds none counts.
        seeds: One a run.
        frames: How far they go, at least 1.
    """
    opened = setup.open_source(seeds[0], timeline.parameters_at(0))
    sources = [setup.open_source(seed, timeline.parameters_at(0)) for seed in seeds] if opened.noisy else [opened]
    made: list[Continuation] = []

    def take(stretches: Sequence[Stretch]) -> None:
        for place, seed in enumerate(seeds):
            stretch, source = stretches[place % len(stretches)], sources[place % len(sources)]
            if place == len(made):
                made.append(Continuation.start(experiment, source, timeline, seed, stretch))
                made[place].take(stretch, 1)
            else:
                made[place].take(stretch)

    for stretches in zip(*(read_stretches(source, timeline, 0, frames - 1) for source in sources), strict=True):
        take(stretches)
        errors, lost = (np.stack([getattr(each, name) for each in made]) for name in ("errors", "lost"))
        yield Ensemble(tuple(seeds), errors, lost, experiment.unit)
