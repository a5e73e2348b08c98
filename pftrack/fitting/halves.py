"""Fitting a run's numbers to what it has seen: on its first half, judged on its second.

Fixed is what was seen, with all that was changed in the scene while it went on; varied is what the tracker is told. So
the fit of a simulated run is one to that recording, not one to a scene that changes with the trial.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from pftrack.experiment import Experiment
from pftrack.fitting.scores import Score, compute_evidence, score
from pftrack.fitting.search import maximise
from pftrack.fitting.seen import SeenSource
from pftrack.model.parameters import Declaration, Parameters, Role, Value, flat
from pftrack.model.timeline import Change
from pftrack.model.tracker import Tracker
from pftrack.runs.lost_frames import find_lost_frames
from pftrack.runs.run import Run

__all__ = ["MOST_NUMBERS", "Fit", "FitError", "Fitted", "Half", "fit", "fittable"]

TRIALS: Final[Mapping[int, int]] = {1: 30, 2: 60, 3: 100, 4: 150}
"""How many values of the evidence are asked for, by how many numbers are fitted."""
MOST_NUMBERS: Final = max(TRIALS)
FITTED_ROLES: Final[tuple[Role, ...]] = ("noise", "sharpness")
SEEDS: Final = 3
"""How many runs there are of each setting, where random numbers decide on anything."""
LEAST_HALF, LONGEST_HALF = 20, 300
"""Frames of each half: fewer tell nothing, more take longer and tell little more."""
BLOCKS: Final = 10
"""Into which the second half is cut to see how far its evidence differs by chance, since frames in a row are alike."""
SURE_SD: Final = 2.0
"""By how many standard errors what was found must be better on the second half to be kept."""
SMALLEST_SHARE: Final = 1e-4
"""Of a number's largest value: the least that is tried of one that may be 0."""
MOST_LOST: Final = 0.1
"""Share of the frames in which a target may be lost without a word of caution."""
NEAR_BOUND: Final = 0.05
LEVELLED: Final = 40
"""Frames of each half in which the likelihood is looked at all over the picture, where that is needed."""


class FitError(ValueError):
    """What cannot be fitted."""


@dataclass(frozen=True, slots=True)
class Fitted:
    """One number that was fitted.

    Attributes:
        declared: What it is.
        before: Its value before.
        after: The value that was found.
        at_bound: Whether that is about a bound of the number, so that the best may lie beyond.
    """

    declared: Declaration
    before: float
    after: float
    at_bound: bool


@dataclass(frozen=True, slots=True)
class Half:
    """One half of a run, with random numbers that no trial had.

    Attributes:
        first: Its first frame.
        last: Its last frame.
        before: What it comes to with the values before.
        after: With those that were found.
    """

    first: int
    last: int
    before: Score
    after: Score


