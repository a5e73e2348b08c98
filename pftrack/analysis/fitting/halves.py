"""Fitting a run's numbers to what it has seen: on its first half, judged on its second.

Fixed is what was seen, with all that was changed in the scene while it went on; varied is what the tracker is told. So
the fit of a simulated run is one to that recording, not one to a scene that changes with the trial.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Final

import numpy as np

from pftrack.analysis.fitting.found import Fit, FitError, Fitted, Half, Method
from pftrack.analysis.fitting.linear import maximise_linear
from pftrack.analysis.fitting.search import maximise
from pftrack.analysis.fitting.trials import TRIALS, Trials
from pftrack.core.model.parameters import Declaration, Parameters, Role
from pftrack.core.model.tracker import Tracker
from pftrack.experiments.experiment import Experiment
from pftrack.runs.lost_frames import find_lost_frames
from pftrack.runs.run import Run

__all__ = ["MOST_NUMBERS", "fit", "fittable"]

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
    if known.linear is not None:
        return tuple(it for it in experiment.declarations(model) if it.name in known.linear.scales)
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
    lost = int(find_lost_frames(run).lost[1:end].sum())
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
    return tracker.likelihood is not None and tracker.likelihood.anchor is not None


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
