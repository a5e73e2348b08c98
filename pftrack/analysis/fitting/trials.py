"""Trials: runs on what one run has seen, with other values and other random numbers."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from pftrack.analysis.fitting.linear import LinearHalf
from pftrack.analysis.fitting.scores import Score, compute_evidence, score
from pftrack.analysis.fitting.seen import SeenSource
from pftrack.core.model.parameters import Declaration, flat
from pftrack.core.model.timeline import Change
from pftrack.runs.run import Run

__all__ = ["TRIALS", "Trials"]

TRIALS: Final[Mapping[int, int]] = {1: 30, 2: 60, 3: 100, 4: 150}
"""How many values of the evidence are asked for, by how many numbers are fitted."""
SEEDS: Final = 3
"""How many runs there are of each setting, where random numbers decide on anything."""
SMALLEST_SHARE: Final = 1e-4
"""Of a number's largest value: the least that is tried of one that may be 0."""
LEVELLED: Final = 40
"""Frames of each half in which the likelihood is looked at all over the picture, where that is needed."""


class Trials:
    """Runs on what one run has seen.

    Attributes:
        tracker: Name of the tracker.
        halves: First and last frame of each half.
        before: The values in force.
        begin: The values to begin with: those, within the bounds.
        bounds: Least and largest value of each number that is tried.
        linear: The first half as a linear model, where it is one in these numbers, and wanted.
        seeds: How many runs there are of each setting.
        tried: How many settings were tried.
        done: How many runs were made.
    """

    def __init__(
        self,
        run: Run,
        declared: Sequence[Declaration],
        middle: int,
        end: int,
        *,
        linear: bool,
        on_step: Callable[[int, int], object],
    ) -> None:
        """Prepare them.

        Args:
            run: Where it stands, its tracker and values are the beginning.
            declared: The numbers to fit.
            middle: First frame of the second half.
            end: The frame after its last.
            linear: Whether the model is to be laid open where it is linear.
            on_step: Called with how many runs are done, and of how many at most.
        """
        self.tracker = run.tracker_at(run.position)
        self.halves = (1, middle - 1), (middle, end - 1)
        self.tried = self.done = 0
        parameters = run.parameters_at(run.position)
        self._names = [it.name for it in declared]
        self.before = tuple(float(flat(parameters)[name]) for name in self._names)
        self.bounds = tuple(_bounds(it) for it in declared)
        self.begin = tuple(min(max(it, low), high) for it, (low, high) in zip(self.before, self.bounds, strict=True))
        self._experiment, self._on_step = run.experiment, on_step
        source = SeenSource(run, end)
        self._setup = replace(run.setup, open_source=lambda *_: source, parameters=parameters)
        self._levelled = _levelled(self.halves) if _needs_levels(run, self.tracker, declared) else ()
        self.linear = self._lay_open(middle) if linear else None
        told = {self._begin(self.before, 3, seed).finish().diagnostics.log_evidence for seed in (0, 1)}
        self.seeds = SEEDS if len(told) > 1 else 1
        self._judging = 2 * self.seeds if self.seeds > 1 else 1
        self._most = 2 * self._judging + (0 if self.linear else self.seeds * TRIALS[len(declared)])

    def evidence(self, values: Sequence[float]) -> float:
        """Return the log evidence of a frame of the first half, with the same random numbers in all trials."""
        self.tried += 1
        return self._scores(values, range(self.seeds), self.halves[:1])[0].mean

    def judge(self, values: Sequence[float]) -> list[Score]:
        """Return what both halves come to, with random numbers that no trial had."""
        return self._scores(values, range(self.seeds, self.seeds + self._judging), self.halves)

    def _scores(self, values: Sequence[float], seeds: range, halves: Sequence[tuple[int, int]]) -> list[Score]:
        frames = halves[-1][1] + 1
        runs, evidence = [], []
        for seed in seeds:
            made = self._begin(values, frames, seed)
            evidence.append(compute_evidence(made, [frame for frame in self._levelled if frame < frames]))
            runs.append(made)
            self.done += 1
            self._on_step(self.done, self._most)
        return [score(runs, evidence, first, last + 1) for first, last in halves]

    def _lay_open(self, frames: int) -> LinearHalf | None:
        """Return the model of the first frames, from frame 0 on; None where it is not linear in the numbers."""
        model = self._experiment.trackers[self.tracker].linear
        if model is None or not set(self._names) <= model.scales.keys():
            return None
        run = self._begin(self.begin, frames, 0)
        seen = [run.source.frame(index, run.timeline.history) for index in range(frames)]
        chains = model.chains(run.current.state, seen, run.parameters_at(1))
        return LinearHalf(chains, tuple(model.scales[name] for name in self._names)) if chains else None

    def _begin(self, values: Sequence[float], frames: int, seed: int) -> Run:
        changes = (Change(0, dict(zip(self._names, values, strict=True))),)
        return Run(self._experiment, self._setup, tracker=self.tracker, seed=seed, frames=frames, timeline=changes)


def _bounds(it: Declaration) -> tuple[float, float]:
    high = float(it.maximum or 0)
    return max(float(it.minimum or 0), SMALLEST_SHARE * high), high


def _needs_levels(run: Run, tracker: str, declared: Sequence[Declaration]) -> bool:
    """Return whether what is left out of the evidence changes with the numbers."""
    relative = run.experiment.trackers[tracker].evidence == "relative"
    return relative and any(it.role == "sharpness" for it in declared)


def _levelled(halves: Sequence[tuple[int, int]]) -> tuple[int, ...]:
    """Return the frames in which the likelihood is looked at all over the picture, which takes longer than a step."""
    spread = (np.linspace(first, last, min(LEVELLED, last - first + 1)) for first, last in halves)
    return tuple(sorted({round(frame) for frames in spread for frame in frames.tolist()}))
