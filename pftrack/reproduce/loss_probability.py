"""How true what trackers say of themselves is: their bands, and the probabilities that they have lost their target.

Bands of the pose are Bando's and the calibrated ones (docs/explanation/calibration.md). Seeds and people are others
than those on which the calibrated band was chosen. Bando states no coverage: what a band says of itself is the
reference.

Probabilities of a loss (docs/explanation/loss.md) are fitted on some scenes that are drawn at random, and judged here
on others: a tracker declares its probability where the expected calibration error in these is at most 0.05. No
publication has such figures of these trackers.

The figures are a small panel a tracker:

- Reliability: of the frames in which a probability is said, the share that are lost; a dot a bin, the larger the more
  frames it has, and all on the diagonal where the probability is true.
- Receiver operating characteristic: the share of the lost frames that a threshold tells, over the share of the others
  that it tells wrongly.
- Delays: the share of the losses that have been told so many frames after they began.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.model.parameters import Value, revise
from pftrack.experiments import EXPERIMENTS, find
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.head.parameters import AS_PUBLISHED
from pftrack.experiments.shared import loss_probability
from pftrack.experiments.shared.loss_probability import (
    FIRST_JUDGED,
    MOST_ERROR,
    Bin,
    Delays,
    Logistic,
    Past,
    Roc,
    Scenes,
    follow_features,
)
from pftrack.output.figures.style import CURVE_COLOURS, INK, LETTERS_PT, TWO_COLUMNS_IN, new_figure
from pftrack.reproduce.finding import Finding, References
from pftrack.reproduce.pool import Pool, begin, recipe, rows_of
from pftrack.runs.run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Scores: TypeAlias = tuple[Sequence[Bin], Roc, Delays]
"""Of a tracker: frames by their probability, what thresholds tell, and how soon losses were told."""

FIGURES = ("loss-reliability", "loss-roc", "loss-delays")

COLUMNS, HIGH_IN, FOOT_IN = 5, 1.5, 0.4
LAST_FRAME = 20
LARGEST_DOT, SMALLEST_DOT = 60.0, 4.0
LINE_PT, TITLE_PT = 1.3, 7


def draw_scores(found: Mapping[tuple[str, str], Scores]) -> "dict[str, Figure]":
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
        for panel, ((experiment, tracker), scores) in zip(panels, found.items(), strict=False):
            draw(panel, scores, CURVE_COLOURS[experiments.index(experiment) % len(CURVE_COLOURS)])
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


def _draw_reliability(panel: "Axes", scores: Scores, colour: str) -> None:
    bins, _, _ = scores
    shares = np.array([one.frames for one in bins]) / sum(one.frames for one in bins)
    said, lost = [one.probability for one in bins], [one.lost for one in bins]
    panel.plot([0, 1], [0, 1], color=INK["frame"], linewidth=LINE_PT, linestyle="dashed")
    panel.plot(said, lost, color=colour, linewidth=LINE_PT)
    panel.scatter(said, lost, s=np.maximum(LARGEST_DOT * np.sqrt(shares), SMALLEST_DOT), color=colour)


def _draw_roc(panel: "Axes", scores: Scores, colour: str) -> None:
    _, roc, _ = scores
    panel.plot([0, 1], [0, 1], color=INK["frame"], linewidth=LINE_PT, linestyle="dashed")
    panel.plot(roc.false_alarms, roc.told, color=colour, linewidth=LINE_PT)
    panel.text(1.0, 0.04, f"{roc.area:.3f}", fontsize=LETTERS_PT, ha="right")


def _draw_delays(panel: "Axes", scores: Scores, colour: str) -> None:
    _, _, delays = scores
    frames = np.arange(LAST_FRAME + 1)
    told = np.array([sum(one <= frame for one in delays.frames) for frame in frames]) / max(delays.losses, 1)
    panel.step(frames, told, where="post", color=colour, linewidth=LINE_PT)
    panel.text(LAST_FRAME, 0.04, f"{delays.losses} losses", fontsize=LETTERS_PT, ha="right")


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

    bins: tuple[loss_probability.Bin, ...]
    brier: float
    base: float
    roc: loss_probability.Roc
    delays: loss_probability.Delays

    @property
    def error(self) -> float:
        """Expected calibration error."""
        return loss_probability.calibration_error(self.bins)


def cases(experiment: str, tracker: str, numbers: Iterable[int], signals: tuple[str, ...]) -> list[Case]:
    """Return the runs of a tracker in some scenes."""
    return [Case(experiment, tracker, number, signals) for number in numbers]


def witness(case: Case) -> Witnessed:
    """Return what was seen in a run."""
    experiment = find(case.experiment)
    scenes, setup = scenes_of(experiment), experiment.simulate()
    drawn = scenes.draw(case.number)
    longest = setup.open_source(case.number, revise(setup.parameters, drawn)).frame_count or scenes.frames
    frames = min(scenes.frames, longest)
    run = begin(recipe(case.experiment, case.tracker, drawn, seed=case.number, frames=frames))
    run.finish()
    series = {one.name: one for one in experiment.trackers[case.tracker].series}
    _, features = follow_features(case.signals, series, Past(), run.diagnostics)
    verdicts = [row.lost for row in run.diagnostics[1:]]
    known = np.array([one is not None for one in verdicts])
    return Witnessed(features[known], np.array([one is True for one in verdicts])[known])


def judge(regression: Logistic, seen: Sequence[Witnessed]) -> Judgement:
    """Return how good probabilities are in runs."""
    told = [(regression.probabilities(one.features), one.lost) for one in seen]
    probabilities, lost = (np.concatenate(column) for column in zip(*told, strict=True))
    return Judgement(
        loss_probability.reliability(probabilities, lost),
        loss_probability.brier(probabilities, lost),
        loss_probability.brier(np.full(len(lost), lost.mean()), lost),
        loss_probability.roc(probabilities, lost),
        loss_probability.delays(told),
    )


def loss_probabilities(pool: Pool, full: bool) -> list[Finding]:
    """Judge what every tracker declares in the scenes that are there for it."""
    if not full:
        return [REFERENCES.not_run("too-few")]
    findings, scored = [], {}
    for name in EXPERIMENTS.own:
        declared = EXPERIMENTS[name].quality.loss_probability
        for tracker, model in declared.models.items():
            numbers = range(FIRST_JUDGED, FIRST_JUDGED + scenes_of(EXPERIMENTS[name]).judged)
            judged = judge(model.regression, pool.map(witness, cases(name, tracker, numbers, model.signals)))
            findings += _findings(judged, name, tracker)
            scored[name, tracker] = judged.bins, judged.roc, judged.delays
        for tracker, error in declared.refused.items():
            why = "refused" if error > MOST_ERROR else "seldom"
            findings.append(REFERENCES.not_run(why, name, tracker, error=error))
    pool.draw(lambda: draw_scores(scored))
    return findings


def _findings(found: Judgement, *keys: str) -> list[Finding]:
    """Return what is said of the probability of an experiment's tracker."""
    return [
        REFERENCES.judge("error", found.error, *keys),
        REFERENCES.judge("brier", found.brier, *keys, holds=found.brier < found.base),
        REFERENCES.judge("base", found.base, *keys),
        REFERENCES.judge("roc", found.roc.area, *keys),
        REFERENCES.judge("told", found.delays.share, *keys),
        REFERENCES.judge("delay", found.delays.median, *keys, holds=True),
    ]


