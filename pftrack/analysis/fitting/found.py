"""Fitting a run's numbers to what it has seen, on its first half, judged on its second; and what a fit has found.

Fixed is what was seen, with all that was changed in the scene while it went on; varied is what the tracker is told. So
the fit of a simulated run is one to that recording, not one to a scene that changes with the trial. A fit knows the
numbers before and after, how both halves of the run went, and whether it is kept.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias

import numpy as np

from pftrack.analysis.fitting.search import maximise, maximise_linear
from pftrack.analysis.fitting.trials import TRIALS, Score, Trials
from pftrack.core.model.parameters import Declaration, Parameters, Role, Value
from pftrack.core.model.tracker import Tracker
from pftrack.experiments.experiment import Experiment
from pftrack.runs.loss import Loss
from pftrack.runs.run import Run

SURE_SD: Final = 2.0
"""By how many standard errors what was found must be better on the second half to be kept."""
MOST_LOST: Final = 0.1
"""Share of the frames in which a target may be lost without a word of caution."""

Method: TypeAlias = Literal["em", "search"]
"""How numbers are found: by expectation maximisation where the model is linear, by trying values elsewhere."""


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
        method: How they were found.
        rounds: How many steps of expectation maximisation, or how many settings were tried.
        runs: How many runs it took.
        seeds: How many runs of each setting.
        lost: In how many of the frames the run had lost its target, by the truth or by the tracker's own account.
    """

    tracker: str
    numbers: tuple[Fitted, ...]
    halves: tuple[Half, Half]
    gain: float
    gain_error: float
    method: Method
    rounds: int
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
    def procedure(self) -> str:
        """How it was found, one sentence."""
        each = f", in {self.seeds} runs each" if self.seeds > 1 else ""
        if self.method == "em":
            steps = "step" if self.rounds == 1 else "steps"
            return f"Found by expectation maximisation in {self.rounds} {steps}, since the model is linear."
        how = "golden section" if len(self.numbers) == 1 else "a simplex search"
        return f"Found by {how} over {self.rounds} settings{each}."

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
            "method": self.method,
            "rounds": self.rounds,
            "procedure": self.procedure,
            "runs": self.runs,
            "seeds": self.seeds,
        }


MOST_NUMBERS: Final = max(TRIALS)
FITTED_ROLES: Final[tuple[Role, ...]] = ("noise", "sharpness")
LEAST_HALF, LONGEST_HALF = 20, 300
"""Frames of each half: fewer tell nothing, more take longer and tell little more."""
BLOCKS: Final = 10
"""Into which the second half is cut to see how far its evidence differs by chance, since frames in a row are alike."""
NEAR_BOUND: Final = 0.05


def fittable(experiment: Experiment, tracker: str, model: type[Parameters]) -> tuple[Declaration, ...]:
    """Return the numbers of a tracker that can be fitted to what it has seen: its noises and sharpnesses.

    Args:
        experiment: The wiring.
        tracker: Name of the tracker.
        model: Of the parameters.

    Returns:
        Empty if the tracker's evidence does not tell settings apart. Of a linear model those that scale its noises: any
        other changes what is measured.
    """
    known = experiment.trackers[tracker]
    if known.model is not None and known.sampling == "exact":
        return tuple(it for it in experiment.declarations(model) if it.name in known.model.scales)
    roles = {"": (), "normalised": FITTED_ROLES, "relative": FITTED_ROLES if _covers(known) else FITTED_ROLES[:1]}
    return tuple(it for it in experiment.declarations(model) if _is_fittable(it, tracker, roles[known.evidence]))


