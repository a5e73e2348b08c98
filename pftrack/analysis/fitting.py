"""Fitting: noises and sharpnesses that a recording supports, by the evidence of filters.

A filter that has seen the frames up to t - 1 gives the probability of frame t. The product of these numbers over a
recording is the evidence of its settings, p(z_{1:T} | settings), and settings that make it large are those under which
the recording is least surprising (Särkkä 2013, chapter 12).

`pftrack.analysis.search` finds them: golden section for one number, a simplex for several, on logarithms; expectation
maximisation where the model is linear and its noise Gaussian.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, Literal, TypeAlias

import numpy as np
from pydantic import Field, computed_field

from pftrack.analysis.search import LinearHalf, maximise, maximise_linear
from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Declaration, Parameters, Role, Value, flat
from pftrack.core.model.recipe import Change
from pftrack.core.model.series import as_json
from pftrack.core.model.tracker import Tracker
from pftrack.core.refusal import RefusedError
from pftrack.experiments.experiment import Experiment
from pftrack.filters.particles import normalise
from pftrack.runs.coverage import count_held, measure_consistency, pool_counts
from pftrack.runs.loss import Loss
from pftrack.runs.many import KeptFrames, side_by_side
from pftrack.runs.run import Run

__all__ = ["MOST_NUMBERS", "Fit", "Fitted", "Half", "Method", "Score", "fit", "fittable"]


# Fitting a run's numbers to its observations, on its first half, judged on its second; and the result of a fit.
#
# The observations are fixed, with all changes of the scene during the run; the tracker's settings vary. So the fit of a
# simulated run is one to that recording, not one to a scene that changes with the trial. A trial is a run on these
# frames with other values and other random numbers; its score rates some frames by the filter's evidence and by the
# truth. A fit has the numbers before and after, the scores of both halves, and whether to keep it.

# Where a likelihood leaves out a constant of the frame, a sharper one has another constant, and its evidence cannot be
# compared. The comparable number is the frame's likelihood where the filter expected the target relative to the whole
# picture: the evidence less the log of the mean likelihood over all places. That is a score for predicting the place
# among all places, and it has no constant left (Bishop 2006, section 4.3: a softmax over places).

MOST_BELOW: Final = 50.0
"""Largest deficit of a frame's log evidence below the run's median where it is not exact: a frame in which all
particles happen to have a weight of zero would hide all other frames."""


@dataclass(frozen=True, slots=True)
class Score:
    """The score of some frames, over several runs.

    Attributes:
        log_evidence: Mean log evidence of a frame, nats.
        coverage: Share of the reports in which a band of 50 or 95 % held the truth, by that percentage; empty without a
            known truth or without bands.
        nees: Mean squared error of a coordinate in its deviation (`Consistency`).
        nis: Mean squared innovation of a number in its deviation.
        nis_limits: Between which that of a right filter is in 95 %.
    """

    log_evidence: float
    coverage: Mapping[str, float]
    nees: float | None
    nis: float | None
    nis_limits: tuple[float, float] | None


def _log_evidence(run: Run, levels: Mapping[int, float] | None) -> Floats:
    """Return the log evidence of a finished run in each frame (T,), nats.

    Args:
        run: The run.
        levels: By frame, the mean log likelihood over the whole picture, to which the evidence is relative; if given,
            other frames do not count and are NaN. None where it is taken as it is.
    """
    evidence = np.array([row.log_evidence for row in run.diagnostics])
    evidence = np.where(np.isnan(evidence), -np.inf, evidence)
    if levels is not None:
        evidence -= np.array([levels.get(frame, np.nan) for frame in range(len(evidence))])
    exact = run.experiment.trackers[run.tracker].sampling == "exact"
    return evidence if exact else _bound(evidence)


def _bound(evidence: Floats) -> Floats:
    """Return log evidence (T,), raised to at most `MOST_BELOW` below the median; NaN stays."""
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


def _score(runs: Sequence[Run], evidence: Floats, first: int, end: int) -> Score:
    """Return the score of some frames of several runs.

    Args:
        runs: Runs of the same recording and settings with other random numbers, computed up to that end.
        evidence: (L,) log evidence of the frames that count, nats, as a mean over the runs.
        first: The first frame that counts.
        end: The frame after the last.
    """
    pooled = pool_counts(count_held(run, first, end) for run in runs)
    # Coverage of the first band that the experiment declares.
    coverage = {f"{100 * one.promised:g}": one.share for one in pooled if one.of == pooled[0].of}
    squares = measure_consistency(runs, first, end)
    return Score(float(evidence.mean()), coverage, squares.nees, squares.nis, squares.nis_limits)


def _known(evidence: Sequence[Floats], first: int, end: int) -> Floats:
    """Return the log evidence (L,) of the frames from first to before end that count, as a mean over runs, nats.

    Args:
        evidence: (T,) log evidence of each run, nats, NaN in frames that count for nothing.
        first: The first frame.
        end: The frame after the last.

    Raises:
        ValueError: All of these frames are left out.
    """
    among = np.mean([one[first:end] for one in evidence], axis=0)
    known: Floats = among[~np.isnan(among)]
    if not len(known):
        raise ValueError(f"no frame from {first} to {end - 1} counts")
    return known


KEPT_BYTES: Final = 512 * 2**20
"""Size of cached pictures, so hundreds of runs over a recording do not decode it hundreds of times."""

TRIALS: Final[Mapping[int, int]] = {1: 30, 2: 60, 3: 100, 4: 150}
"""Number of evaluations of the evidence, by the number of fitted numbers."""
SEEDS: Final = 3
"""Number of runs of each setting, if it depends on random numbers."""
SMALLEST_SHARE: Final = 1e-4
"""Least tried value of a number that may be 0, as a share of its largest value."""
LEVELLED: Final = 40
"""Number of frames of each half in which the likelihood is computed over the whole picture, where needed."""


class Trials:
    """Runs on what one run has seen.

    Attributes:
        tracker: Name of the tracker.
        halves: First and last frame of each half.
        before: The values in force.
        begin: The values to begin with: those, within the bounds.
        bounds: Least and largest value of each number that is tried.
        linear: The first half as a linear model, where it is one in these numbers, and wanted.
        seeds: Number of runs of each setting.
        tried: Number of tried settings.
        done: Number of runs made.
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
            on_step: Called with the number of finished runs, and the largest number.
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
        (_, evidence), (first, last) = self._evidence(values, range(self.seeds), self.halves[0][1]), self.halves[0]
        return float(_known(evidence, first, last + 1).mean())

    def judge(self, values: Sequence[float]) -> list[tuple[Score, Floats]]:
        """Return the score of each half, and the evidence of its frames, with random numbers that no trial used."""
        runs, found = self._evidence(values, range(self.seeds, self.seeds + self._judging), self.halves[1][1])
        known = [_known(found, first, last + 1) for first, last in self.halves]
        return [
            (_score(runs, evidence, first, last + 1), evidence)
            for (first, last), evidence in zip(self.halves, known, strict=True)
        ]

    def _evidence(self, values: Sequence[float], seeds: range, last: int) -> tuple[list[Run], list[Floats]]:
        """Return runs with these values up to a last frame, and the log evidence (T,) of each."""
        levels: dict[int, dict[int, float]] = {seed: {} for seed in seeds}
        before: dict[int, Any] = {}

        def look(run: Run) -> None:
            if run.position in self._levelled:
                levels[run.seed][run.position] = _level(run, before[run.seed], run.current)
            if self._levelled:
                before[run.seed] = run.current.state

        runs, evidence = [], []
        for made in self._carry_out(values, last + 1, seeds, look):
            evidence.append(_log_evidence(made, levels[made.seed] if self._levelled else None))
            runs.append(made)
            self.done += 1
            self._on_step(self.done, self._most)
        return runs, evidence

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
    """Return the frames in which the likelihood is computed over the whole picture, which takes longer than a step."""
    spread = (np.linspace(first, last, min(LEVELLED, last - first + 1)) for first, last in halves)
    return tuple(sorted({round(frame) for frames in spread for frame in frames.tolist()}))