def scenes_of(experiment: Experiment) -> Scenes:
    """Return the scenes on which the probabilities of an experiment are fitted and judged.

    Raises:
        ValueError: It has none.
    """
    if experiment.quality.loss_probability.scenes is None:
        raise ValueError(f"{experiment.id} has no scenes in which a loss probability is fitted")
    return experiment.quality.loss_probability.scenes


SHARES = {50: "within_50", 95: "within_95"}
PRISM_SEEDS = range(2000, 2020)
QUICK_SEEDS = 2
PEOPLE = range(300, 312)
HEAD_FRAMES, HEAD_SPEED = 600, 1.5
VIEWS: dict[str, dict[str, Value]] = {
    "affine": AS_PUBLISHED,
    "pinhole": {**AS_PUBLISHED, "upper_layer": "perspective"},
    "pinhole, relief": {"upper_layer": "perspective", "templates": "relief"},
}


def coverage(pool: Pool, full: bool) -> list[Finding]:
    """Coverage of both bands and the error of both estimates, the angles pooled: prisms, and in full heads as well."""
    findings = []
    seeds = PRISM_SEEDS if full else PRISM_SEEDS[:QUICK_SEEDS]
    for upper in ("affine", "perspective"):
        findings += _judge(pool, "prism", f"prism, {upper}", 625, [({"upper_layer": upper}, seed) for seed in seeds])
    for (view, values), face in product(VIEWS.items(), ("mean", "personal")) if full else ():
        # What Bando did has a face of its own.
        chosen: dict[str, Value] = {**values, "speed": HEAD_SPEED, "face_model": face}
        heads = [({**chosen, "person": person}, 0) for person in PEOPLE]
        findings += _judge(pool, "head", f"head, {face} face, {view}", HEAD_FRAMES, heads)
    return findings


def _judge(
    pool: Pool, experiment: str, name: str, frames: int, trials: Sequence[tuple[Mapping[str, Value], int]]
) -> list[Finding]:
    """Compare both bands with what they say, on values and seeds."""
    findings, errors = [], []
    runs = {
        band: [recipe(experiment, "pf-asd", {**it, "pose_band": band}, seed=seed, frames=frames) for it, seed in trials]
        for band in ("document", "calibrated")
    }
    for band, outcomes in pool.run_groups(_measure, runs).items():
        *shares, error = np.mean(outcomes, axis=0)
        errors.append(float(error))
        findings += REFERENCES.judge_all("band", dict(zip(SHARES, shares, strict=True)), name, band)
    return [*findings, REFERENCES.judge("band-error", errors[1] / errors[0], name)]


def _measure(run: Run) -> tuple[float, ...]:
    """Return the shares of frames and angles within both bands, and the mean error, degrees."""
    rows = rows_of(run)
    shares = (float(np.mean([row.series[name] for row in rows])) for name in SHARES.values())
    return *shares, float(np.mean([row.error for row in rows if row.error is not None]))