def fit(
    run: Run,
    names: Iterable[str] = (),
    *,
    method: Method | None = None,
    on_step: Callable[[int, int], object] = lambda *_: None,
) -> Fit:
    """Fit numbers of a run's tracker to what it has seen, and return what came of it; the run stays as it is.

    Args:
        run: Computed as far as it is to be used. Where it stands, its tracker and values are the beginning.
        names: Of the numbers; all noises and sharpnesses if there are none.
        method: How to find them; by expectation maximisation where the model is linear if not given.
        on_step: Called with how many runs are done, and of how many at most.

    Raises:
        FitError: The tracker's evidence does not tell settings apart, a number cannot be fitted, the run is short, or
            the model is not linear and expectation maximisation was asked for.
    """
    declared = _choose(run, tuple(dict.fromkeys(names)))
    end = min(run.computed + 1, 1 + 2 * LONGEST_HALF)
    if end < 1 + 2 * LEAST_HALF:
        raise FitError(
            f"A fit takes at least {1 + 2 * LEAST_HALF} frames, half of them to judge it by, and {run.computed + 1} "
            "are computed. Let the run go on first."
        )
    middle = 1 + (end - 1) // 2
    trials = Trials(run, declared, middle, end, linear=method != "search", on_step=on_step)
    if trials.linear is not None:
        found, rounds = maximise_linear(trials.linear, trials.begin, trials.bounds)
    elif method == "em":
        title = run.experiment.trackers[trials.tracker].title
        raise FitError(
            f"The model of {title} is not linear in these numbers, so expectation maximisation cannot find them."
        )
    else:
        found, _ = maximise(trials.evidence, trials.begin, trials.bounds, evaluations=TRIALS[len(declared)])
        rounds = trials.tried
    rounded = tuple(_round(it, *bounds) for it, bounds in zip(found, trials.bounds, strict=True))
    after = trials.before if found == trials.begin else rounded
    judged = [trials.judge(values) for values in (trials.before, after)]
    first, second = (Half(*frames, *(scores[half] for scores in judged)) for half, frames in enumerate(trials.halves))
    gain, gain_error = _compare(second)
    numbers = tuple(
        Fitted(it, old, new, at_bound=new != old and bool(np.isclose(new, bound, rtol=NEAR_BOUND).any()))
        for it, old, new, bound in zip(declared, trials.before, after, trials.bounds, strict=True)
    )
    lost = int(Loss.of(run.diagnostics).lost[1:end].sum())
    return Fit(
        tracker=trials.tracker,
        numbers=numbers,
        halves=(first, second),
        gain=gain,
        gain_error=gain_error,
        method="search" if trials.linear is None else "em",
        rounds=rounds,
        runs=trials.done,
        seeds=trials.seeds,
        lost=lost,
    )


def _choose(run: Run, names: Sequence[str]) -> tuple[Declaration, ...]:
    """Return the declarations of the numbers to fit."""
    tracker = run.tracker_at(run.position)
    title = run.experiment.trackers[tracker].title
    offered = {it.name: it for it in fittable(run.experiment, tracker, type(run.setup.parameters))}
    if not offered:
        raise FitError(f"The evidence of {title} does not tell settings apart, so nothing can be fitted by it.")
    for name in names:
        if name not in offered:
            raise FitError(f"{title} has no number {name!r} that can be fitted; there are {', '.join(offered)}.")
    chosen = tuple(offered[name] for name in names or offered)
    if len(chosen) > MOST_NUMBERS:
        listed = ", ".join(it.name for it in chosen)
        raise FitError(f"At most {MOST_NUMBERS} numbers are fitted at once; choose among {listed}.")
    return chosen


def _covers(tracker: Tracker) -> bool:
    return tracker.model is not None and tracker.model.has_place


def _is_fittable(it: Declaration, tracker: str, roles: tuple[Role, ...]) -> bool:
    return (
        it.role in roles
        and it.kind == "number"
        and it.live
        and (it.minimum or 0) >= 0
        and (not it.trackers or tracker in it.trackers)
    )


def _round(value: float, least: float, most: float) -> float:
    """Return a number to three digits, as a person would write it, within its bounds."""
    return min(max(float(f"{value:.3g}"), least), most)


def _compare(half: Half) -> tuple[float, float]:
    """Return the mean difference of the evidence of a frame, nats, and its standard error, from means over blocks."""
    differences = half.after.evidence - half.before.evidence
    blocks = np.array([block.mean() for block in np.array_split(differences, min(BLOCKS, len(differences)))])
    return float(differences.mean()), float(blocks.std(ddof=1) / math.sqrt(len(blocks)))
