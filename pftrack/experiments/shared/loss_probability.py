"""The probability that a tracker has lost its target, estimated from the tracker's own numbers.

A tracker continues whether it follows its target or something else. Its intermediate numbers (signals) distinguish the
two cases to some degree: the agreement of the picture with the prediction, the width of the belief, the number of
effective particles, and jumps of the estimate. Each number is meaningful only relative to its past. A logistic
regression weighs them; it is fitted on scenes drawn at random, frozen, and judged on others (`tools.loss_probability`).
It is declared only where it is calibrated. On recordings it is not calibrated, and not shown.
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Value
from pftrack.core.model.series import Hypotheses, Series, SeriesRole, SeriesValue
from pftrack.core.model.tracker import Diagnostics, Tracker
from pftrack.core.numerics.elementary import exponential, logarithm

# P(lost | x) = 1 / (1 + exp(-(a + sum_i w_i z_i))), with z_i a feature less its mean in standard deviations. The
# weights are fitted by `tools.loss_probability`.

CLIP = 4.0
"""Largest distance of a feature from its mean, in standard deviations; nothing is known beyond."""


@dataclass(frozen=True, slots=True)
class Logistic:
    """A fitted regression on F features.

    Attributes:
        means: Means of the features.
        deviations: Their standard deviations; infinite for a constant one, which removes its effect.
        weights: Weights of the features in standard deviations.
        intercept: The constant term.
    """

    means: tuple[float, ...]
    deviations: tuple[float, ...]
    weights: tuple[float, ...]
    intercept: float

    def probabilities(self, features: Floats) -> Floats:
        """Return (L,) probabilities by (L, F) features; the same bits on every machine, since sums are exact."""
        if not len(features):
            return np.zeros(0)
        terms = scale(features, np.array(self.means), np.array(self.deviations)) * np.array(self.weights)
        return 1.0 / (1.0 + exponential([-math.fsum((self.intercept, *row)) for row in terms.tolist()]))


def scale(features: Floats, means: Floats, deviations: Floats) -> Floats:
    """Return features (L, F) less their means (F,), in standard deviations (F,), within the clip."""
    return np.clip((features - means) / deviations, -CLIP, CLIP)


# Signals: numbers of a frame that indicate a lost target without the truth.
#
# Everything is read from the rows of a run by the declared roles of columns and series, so signals exist for every
# tracker, including those of other packages, and for old saved runs:
#
# | signal | meaning |
# |---|---|
# | evidence | log evidence of the frame |
# | spread | logarithm of the standard deviation, the root mean square of all components |
# | step | ln(1 + distance of the estimate from the one before, in these deviations) |
# | jump | ln(1 + distance of the estimate from the extrapolation of its last two, in these deviations) |
# | searching | 1 where the tracker reports that it searches its target |
# | ess | logarithm of the effective sample size over the number of particles, by the roles "ess" and "particles" |
#
# and, under its name, each series of the role "share" (share of the first component), "flag" (mean of the flags),
# "event" (1 where it happened), "extent" (logarithm of the area), "resampled", "likeness" and "model_likeness" (the
# number), and further series that an experiment names: the number, the mean of a vector's components, of hypotheses one
# less the sum of the squared weights (Gini's index).

LEAST = 1e-9
"""Smallest value before its logarithm is taken."""

FARTHEST = 700.0
"""A log evidence counts as no further from zero."""


def read_signals(
    names: Sequence[str],
    series: Mapping[str, Series],
    rows: Sequence[Diagnostics],
    before: Sequence[tuple[float, ...]] = (),
) -> Floats:
    """Return the signals of some frames, (L, S), NaN where one is not known.

    Args:
        names: Names of the signals.
        series: All that may be in the rows, by name.
        rows: Rows of consecutive frames.
        before: Estimates of the frames before these, two at most.
    """
    by_role = {one.role: one.name for one in series.values()}
    deviations = np.maximum([_deviation(row) for row in rows], LEAST)
    steps, jumps = _moves([*before, *(row.estimate for row in rows)], len(rows))
    columns: dict[str, Floats] = {}
    for name in names:
        match name:
            case "evidence":
                columns[name] = np.clip([row.log_evidence for row in rows], -FARTHEST, FARTHEST)
            case "spread":
                columns[name] = _logarithm(deviations)
            case "step":
                columns[name] = _logarithm(1.0 + steps / deviations)
            case "jump":
                columns[name] = _logarithm(1.0 + jumps / deviations)
            case "searching":
                columns[name] = np.array([math.nan if row.searching is None else row.searching for row in rows], float)
            case "ess":
                some = [(row.number(by_role["ess"]), row.number(by_role["particles"])) for row in rows]
                columns[name] = _logarithm([size / count if count else math.nan for size, count in some])
            case _:
                numbers = [_number(series[name], row.series.get(name)) for row in rows]
                columns[name] = _logarithm(numbers) if series[name].role == "extent" else np.array(numbers)
    return np.column_stack([columns[name] for name in names])


def _logarithm(values: Sequence[float] | Floats) -> Floats:
    """Return ln of numbers that are not negative; NaN stays NaN."""
    return np.where(np.isnan(values), np.nan, logarithm(np.maximum(values, LEAST)))


def _deviation(row: Diagnostics) -> float:
    known = [value for value in row.sigma if math.isfinite(value)]
    return math.sqrt(math.fsum(value * value for value in known) / len(known)) if known else math.nan


def _moves(estimates: Sequence[tuple[float, ...]], count: int) -> tuple[Floats, Floats]:
    """Return the distances of the last `count` estimates from the previous one and from the extrapolation; or 0."""
    moves = []
    for place in range(len(estimates) - count, len(estimates)):
        now, last, earlier = (estimates[max(place - back, 0)] for back in range(3))
        step = math.sqrt(math.fsum((a - b) * (a - b) for a, b in zip(now, last, strict=True)))
        bend = ((a - 2.0 * b + c) for a, b, c in zip(now, last, earlier, strict=True))
        moves.append((step, math.sqrt(math.fsum(value * value for value in bend)) if place > 1 else 0.0))
    steps, jumps = np.array(moves).T
    return np.nan_to_num(steps), np.nan_to_num(jumps)


def _number(series: Series, value: SeriesValue | None) -> float:
    if isinstance(value, Hypotheses):
        return 1.0 - math.fsum(weight * weight for weight in value.weights)
    given = value if isinstance(value, tuple) else () if value is None else (value,)
    numbers = [float(one) for one in given if math.isfinite(one)]
    return _AS_ROLE.get(series.role, _mean)(numbers) if numbers else math.nan


def _mean(numbers: Sequence[float]) -> float:
    return math.fsum(numbers) / len(numbers)


_AS_ROLE: Mapping[SeriesRole, Callable[[Sequence[float]], float]] = {
    "share": lambda numbers: numbers[0] / max(math.fsum(numbers), LEAST),
    "event": lambda numbers: float(numbers[0] > 0.0),
    "extent": math.prod,
}
"""Reduction of a series's numbers, by its role; for all others, their mean."""