SURE_SD: Final = 2.0
"""Standard errors by which a result must be better on the second half to be kept."""
MOST_LOST: Final = 0.1
"""Share of the frames in which a target may be lost without a word of caution."""

Method: TypeAlias = Literal["em", "search"]
"""The method: expectation maximisation for linear models, trial of values for others."""


@dataclass(frozen=True, slots=True)
class Fitted:
    """One number that was fitted.

    Attributes:
        name: Name of the parameter.
        title: Its title.
        unit: Its unit.
        before: Its value before.
        after: The value that was found.
        at_bound: Whether it is near a bound of the number, so the best value may lie beyond.
    """

    name: str
    title: str
    unit: str
    before: float
    after: float
    at_bound: bool


@dataclass(frozen=True, slots=True)
class Half:
    """One half of a run, with random numbers that no trial had.

    Attributes:
        first: Its first frame.
        last: Its last frame.
        before: Its score with the values before.
        after: With those that were found.
    """

    first: int
    last: int
    before: Score
    after: Score


@dataclass(frozen=True, slots=True)
class Fit:
    """The result of a fit.

    Attributes:
        tracker: Name of the tracker.
        numbers: Those that were fitted.
        halves: The half that was used, and the one that was not.
        gain: Increase of the log evidence per frame of the second half, nats.
        gain_error: Standard error of that.
        method: The method.
        rounds: Number of steps of expectation maximisation, or of tried settings.
        runs: Number of runs.
        seeds: Number of runs of each setting.
        lost: Number of frames in which the run had lost its target, by the truth or by the tracker's own report.
        gains: Increase of the log evidence of each frame of the second half, nats; not in JSON.
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
    gains: Annotated[tuple[float, ...], Field(exclude=True)] = ()

    @computed_field  # type: ignore[prop-decorator]
    @property
    def kept(self) -> bool:
        """Whether what was found is better on the half that was not used."""
        return self.gain > SURE_SD * self.gain_error and any(it.after != it.before for it in self.numbers)

    @computed_field  # type: ignore[prop-decorator]
    @property
    def values(self) -> dict[str, Value]:
        """The new values, by name; empty if they are not kept."""
        return {it.name: it.after for it in self.numbers} if self.kept else {}

    @computed_field  # type: ignore[prop-decorator]
    @property
    def verdict(self) -> str:
        """The result, one sentence."""
        if all(it.after == it.before for it in self.numbers):
            return "Not changed: nothing better was found than what was there."
        way = "larger" if self.gain > 0 else "smaller"
        size = f"{abs(self.gain):.2g} ± {self.gain_error:.1g} nats a frame"
        said = f"on the half that was not used, the evidence is {way} by {size}"
        if self.kept:
            return f"Kept: {said}."
        why = "which may be chance" if self.gain > 0 else "so what was found suits the other half alone"
        return f"Not kept: {said}, {why}."

    @computed_field  # type: ignore[prop-decorator]
    @property
    def procedure(self) -> str:
        """The method, one sentence."""
        each = f", in {self.seeds} runs each" if self.seeds > 1 else ""
        if self.method == "em":
            steps = "step" if self.rounds == 1 else "steps"
            return f"Found by expectation maximisation in {self.rounds} {steps}, since the model is linear."
        how = "golden section" if len(self.numbers) == 1 else "a simplex search"
        return f"Found by {how} over {self.rounds} settings{each}."

    @computed_field  # type: ignore[prop-decorator]
    @property
    def caution(self) -> str:
        """Why it may mislead, one sentence; empty if nothing speaks against it."""
        frames = self.halves[1].last
        if self.lost <= MOST_LOST * frames:
            return ""
        return (
            f"The run had lost its target in {self.lost} of {frames} frames, which carry little information on it: "
            "fit a run, or the beginning of one, that holds it."
        )

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values by name; a number that is not known becomes None."""
        return as_json(self)


