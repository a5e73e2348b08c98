"""How true the probabilities are by which trackers say that they have lost their target.

They (docs/explanation/loss.md) are fitted on some scenes that are drawn at random, and judged here on others: a tracker
declares its probability where the expected calibration error in these is at most 0.05. No publication has such figures
of these trackers.

The figures are a small panel a tracker:

- Reliability: of the frames in which a probability is said, the share that are lost; a dot a bin, the larger the more
  frames it has, and all on the diagonal where the probability is true.
- Receiver operating characteristic: the share of the lost frames that a threshold tells, over the share of the others
  that it tells wrongly.
- Delays: the share of the losses that have been told so many frames after they began.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.model.parameters import Value, revise
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments import EXPERIMENTS, find
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.shared import loss_probability
from pftrack.output.figures.style import CURVE_COLOURS, INK, LETTERS_PT, TWO_COLUMNS_IN, new_figure
from pftrack.reproduce.finding import Findings, References
from pftrack.reproduce.pool import Pool, begin, recipe
from pftrack.runs.run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FIGURES = ("loss-reliability", "loss-roc", "loss-delays")

COLUMNS, HIGH_IN, FOOT_IN = 5, 1.5, 0.4
LAST_FRAME = 20
FIRST_JUDGED = 10_000
"""Number of the first scene for judging; those for fitting begin at 0."""
LARGEST_DOT, SMALLEST_DOT = 60.0, 4.0
LINE_PT, TITLE_PT = 1.3, 7


def draw_scores(found: Mapping[tuple[str, str], "Judgement"]) -> "dict[str, Figure]":
    """Return the figures by name, of trackers by experiment and name."""
    drawings = (
        (_draw_reliability, "probability that is said", "share that is lost"),
        (_draw_roc, "share of the other frames", "share of the lost frames"),
        (_draw_delays, "frames since the loss began", "share of the losses"),
    )
    experiments = list(dict.fromkeys(experiment for experiment, _ in found))
    figures = {}
    for name, (draw, across, up) in zip(FIGURES, drawings, strict=True):
        rows = -(-len(found) // COLUMNS)
        figure, panels = new_figure(
            rows * HIGH_IN + FOOT_IN, width=TWO_COLUMNS_IN, rows=rows, columns=COLUMNS, share="xy"
        )
        for panel, ((experiment, tracker), judged) in zip(panels, found.items(), strict=False):
            draw(panel, judged, CURVE_COLOURS[experiments.index(experiment) % len(CURVE_COLOURS)])
            panel.set_title(f"{experiment}, {tracker}", fontsize=TITLE_PT)
            panel.set_ylim(-0.04, 1.04)
        for panel in panels[len(found) :]:
            panel.set_visible(False)
        for panel in panels[max(len(found) - COLUMNS, 0) : len(found)]:
            panel.tick_params(labelbottom=True)
        figure.supxlabel(across, fontsize=LETTERS_PT)
        figure.supylabel(up, fontsize=LETTERS_PT)
        figures[name] = figure
    return figures


def _draw_reliability(panel: "Axes", found: "Judgement", colour: str) -> None:
    shares = np.array([one.frames for one in found.bins]) / sum(one.frames for one in found.bins)
    said, lost = [one.probability for one in found.bins], [one.lost for one in found.bins]
    panel.plot([0, 1], [0, 1], color=INK["frame"], linewidth=LINE_PT, linestyle="dashed")
    panel.plot(said, lost, color=colour, linewidth=LINE_PT)
    panel.scatter(said, lost, s=np.maximum(LARGEST_DOT * np.sqrt(shares), SMALLEST_DOT), color=colour)


def _draw_roc(panel: "Axes", found: "Judgement", colour: str) -> None:
    panel.plot([0, 1], [0, 1], color=INK["frame"], linewidth=LINE_PT, linestyle="dashed")
    panel.plot(found.roc.false_alarms, found.roc.told, color=colour, linewidth=LINE_PT)
    panel.text(1.0, 0.04, f"{found.roc.area:.3f}", fontsize=LETTERS_PT, ha="right")


def _draw_delays(panel: "Axes", found: "Judgement", colour: str) -> None:
    frames = np.arange(LAST_FRAME + 1)
    told = np.array([sum(one <= frame for one in found.delays.frames) for frame in frames]) / max(
        found.delays.losses, 1
    )
    panel.step(frames, told, where="post", color=colour, linewidth=LINE_PT)
    panel.text(LAST_FRAME, 0.04, f"{found.delays.losses} losses", fontsize=LETTERS_PT, ha="right")


REFERENCES = References(__file__)


class Case(NamedTuple):
    """One run in a scene that was drawn, by its number, and the signals that are read of it."""

    experiment: str
    tracker: str
    number: int
    signals: tuple[str, ...]


@dataclass(frozen=True, eq=False, slots=True)
class Witnessed:
    """What was seen in the L frames of a run whose truth is known.

    Attributes:
        features: (L, F).
        lost: (L,) whether the target was, by the truth.
    """

    features: Floats
    lost: Bools


# Scores say how good probabilities are, beside what happened.
#
# - Brier score: mean of (p - y)^2 (Brier, Verification of forecasts expressed in terms of probability, 1950).
# - Reliability: of the frames in which p was said, how many were lost; the expected calibration error is the mean of
#   the difference over ten bins of equal width, weighed by their frames (Naeini, Cooper, Hauskrecht, Obtaining well
#   calibrated probabilities using Bayesian binning, 2015).
# - Receiver operating characteristic: share of the reported lost frames over the share of the other reported frames,
# for every threshold; its area is the chance that a lost frame has the greater probability of the two.
# - Delay: frames from the beginning of a loss to the first in which the probability is at least a half.

BINS = 10
CERTAIN = 0.5
LASTING = 5
"""Losses that last shorter than this are over before anything could be said."""


@dataclass(frozen=True, slots=True)
class Bin:
    """The frames whose probability lies in one of the bins: how many, the mean of it, and how many were lost."""

    frames: int
    probability: float
    lost: float


@dataclass(frozen=True, slots=True)
class Roc:
    """Receiver operating characteristic.

    Attributes:
        false_alarms: Share of the frames not lost whose probability is at least a threshold, from none to all.
        told: Share of the lost ones, by the same thresholds.
        area: Under the curve; NaN where all frames are lost, or none.
    """

    false_alarms: Floats
    told: Floats
    area: float


@dataclass(frozen=True, slots=True)
class Delays:
    """How soon losses were told.

    Attributes:
        losses: How many there were that lasted.
        told: How many of them were told before they ended.
        frames: Frames until the report of each reported loss.
    """

    losses: int
    told: int
    frames: tuple[int, ...]

    @property
    def share(self) -> float:
        """Share of the losses that were told before they ended."""
        return self.told / self.losses if self.losses else float("nan")

    @property
    def median(self) -> float:
        """Frames until half of all losses were told, those that never were included; infinite if fewer were."""
        waits = np.sort(np.array([*self.frames, *[np.inf] * (self.losses - self.told)]))
        return float(waits[(len(waits) - 1) // 2]) if len(waits) else float("nan")


@dataclass(frozen=True, slots=True)
class Judgement:
    """How good probabilities are in runs that were not fitted.

    Attributes:
        bins: Frames by their probability.
        brier: Brier score.
        base: That of who always says the share of lost frames.
        roc: What thresholds tell.
        delays: How soon losses were told.
    """

    bins: tuple[Bin, ...]
    brier: float
    base: float
    roc: Roc
    delays: Delays

    @property
    def error(self) -> float:
        """Expected calibration error."""
        total = sum(one.frames for one in self.bins)
        return sum(one.frames * abs(one.probability - one.lost) for one in self.bins) / total


def cases(experiment: str, tracker: str, numbers: Iterable[int], signals: tuple[str, ...]) -> list[Case]:
    """Return the runs of a tracker in some scenes."""
    return [Case(experiment, tracker, number, signals) for number in numbers]


def witness(case: Case) -> Witnessed:
    """Return what was seen in a run."""
    experiment = find(case.experiment)
    scenes, setup = scenes_of(experiment), experiment.simulate()
    drawn = draw_scene(scenes, case.number)
    longest = setup.open_source(case.number, revise(setup.parameters, drawn)).frame_count or scenes.frames
    frames = min(scenes.frames, longest)
    run = begin(recipe(case.experiment, case.tracker, drawn, seed=case.number, frames=frames))
    run.finish()
    return witnessed(run, case.signals)


def witnessed(run: Run, signals: tuple[str, ...]) -> Witnessed:
    """Return what was seen in a run, by the signals of its tracker."""
    series = {one.name: one for one in run.experiment.trackers[run.tracker].series}
    _, features = loss_probability.follow_features(signals, series, loss_probability.Past(), run.diagnostics)
    verdicts = [row.lost for row in run.diagnostics[1:]]
    known = np.array([one is not None for one in verdicts])
    return Witnessed(features[known], np.array([one is True for one in verdicts])[known])


def judge(regression: loss_probability.Logistic, seen: Sequence[Witnessed]) -> Judgement:
    """Return how good probabilities are in runs."""
    told = [(regression.probabilities(one.features), one.lost) for one in seen]
    probabilities, lost = (np.concatenate(column) for column in zip(*told, strict=True))
    return Judgement(
        reliability(probabilities, lost),
        brier(probabilities, lost),
        brier(np.full(len(lost), lost.mean()), lost),
        roc(probabilities, lost),
        delays(told),
    )


def brier(probabilities: Floats, lost: Bools) -> float:
    """Return the mean squared difference of probabilities (L,) and outcomes (L,)."""
    return float(np.mean(np.square(probabilities - lost)))


def reliability(probabilities: Floats, lost: Bools) -> tuple[Bin, ...]:
    """Return the frames by their probability, without the bins that have none."""
    places = np.minimum((BINS * probabilities).astype(int), BINS - 1)
    inside = (places == place for place in range(BINS))
    return tuple(
        Bin(int(chosen.sum()), float(probabilities[chosen].mean()), float(lost[chosen].mean()))
        for chosen in inside
        if chosen.any()
    )


def roc(probabilities: Floats, lost: Bools) -> Roc:
    """Return what a threshold tells of the frames that are lost, and of those that are not."""
    order = np.argsort(-probabilities, kind="stable")
    # Those with the same probability come at once.
    last = np.append(np.diff(probabilities[order]) != 0.0, True)
    told = np.concatenate([[0], np.cumsum(lost[order])[last]])
    wrong = np.concatenate([[0], np.cumsum(~lost[order])[last]])
    if not told[-1] or not wrong[-1]:
        return Roc(np.zeros(0), np.zeros(0), float("nan"))
    told, wrong = told / told[-1], wrong / wrong[-1]
    return Roc(wrong, told, float(np.sum(np.diff(wrong) * (told[1:] + told[:-1]) / 2.0)))


def delays(runs: Sequence[tuple[Floats, Bools]]) -> Delays:
    """Return how soon the losses of runs were told, by the probabilities and outcomes of each."""
    found: list[int | None] = []
    for probabilities, lost in runs:
        edges = np.flatnonzero(np.diff(np.concatenate([[0], lost.astype(int), [0]])))
        for first, end in edges.reshape(-1, 2):
            if end - first >= LASTING:
                said = np.flatnonzero(probabilities[first:end] >= CERTAIN)
                found.append(int(said[0]) if len(said) else None)
    frames = tuple(one for one in found if one is not None)
    return Delays(len(found), len(frames), frames)


def loss_probabilities(pool: Pool) -> Findings:
    """Judge what every tracker declares in the scenes that are there for it."""
    scored = {}
    for name in EXPERIMENTS.own:
        declared = EXPERIMENTS[name].quality.loss_probability
        for tracker, model in declared.models.items():
            numbers = range(FIRST_JUDGED, FIRST_JUDGED + scenes_of(EXPERIMENTS[name]).judged)
            judged = judge(model.regression, pool.map(witness, cases(name, tracker, numbers, model.signals)))
            yield from _findings(judged, name, tracker)
            scored[name, tracker] = judged
        for tracker, error in declared.refused.items():
            why = "refused" if error > loss_probability.MOST_ERROR else "seldom"
            yield REFERENCES.not_run(why, name, tracker, error=error)
    pool.draw(lambda: draw_scores(scored))


def _findings(found: Judgement, *keys: str) -> Findings:
    """Return what is said of the probability of an experiment's tracker."""
    yield REFERENCES.judge("error", found.error, *keys)
    yield REFERENCES.judge("brier", found.brier, *keys, holds=found.brier < found.base)
    yield REFERENCES.judge("base", found.base, *keys)
    yield REFERENCES.judge("roc", found.roc.area, *keys)
    yield REFERENCES.judge("told", found.delays.share, *keys)
    yield REFERENCES.judge("delay", found.delays.median, *keys, holds=True)


def draw_scene(scenes: loss_probability.Scenes, number: int) -> dict[str, Value]:
    """Return the parameters of a scene, by its number."""
    shares = Stream(number, 0, Purpose.SCENE).random(len(scenes.ranges) + len(scenes.choices))
    drawn: dict[str, Value] = {}
    for share, (name, (low, high)) in zip(shares, scenes.ranges.items(), strict=False):
        if isinstance(low, int) and isinstance(high, int):
            drawn[name] = low + int(share * (high - low + 1))
        else:
            drawn[name] = round(low + float(share) * (high - low), 3)
    for share, (name, values) in zip(shares[len(scenes.ranges) :], scenes.choices.items(), strict=True):
        drawn[name] = values[int(share * len(values))]
    return drawn


def scenes_of(experiment: Experiment) -> loss_probability.Scenes:
    """Return the scenes on which the probabilities of an experiment are fitted and judged.

    Raises:
        ValueError: It has none.
    """
    if experiment.quality.loss_probability.scenes is None:
        raise ValueError(f"{experiment.id} has no scenes in which a loss probability is fitted")
    return experiment.quality.loss_probability.scenes