# The meaning of a number depends on its usual value: the log evidence of one scene is not comparable with that of
# another. So each signal has a memory of its past. A frame's features depend only on the frames up to it, and a memory
# of a few numbers suffices, so a continued run is not read again.

KINDS: tuple[str, ...] = ("now", "fast", "slow", "change", "lowest", "highest")
"""Features of each signal: its value; its means over about the last 5 and the last 25 frames; the change of the first
of these since the beginning; the least and the greatest such change so far."""

FAST, SLOW = 1.0 / 5.0, 1.0 / 25.0
"""Share of a mean that a new value replaces."""

BEGINNING = 5
"""Number of known values at the beginning, whose mean is the usual value."""


@dataclass(frozen=True, slots=True, eq=False)
class Memory:
    """The memory of S signals over the frames so far.

    Attributes:
        counts: (S,) frames in which each was known.
        fast: (S,) mean over the last few; 0 where none was known.
        slow: (S,) mean over more.
        usual: (S,) mean over the first few.
        lowest: (S,) least of all changes so far.
        highest: (S,) greatest.
    """

    counts: Floats
    fast: Floats
    slow: Floats
    usual: Floats
    lowest: Floats
    highest: Floats

    @classmethod
    def empty(cls, count: int) -> "Memory":
        """Return that of no frame, of so many signals."""
        return cls(*np.zeros((6, count)))