MOST_NUMBERS: Final = max(TRIALS)
FITTED_ROLES: Final[tuple[Role, ...]] = ("noise", "sharpness")
LEAST_HALF, LONGEST_HALF = 20, 300
"""Frames of each half: fewer are not enough, more take longer and help little."""
BLOCKS: Final = 10
"""Number of stretches of the second half for the standard error, since successive frames are correlated."""
NEAR_BOUND: Final = 0.05


def fittable(experiment: Experiment, tracker: str, model: type[Parameters]) -> tuple[Declaration, ...]:
    """Return the numbers of a tracker that can be fitted to its observations: its noises and sharpnesses.

    Args:
        experiment: The wiring.
        tracker: Name of the tracker.
        model: Model of the parameters.

    Returns:
        Empty if the tracker's evidence does not distinguish settings. For a linear model those that scale its noises:
        any other would change the measurement.
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
    """Fit numbers of a run's tracker to its observations, and return the result; the run stays unchanged.

    Args:
        run: Computed as far as it is to be used. Where it stands, its tracker and values are the beginning.
        names: Names of the numbers; by default all noises and sharpnesses.
        method: The method; by default expectation maximisation for linear models.
        on_step: Called with the number of finished runs, and the largest number.

    Raises:
        RefusedError: The tracker's evidence does not tell settings apart, a number cannot be fitted, the run is short,
            or the model is not linear and expectation maximisation was asked for.
    """
    declared = _choose(run, tuple(dict.fromkeys(names)))
    end = min(run.computed + 1, 1 + 2 * LONGEST_HALF)
    if end < 1 + 2 * LEAST_HALF:
        raise RefusedError(
            f"A fit takes at least {1 + 2 * LEAST_HALF} frames, half of them to judge it by, and {run.computed + 1} "
            "are computed. Let the run go on first."
        )
    middle = 1 + (end - 1) // 2
    trials = Trials(run, declared, middle, end, linear=method != "search", on_step=on_step)
    if trials.linear is not None:
        found, rounds = maximise_linear(trials.linear, trials.begin, trials.bounds)
    elif method == "em":
        title = run.experiment.trackers[trials.tracker].title
        raise RefusedError(
            f"The model of {title} is not linear in these numbers, so expectation maximisation cannot find them."
        )
    else:
        found, _ = maximise(trials.evidence, trials.begin, trials.bounds, evaluations=TRIALS[len(declared)])
        rounds = trials.tried
    rounded = tuple(_round(it, *bounds) for it, bounds in zip(found, trials.bounds, strict=True))
    after = trials.before if found == trials.begin else rounded
    judged = [trials.judge(values) for values in (trials.before, after)]
    first, second = (
        Half(*frames, *(scores[half][0] for scores in judged)) for half, frames in enumerate(trials.halves)
    )
    (_, before), (_, better) = (scores[1] for scores in judged)
    gains = better - before
    numbers = tuple(
        Fitted(
            it.name,
            it.title,
            it.unit,
            old,
            new,
            at_bound=new != old and bool(np.isclose(new, bound, rtol=NEAR_BOUND).any()),
        )
        for it, old, new, bound in zip(declared, trials.before, after, trials.bounds, strict=True)
    )
    lost = int(Loss.of(run.diagnostics).lost[1:end].sum())
    return Fit(
        tracker=trials.tracker,
        numbers=numbers,
        halves=(first, second),
        gain=float(gains.mean()),
        gain_error=_error(gains),
        method="search" if trials.linear is None else "em",
        rounds=rounds,
        runs=trials.done,
        seeds=trials.seeds,
        lost=lost,
        gains=tuple(gains.tolist()),
    )


def _choose(run: Run, names: Sequence[str]) -> tuple[Declaration, ...]:
    """Return the declarations of the numbers to fit."""
    tracker = run.tracker_at(run.position)
    title = run.experiment.trackers[tracker].title
    offered = {it.name: it for it in fittable(run.experiment, tracker, type(run.setup.parameters))}
    if not offered:
        raise RefusedError(f"The evidence of {title} does not distinguish settings, so it cannot fit anything.")
    for name in names:
        if name not in offered:
            raise RefusedError(f"{title} has no number {name!r} that can be fitted; there are {', '.join(offered)}.")
    chosen = tuple(offered[name] for name in names or offered)
    if len(chosen) > MOST_NUMBERS:
        listed = ", ".join(it.name for it in chosen)
        raise RefusedError(f"At most {MOST_NUMBERS} numbers are fitted at once; choose among {listed}.")
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


def _error(gains: Floats) -> float:
    """Return the standard error of the mean of what the frames (L,) of the second half gain, from means over blocks."""
    blocks = np.array([block.mean() for block in np.array_split(gains, min(BLOCKS, len(gains)))])
    return float(blocks.std(ddof=1) / math.sqrt(len(blocks)))
