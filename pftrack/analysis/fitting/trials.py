"""Trials: runs on what one run has seen, with other values and other random numbers, and their scores.

What a run has seen is a source here that no parameter and no seed changes. A score says how good some frames of a run
are, by the filter's own word and by the truth.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from pftrack.analysis.fitting.search import LinearHalf
from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Declaration, flat
from pftrack.core.model.recipe import Change
from pftrack.filters.particles import normalise
from pftrack.runs.coverage import Consistency, Counts, count_held, measure_consistency, pool_counts
from pftrack.runs.many import KeptFrames, side_by_side
from pftrack.runs.run import Run

# Where a likelihood leaves out a constant of the frame, a sharper one has another constant, and its evidence cannot be
# compared. What can is how much more probable the frame is where the filter had expected the target than anywhere in
# the picture: the evidence beside the mean likelihood over all places. That is a score for predicting the place among
# all places, and it has no constant left (Bishop 2006, section 4.3: a softmax over places).

MOST_BELOW: Final = 50.0
"""By how much the log evidence of a frame may be below the run's median where it is not exact: one in which all
particles happen to have a weight of zero would hide all other frames."""


@dataclass(frozen=True, slots=True)
class Score:
    """What some frames come to, over several runs.

    Attributes:
        evidence: (L,) log evidence of each frame, nats, as a mean over the runs.
        coverage: Share of the reports in which a band of 50 or 95 % held the truth, by that share; empty where no truth
            is known or no band is told.
        consistency: How large errors and innovations are in the deviations that were told.
    """

    evidence: Floats
    coverage: Mapping[float, float]
    consistency: Consistency

    @property
    def mean(self) -> float:
        """Mean log evidence of a frame, nats."""
        return float(self.evidence.mean())

    def as_dict(self) -> dict[str, Any]:
        """Return its numbers as JSON values by name; the evidence as its mean."""
        coverage = {f"{100 * promised:g}": share for promised, share in self.coverage.items()}
        return {"log_evidence": self.mean, "coverage": coverage, **self.consistency.as_dict()}


def _log_evidence(run: Run, levels: Mapping[int, float] | None) -> Floats:
    """Return the log evidence of a finished run in each frame (T,), nats.

    Args:
        run: The run.
        levels: By frame, the mean log likelihood all over the picture, beside which the evidence is taken; if there are
            any, other frames do not count and are NaN. None where it is taken as it is.
    """
    evidence = np.array([row.log_evidence for row in run.diagnostics])
    evidence = np.where(np.isnan(evidence), -np.inf, evidence)
    if levels is not None:
        evidence -= np.array([levels.get(frame, np.nan) for frame in range(len(evidence))])
    exact = run.experiment.trackers[run.tracker].sampling == "exact"
    return evidence if exact else _bound(evidence)


def _bound(evidence: Floats) -> Floats:
    """Return log evidence (T,) none of which is too far below the others; NaN stays."""
    possible = evidence[np.isfinite(evidence)]
    usual = float(np.median(possible)) if len(possible) else 0.0
    return np.where(np.isnan(evidence), evidence, np.maximum(evidence, usual - MOST_BELOW))


def _level(run: Run, before: Any, step: Any) -> float:  # noqa: ANN401 - the state of any family
    model, image = run.experiment.trackers[step.tracker].model, step.frame.image_rgb
    if model is None or not model.has_place or image is None:
        raise ValueError(f"{step.tracker_title} has no likelihood over a picture")
    found = model.map(before, step.state, step.frame, step.parameters, (image.shape[1], image.shape[0]))
    _, log_sum = normalise(found.log_likelihoods.ravel())
    return log_sum - float(np.log(found.log_likelihoods.size))


def score(runs: Sequence[Run], evidence: Sequence[Floats], first: int, end: int) -> Score:
    """Return what some frames of several runs come to.

    Args:
        runs: Of the same recording and settings with other random numbers, computed to that end.
        evidence: (T,) log evidence of each run, nats, NaN in frames that count for nothing.
        first: The first frame that counts.
        end: The frame after the last.

    Raises:
        ValueError: There is no run, or none of these frames counts.
    """
    among = np.mean([one[first:end] for one in evidence], axis=0) if runs else np.zeros(0)
    known = among[~np.isnan(among)]
    if not len(known):
        raise ValueError(f"no frame from {first} to {end - 1} counts")
    coverage = _coverage([count_held(run, first, end) for run in runs])
    return Score(known, coverage, measure_consistency(runs, first, end))


def _coverage(counts: Sequence[Counts]) -> dict[float, float]:
    """Return the coverage of the first band that the experiment declares."""
    pooled = pool_counts(counts)
    of = pooled[0].of if pooled else ""
    return {one.promised: one.share for one in pooled if one.of == of}


KEPT_BYTES: Final = 512 * 2**20
"""Of pictures that are kept, so that hundreds of runs over a recording do not decode it hundreds of times."""

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
        self._source = KeptFrames(run.source, run.timeline.history, end, KEPT_BYTES)
        self._setup = replace(run.setup, open_source=lambda *_: self._source, parameters=parameters)
        self._levelled = _levelled(self.halves) if _needs_levels(run, self.tracker, declared) else ()
        self.linear = self._lay_open(middle) if linear else None
        told = {one.diagnostics[-1].log_evidence for one in self._carry_out(self.before, 3, (0, 1))}
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
        levels: dict[int, dict[int, float]] = {seed: {} for seed in seeds}
        before: dict[int, Any] = {}

        def look(run: Run) -> None:
            if run.position in self._levelled:
                levels[run.seed][run.position] = _level(run, before[run.seed], run.current)
            if self._levelled:
                before[run.seed] = run.current.state

        runs, evidence = [], []
        for made in self._carry_out(values, halves[-1][1] + 1, seeds, look):
            evidence.append(_log_evidence(made, levels[made.seed] if self._levelled else None))
            runs.append(made)
            self.done += 1
            self._on_step(self.done, self._most)
        return [score(runs, evidence, first, last + 1) for first, last in halves]

    def _lay_open(self, frames: int) -> LinearHalf | None:
        """Return the model of the first frames, from frame 0 on; None where it is not linear in the numbers."""
        tracker = self._experiment.trackers[self.tracker]
        model = tracker.model
        if model is None or tracker.sampling != "exact" or not set(self._names) <= model.scales.keys():
            return None
        (run,) = self._carry_out(self.begin, 1, (0,))
        seen = [self._source.frame(index, run.timeline.history) for index in range(frames)]
        chains = model.chains(run.current.state, seen, run.parameters_at(0))
        return LinearHalf(chains, tuple(model.scales[name] for name in self._names)) if chains else None

    def _carry_out(
        self,
        values: Sequence[float],
        frames: int,
        seeds: Sequence[int],
        watch: Callable[[Run], None] = lambda _: None,
    ) -> Iterator[Run]:
        changes = (Change(0, dict(zip(self._names, values, strict=True))),)
        cases = [(self.tracker, seed) for seed in seeds]
        return side_by_side(self._experiment, self._setup, cases, changes=changes, frames=frames, watch=watch)


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