def feature_names(signals: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the features of some signals, in the order in which `remember` gives them."""
    return tuple(f"{signal} {kind}" for signal in signals for kind in KINDS)


def remember(memory: Memory, signals: Floats) -> tuple[Memory, Floats]:
    """Return what is kept after some frames, and their features (L, S times the kinds).

    A signal that is not known in a frame changes no memory, and its "now" is the fast mean.

    Args:
        memory: Memory of the frames before.
        signals: (L, S) of these frames, NaN where one is not known.
    """
    found = np.empty((len(signals), signals.shape[1], len(KINDS)))
    for place, values in enumerate(signals):
        known = ~np.isnan(values)
        counts = memory.counts + known
        first = 1.0 / np.maximum(counts, 1.0)
        now = np.where(known, values, memory.fast)
        fast = memory.fast + np.where(known, np.maximum(FAST, first), 0.0) * (now - memory.fast)
        slow = memory.slow + np.where(known, np.maximum(SLOW, first), 0.0) * (now - memory.slow)
        begins = known & (counts <= BEGINNING)
        usual = memory.usual + np.where(begins, first, 0.0) * (now - memory.usual)
        change = fast - usual
        lowest, highest = np.minimum(memory.lowest, change), np.maximum(memory.highest, change)
        memory = Memory(counts, fast, slow, usual, lowest, highest)
        found[place] = np.stack([now, fast, slow, change, lowest, highest], axis=1)
    return memory, found.reshape(len(signals), -1)


@dataclass(frozen=True, slots=True, eq=False)
class Past:
    """A model's memory of past frames.

    Attributes:
        memory: Memory of the signals; None before the first frame.
        estimates: The last two.
    """

    memory: Memory | None = None
    estimates: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True, slots=True)
class LossModel:
    """A model of the probability that a tracker has lost its target.

    Attributes:
        signals: Names of what is read of each frame.
        regression: On the features of these, in the order of `feature_names`.
        series: Series in the tracker's rows, by name.
    """

    signals: tuple[str, ...]
    regression: Logistic
    series: Mapping[str, Series] = field(default_factory=dict)

    def follow(self, past: Past, rows: Sequence[Diagnostics]) -> tuple[Past, Floats]:
        """Return what is kept after some frames, and the probability in each, (L,).

        Args:
            past: Memory after the frame before them. An empty one begins with the first of these, in which a tracker
                only begins, so its probability is unknown.
            rows: Rows of consecutive frames.
        """
        if not rows:
            return past, np.zeros(0)
        past, features = follow_features(self.signals, self.series, past, rows)
        said = self.regression.probabilities(features)
        return past, np.concatenate([np.full(len(rows) - len(said), np.nan), said])


def follow_features(
    signals: Sequence[str], series: Mapping[str, Series], past: Past, rows: Sequence[Diagnostics]
) -> tuple[Past, Floats]:
    """Return what is kept after some frames, and the features of each but one in which a tracker begins."""
    estimates = (*past.estimates, *(row.estimate for row in rows))[-2:]
    memory, before = past.memory, past.estimates
    if memory is None:
        memory, before, rows = Memory.empty(len(signals)), (rows[0].estimate,), rows[1:]
    if rows:
        memory, features = remember(memory, read_signals(signals, series, rows, before))
    else:
        features = np.zeros((0, 0))
    return Past(memory, estimates), features


# The meaning of a tracker's own numbers depends on the scene: a small likelihood is alarming in a scene that never
# hides its target, and usual in another one. So an experiment gives the bounds from which its parameters are drawn, and
# each number is a scene: the same on every machine, and a number not used in fitting is an unseen scene.


@dataclass(frozen=True, slots=True)
class Scenes:
    """Ranges for the parameters of a scene.

    Attributes:
        ranges: Least and greatest value by name of a parameter, drawn evenly; whole numbers if both are.
        choices: Values by name; one is drawn.
        frames: Length of a run; of a scene that is shorter, all of it.
        fitted: Number of scenes for fitting, with numbers from 0 on.
        judged: Number of other scenes for judging, with numbers of their own.
        trackers: Names of those trackers that are fitted, where some would take too long; all if empty.
    """

    ranges: Mapping[str, tuple[int | float, int | float]]
    choices: Mapping[str, tuple[Value, ...]] = field(default_factory=dict)
    frames: int = 120
    fitted: int = 160
    judged: int = 80
    trackers: tuple[str, ...] = ()


LOSS_PROBABILITY = Series(
    "loss_probability",
    "probability that the target is lost",
    role="loss_probability",
)
"""The series of each tracker that has a model; general code uses it by its role."""

MOST_ERROR = 0.05
"""Expected calibration error in scenes that were not fitted above which none is declared."""

FORMAT = "pftrack-loss"


@dataclass(frozen=True)
class LossDeclaration:
    """The trackers with a declared probability, and their fits.

    Attributes:
        scenes: On which it is fitted and judged; None where nothing was.
        signals: Names of series that are signals in addition to those of every tracker.
        models: By name of the tracker, of those whose probability is true in scenes that were not fitted.
        refused: By name of the tracker, the expected calibration error in scenes that were not fitted, of those that
            have none because it is too great.
    """

    scenes: Scenes | None = None
    signals: tuple[str, ...] = ()
    models: Mapping[str, LossModel] = field(default_factory=dict)
    refused: Mapping[str, float] = field(default_factory=dict)

    def models_on(self, recording: object | None) -> Mapping[str, LossModel]:
        """Return the models by name of the tracker; none on a recording, where they are not calibrated.

        Args:
            recording: The recording or its kind; None in the simulated scene.
        """
        return self.models if recording is None else {}


NOTHING_DECLARED = LossDeclaration()
"""For an experiment whose trackers have no such probability."""


def read_declaration(
    path: Path, trackers: Mapping[str, Tracker], scenes: Scenes, signals: tuple[str, ...] = ()
) -> LossDeclaration:
    """Return what is declared by the models in a file.

    Args:
        path: Path of the file.
        trackers: Its trackers, by name.
        scenes: On which they were fitted and judged.
        signals: Names of series that are signals in addition to those of every tracker.

    Raises:
        ValueError: The file holds something else, or speaks of a tracker that is not there.
    """
    try:
        models, refused = _models(_raw(path), trackers)
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{path.name} is not a file of loss probabilities ({type(error).__name__}: {error})") from None
    return LossDeclaration(scenes, signals, models, refused)


def _raw(path: Path) -> dict[str, Any]:
    raw: dict[str, Any] = json.loads(path.read_text("utf-8"))
    if (raw["format"], raw["version"]) != (FORMAT, 1):
        raise ValueError(f"expected {FORMAT}, version 1")
    return raw


def _models(raw: Mapping[str, Any], trackers: Mapping[str, Tracker]) -> tuple[dict[str, LossModel], dict[str, float]]:
    models = {name: _model(values, trackers[name].series) for name, values in raw["trackers"].items()}
    return models, {trackers[name].id: float(error) for name, error in raw["refused"].items()}


def _model(values: Mapping[str, Any], series: tuple[Series, ...]) -> LossModel:
    numbers = {name: tuple(float(one) for one in values[name]) for name in ("means", "deviations", "weights")}
    if len({len(column) for column in numbers.values()}) != 1:
        raise ValueError("means, deviations and weights are not as many")
    regression = Logistic(**numbers, intercept=float(values["intercept"]))
    return LossModel(tuple(values["signals"]), regression, {one.name: one for one in series})