@dataclass(frozen=True, slots=True)
class Fit:
    """What came of a fit.

    Attributes:
        tracker: Name of the tracker.
        numbers: Those that were fitted.
        halves: The half that was used, and the one that was not.
        gain: By how much the log evidence of a frame of the second half is larger, nats.
        gain_error: Standard error of that.
        runs: How many runs it took.
        seeds: How many runs of each setting.
        lost: In how many of the frames the run had lost its target, by the truth or by the tracker's own account.
    """

    tracker: str
    numbers: tuple[Fitted, ...]
    halves: tuple[Half, Half]
    gain: float
    gain_error: float
    runs: int
    seeds: int
    lost: int

    @property
    def kept(self) -> bool:
        """Whether what was found is better on the half that was not used."""
        return self.gain > SURE_SD * self.gain_error and any(it.after != it.before for it in self.numbers)

    @property
    def values(self) -> dict[str, Value]:
        """What was found, by name; empty if it is not kept."""
        return {it.declared.name: it.after for it in self.numbers} if self.kept else {}

    @property
    def verdict(self) -> str:
        """What came of it, one sentence."""
        if all(it.after == it.before for it in self.numbers):
            return "Not changed: nothing better was found than what was there."
        way = "larger" if self.gain > 0 else "smaller"
        size = f"{abs(self.gain):.2g} ± {self.gain_error:.1g} nats a frame"
        said = f"on the half that was not used, the evidence is {way} by {size}"
        if self.kept:
            return f"Kept: {said}."
        why = "which may be chance" if self.gain > 0 else "so what was found suits the other half alone"
        return f"Not kept: {said}, {why}."

    @property
    def caution(self) -> str:
        """Why it may mislead, one sentence; empty if nothing speaks against it."""
        frames = self.halves[1].last
        if self.lost <= MOST_LOST * frames:
            return ""
        return (
            f"The run had lost its target in {self.lost} of {frames} frames, which say little about it: fit a run, "
            "or the beginning of one, that holds it."
        )

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values by name; a number that is not known becomes None."""
        return {
            "tracker": self.tracker,
            "kept": self.kept,
            "verdict": self.verdict,
            "caution": self.caution,
            "values": self.values,
            "numbers": [
                {
                    "name": it.declared.name,
                    "title": it.declared.title,
                    "unit": it.declared.unit,
                    "before": it.before,
                    "after": it.after,
                    "at_bound": it.at_bound,
                }
                for it in self.numbers
            ],
            "halves": [
                {"first": it.first, "last": it.last, "before": it.before.as_dict(), "after": it.after.as_dict()}
                for it in self.halves
            ],
            "gain": self.gain,
            "gain_error": self.gain_error,
            "runs": self.runs,
            "seeds": self.seeds,
        }


def fittable(experiment: Experiment, tracker: str, model: type[Parameters]) -> tuple[Declaration, ...]:
    """Return the numbers of a tracker that can be fitted to what it has seen: its noises and sharpnesses.

    Args:
        experiment: The wiring.
        tracker: Name of the tracker.
        model: Of the parameters.

    Returns:
        Empty if the tracker's evidence does not tell settings apart.
    """
    known = experiment.trackers[tracker]
    roles = {"": (), "normalised": FITTED_ROLES, "relative": FITTED_ROLES if _covers(known) else FITTED_ROLES[:1]}
    return tuple(it for it in experiment.declarations(model) if _is_fittable(it, tracker, roles[known.evidence]))


def fit(run: Run, names: Iterable[str] = (), *, on_step: Callable[[int, int], object] = lambda *_: None) -> Fit:
    """Fit numbers of a run's tracker to what it has seen, and return what came of it; the run stays as it is.

    Args:
        run: Computed as far as it is to be used. Where it stands, its tracker and values are the beginning.
        names: Of the numbers; all noises and sharpnesses if there are none.
        on_step: Called with how many runs are done, and of how many at most.

    Raises:
        FitError: The tracker's evidence does not tell settings apart, a number cannot be fitted, or the run is short.
    """
    declared = _choose(run, tuple(dict.fromkeys(names)))
    end = min(run.computed + 1, 1 + 2 * LONGEST_HALF)
    if end < 1 + 2 * LEAST_HALF:
        raise FitError(
            f"A fit takes at least {1 + 2 * LEAST_HALF} frames, half of them to judge it by, and {run.computed + 1} "
            "are computed. Let the run go on first."
        )
    middle = 1 + (end - 1) // 2
    trials = _Trials(run, declared, middle, end, on_step)
    bounds = [_bounds(it) for it in declared]
    begin = [min(max(value, low), high) for value, (low, high) in zip(trials.before, bounds, strict=True)]

    found, _ = maximise(trials.evidence, begin, bounds, evaluations=TRIALS[len(declared)])
    after = (
        trials.before
        if found == tuple(begin)
        else tuple(_round(it, high) for it, (_, high) in zip(found, bounds, strict=True))
    )
    judged = [trials.judge(values) for values in (trials.before, after)]
    first, second = (Half(*frames, *(scores[half] for scores in judged)) for half, frames in enumerate(trials.halves))
    gain, gain_error = _compare(second)
    numbers = tuple(
        Fitted(it, old, new, at_bound=new != old and bool(np.isclose(new, bound, rtol=NEAR_BOUND).any()))
        for it, old, new, bound in zip(declared, trials.before, after, bounds, strict=True)
    )
    lost = int(find_lost_frames(run).lost[1:end].sum())
    return Fit(trials.tracker, numbers, (first, second), gain, gain_error, trials.done, trials.seeds, lost)


class _Trials:
    """Runs on what one run has seen, with other values and other random numbers."""

    def __init__(
        self, run: Run, declared: Sequence[Declaration], middle: int, end: int, on_step: Callable[[int, int], object]
    ) -> None:
        self.tracker = run.tracker_at(run.position)
        self.halves = (1, middle - 1), (middle, end - 1)
        self.done = 0
        parameters = run.parameters_at(run.position)
        self._names = [it.name for it in declared]
        self.before = tuple(float(flat(parameters)[name]) for name in self._names)
        self._experiment, self._on_step = run.experiment, on_step
        source = SeenSource(run, end)
        self._setup = replace(run.setup, open_source=lambda *_: source, parameters=parameters)
        self._levelled = _levelled(self.halves) if _needs_levels(run, self.tracker, declared) else ()
        told = {self._begin(self.before, 3, seed).finish().diagnostics.log_evidence for seed in (0, 1)}
        self.seeds = SEEDS if len(told) > 1 else 1
        self._judging = 2 * self.seeds if self.seeds > 1 else 1
        self._most = self.seeds * TRIALS[len(declared)] + 2 * self._judging

    def evidence(self, values: Sequence[float]) -> float:
        """Return the log evidence of a frame of the first half, with the same random numbers in all trials."""
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

    def _begin(self, values: Sequence[float], frames: int, seed: int) -> Run:
        changes = (Change(0, dict(zip(self._names, values, strict=True))),)
        return Run(self._experiment, self._setup, tracker=self.tracker, seed=seed, frames=frames, timeline=changes)


def _needs_levels(run: Run, tracker: str, declared: Sequence[Declaration]) -> bool:
    """Return whether what is left out of the evidence changes with the numbers."""
    relative = run.experiment.trackers[tracker].evidence == "relative"
    return relative and any(it.role == "sharpness" for it in declared)


def _levelled(halves: Sequence[tuple[int, int]]) -> tuple[int, ...]:
    """Return the frames in which the likelihood is looked at all over the picture, which takes longer than a step."""
    spread = (np.linspace(first, last, min(LEVELLED, last - first + 1)) for first, last in halves)
    return tuple(sorted({round(frame) for frames in spread for frame in frames.tolist()}))


def _choose(run: Run, names: Sequence[str]) -> tuple[Declaration, ...]:
    """Return the declarations of the numbers to fit."""
    tracker = run.tracker_at(run.position)
    title = run.experiment.trackers[tracker].title
    offered = {it.name: it for it in fittable(run.experiment, tracker, type(run.setup.parameters))}
    if not offered:
        raise FitError(f"The evidence of {title} does not tell settings apart, so nothing can be fitted by it.")
    for name in names:
        if name not in offered:
            raise FitError(f"{name} is no number that {title} can be fitted by; there are {', '.join(offered)}.")
    chosen = tuple(offered[name] for name in names or offered)
    if len(chosen) > MOST_NUMBERS:
        listed = ", ".join(it.name for it in chosen)
        raise FitError(f"At most {MOST_NUMBERS} numbers are fitted at once; choose among {listed}.")
    return chosen


def _covers(tracker: Tracker) -> bool:
    return tracker.likelihood is not None and tracker.likelihood.anchor is not None


def _is_fittable(it: Declaration, tracker: str, roles: tuple[Role, ...]) -> bool:
    return (
        it.role in roles
        and it.kind == "number"
        and it.live
        and (it.minimum or 0) >= 0
        and (not it.trackers or tracker in it.trackers)
    )


def _bounds(it: Declaration) -> tuple[float, float]:
    high = float(it.maximum or 0)
    return max(float(it.minimum or 0), SMALLEST_SHARE * high), high


def _round(value: float, most: float) -> float:
    """Return a number to three digits, as a person would write it."""
    return min(float(f"{value:.3g}"), most)


def _compare(half: Half) -> tuple[float, float]:
    """Return the mean difference of the evidence of a frame, nats, and its standard error, from means over blocks."""
    differences = half.after.evidence - half.before.evidence
    blocks = np.array([block.mean() for block in np.array_split(differences, min(BLOCKS, len(differences)))])
    return float(differences.mean()), float(blocks.std(ddof=1) / math.sqrt(len(blocks)))
