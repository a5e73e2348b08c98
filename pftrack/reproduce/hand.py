"""Shimada 1997, chapter 2: how often the pose of a hand from its silhouette is right, with one hypothesis and four.

Beside the table (docs/methods/hands.md) are its figures, and how much of a silhouette a step of a finger's angle
changes.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.geometry.polygons import fill
from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.experiments.hand.candidates import chain_rate
from pftrack.experiments.hand.shape import MODEL, joints, open_pose, parts
from pftrack.output.figures.picture import save
from pftrack.output.figures.style import CURVE_COLOURS, INK, explain_below, new_figure, write_title
from pftrack.reproduce.finding import FEWER, PROTOCOL, Finding, Own, claim, compare, not_run
from pftrack.reproduce.pool import Pool
from pftrack.runs.run import Run
from pftrack.vision.rendering import png, render_beside

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Condition(NamedTuple):
    """A tracker with the values of parameters that differ from the defaults."""

    tracker: str
    values: tuple[tuple[str, Value], ...] = ()


class Case(NamedTuple):
    """A motion, a seed and a condition."""

    motion: str
    seed: int
    condition: Condition


class Outcome(NamedTuple):
    """What came of a run, as means over its frames but the first.

    Attributes:
        tips: Mean distance of the tips of the best hand, palm axes.
        palm: Largest error of its palm's angles, rad.
        flexion: Mean error of its flexions, rad.
        best: Share of the frames whose best hand is right.
        any: Share of those in which any hand that is kept is.
        backtracked: Share of those in which the hand from which the last best one comes is.
        frame_ms: Time that a frame took, the median.
    """

    tips: float
    palm: float
    flexion: float
    best: float
    any: float
    backtracked: float
    frame_ms: float


def follow(case: Case) -> Outcome:
    """Follow the hand of a case to the end of its motion."""
    hand = find("hand")
    values = {"motion": case.motion, **dict(case.condition.values)}
    run = Run(hand, hand.simulate(), tracker=case.condition.tracker, seed=case.seed, timeline=(Change(0, values),))
    run.finish()
    rows = run.diagnostics[1:]
    said = hand.report(run.diagnostics) if hand.report else {}

    def average(name: str) -> float:
        return float(np.mean([row.number(name) for row in rows]))

    return Outcome(
        average("tip_error"),
        average("palm_error_rad"),
        average("flexion_error_rad"),
        average("best_right"),
        average("any_right"),
        float(said.get("backtracked_right_share", np.nan)),
        float(np.median([row.step_ms for row in rows])),
    )


def mean(outcomes: list[Outcome]) -> Outcome:
    """Return the means over several runs."""
    return Outcome(*np.mean(outcomes, axis=0).tolist())


BAR = 0.38
SEED, FRAME, SCALE = 151, 24, 2.0
"""Of the presets in which one hand is lost and four are not, and a frame in which that is so."""


def right_figure(
    found: Mapping[tuple[str, int, str], Outcome], references: Mapping[tuple[str, int], Sequence[float]]
) -> "Figure":
    """Draw how often the best hand is right, and any that is kept, by both rankings, beside the reference's figures.

    Args:
        found: By motion, hands that are kept, and ranking.
        references: By motion and hands that are kept: tip error, best right, any right, right after backtracking.
    """
    motions = list(dict.fromkeys(motion for motion, _ in references))
    widths = sorted({width for _, width in references})
    figure, panels = new_figure(2.9, columns=len(motions), share="y")
    for panel, motion in zip(panels, motions, strict=True):
        for place, ranking in enumerate(("reference", "refined")):
            at = np.arange(len(widths)) + (place - 0.5) * BAR
            chosen = [found[motion, width, ranking] for width in widths]
            colour = CURVE_COLOURS[1 - place]
            panel.bar(at, [one.any for one in chosen], 0.9 * BAR, color=colour, alpha=0.35, label=f"any, {ranking}")
            panel.bar(at, [one.best for one in chosen], 0.9 * BAR, color=colour, label=f"best, {ranking}")
        marks = [references[motion, width][1] for width in widths]
        panel.plot(
            np.arange(len(widths)) - 0.5 * BAR,
            marks,
            "_",
            color=INK["truth"],
            ms=18,
            label="reference implementation",
        )
        write_title(panel, motion)
        panel.set_xticks(np.arange(len(widths)), [f"{width} kept" for width in widths])
        panel.set_ylim(0.0, 1.0)
    panels[0].set_ylabel("share of the frames")
    explain_below(figure, panels[0], 3)
    return figure


def kept_figure() -> bytes:
    """Return a picture of the same frame with one hand kept (left) and with four, each with the hand in space, PNG."""
    pictures: list[NDArray[np.uint8]] = []
    hand = find("hand")
    for width in (1, 4):
        values = {"motion": "wrist", "beam_width": width}
        run = Run(hand, hand.simulate(), tracker="beam", seed=SEED, timeline=(Change(0, values),))
        drawing = replace(hand.draw(run.seek(FRAME), run.diagnostics), caption="")
        pictures.append(render_beside(drawing, layers=hand.shown_layers, scale=SCALE))
    return png(np.hstack(pictures))


# The integral of eq. 2.3, which sets the step of an angle, is compared with what becomes of the finger's own pixels
# when the angle is turned a little. It leaves out the disc at the finger's root, which is why it is a little low; the
# reference allows 20 %.

SCALE_PX, TURN_RAD = 312.0, 0.03
SIDE_PX = 1000
SOURCE = "Shimada 1997, eq. 2.3; reference implementation"
MIDDLE = 2
BENT = 0.3
"""Of every joint of the finger: a straight one that faces the camera hardly moves in the picture as it bends."""


def steps(pool: Pool, full: bool) -> list[Finding]:
    """The rate of change of a middle finger's silhouette as it is spread and bent, facing the camera and turned."""
    del pool, full
    findings = []
    for view, turned in (("facing the camera", 0.0), ("turned by 1 rad", 1.0)):
        pose = open_pose((0.5 * SIDE_PX, 0.75 * SIDE_PX))
        pose[3] = turned
        pose[6 + 4 * MIDDLE : 9 + 4 * MIDDLE] = BENT
        for way, angle in (("spread", 5 + 4 * MIDDLE), ("bent", 6 + 4 * MIDDLE)):
            ratio = _predict(pose, angle) / _measure(pose, angle)
            what = f"hand: step of a finger that is {way}, {view}, predicted by measured change"
            findings.append(compare(what, ratio, 1.0, 0.2, SOURCE, ground=PROTOCOL))
    return findings


def _predict(pose: Floats, angle: int) -> float:
    """Return D of the middle finger for a turn of one angle, px^2/rad."""
    small, moved = 1e-6, pose.copy()
    moved[angle] += small
    before, after = (joints(one, SCALE_PX, MODEL)[MIDDLE] for one in (pose, moved))
    return float(chain_rate(before, (after - before) / small, SCALE_PX * MODEL.radii[MIDDLE, 3]))


def _measure(pose: Floats, angle: int) -> float:
    """Return how many of the finger's pixels come or go with a turn, px^2/rad."""
    masks = []
    for sign in (-0.5, 0.5):
        moved = pose.copy()
        moved[angle] += sign * TURN_RAD
        corners, counts = parts(moved, SCALE_PX, MODEL)
        own = slice(2 + 3 * MIDDLE, 5 + 3 * MIDDLE)
        masks.append(fill(corners[own], counts[own], SIDE_PX, SIDE_PX))
    return float(np.count_nonzero(masks[0] != masks[1])) / TURN_RAD


# The reference figures are means over six held-out seeds, with a ranking and a scoring that are kept here as
# "reference". Random numbers are others here, and so are the hands and the noise of a seed: fractions of six seeds each
# may differ by 0.15, tip errors by 0.03 palm axes; with fewer seeds the allowance grows as the standard error does.
# Some fractions are better than that, and it is known why (`WHY_BETTER`).

TABLE_SOURCE = "Shimada 1997, section 2.8; reference implementation"
OURS = Own("this project")
WHY_BETTER = (
    "the reference's wrist is off by some px from frame to frame, its tips by more than ours, and it begins to miss "
    "where we do not yet"
)
MOTIONS = "wrist", "bend", "occlusion"
SEEDS = range(100, 106)
"""Held out: no setting was chosen by them."""
FEW = 2
FRACTION, TIPS = 0.15, 0.03
EQUAL_TIME = 100
"""Particles of which a frame takes about as long as one of the beam."""
WIDTHS = 1, 4
RANKINGS = "reference", "refined"
SCORINGS = "reference", "points", "cells"
SCORED = {"reference": "reference", "refined": "points"}
"""Scoring that belongs to a ranking: that of the reference implementation, and that of the defaults."""

REFERENCE = {
    ("wrist", 1): (0.080, 0.55, 0.55, 0.55),
    ("wrist", 4): (0.081, 0.86, 0.96, 0.85),
    ("bend", 1): (0.114, 0.78, 0.78, 0.78),
    ("bend", 4): (0.120, 0.70, 0.86, 0.72),
    ("occlusion", 1): (0.135, 0.64, 0.64, 0.64),
    ("occlusion", 4): (0.113, 0.70, 0.88, 0.73),
}
"""By motion and hands that are kept: tip error, palm axes; best right, any right, right after backtracking."""

WITHOUT = {
    "whole silhouettes": ("cover_term", {"wrist": (0.71, 0.94), "bend": (0.80, 0.90), "occlusion": (0.79, 0.84)}),
    "the straight wrist": ("wrist_prior", {"wrist": (0.86, 0.97), "bend": (0.67, 0.81), "occlusion": (0.67, 0.88)}),
}
"""Best right and any right of four hands without a term."""


def table(pool: Pool, full: bool) -> list[Finding]:
    """Best right, any right, after backtracking and the tip error, by the reference's ranking and by ours."""
    seeds = _seeds(full)
    rankings = RANKINGS if full else RANKINGS[:1]
    keys = [(motion, width, ranking) for (motion, width), ranking in product(REFERENCE, rankings)]
    conditions = [(motion, _condition(width, ranking, scoring=SCORED[ranking])) for motion, width, ranking in keys]
    found = dict(zip(keys, _means(pool, conditions, seeds), strict=True))
    wider = math.sqrt(len(SEEDS) / len(seeds))
    findings: list[Finding] = []
    for (motion, width), references in REFERENCE.items():
        one = found[motion, width, "reference"]
        what = f"{motion}, {width} kept"
        tips, ground = f"hand: {what}, tip error, palm axes", PROTOCOL if full else FEWER
        findings.append(
            compare(
                tips,
                one.tips,
                references[0],
                TIPS * wider,
                TABLE_SOURCE,
                better="lower",
                reason=WHY_BETTER,
                ground=ground,
            )
        )
        for name, ours, reference in (
            ("best right", one.best, references[1]),
            ("any right", one.any, references[2]),
            ("right after backtracking", one.backtracked, references[3]),
        ):
            findings.append(_fraction(f"hand: {what}, {name}", ours, reference, FRACTION * wider))
    if pool.folder is not None and full:
        save(right_figure(found, REFERENCE), pool.folder / "figure-hand-right.png", "figure-hand-right")
        (pool.folder / "figure-hand-kept.png").write_bytes(kept_figure())
    return [*findings, *_rankings(found)] if full else findings


def _rankings(found: dict[tuple[str, int, str], Outcome]) -> list[Finding]:
    """Compare our ranking with the reference's on the same seeds, and four hands with one."""
    findings = []
    for width in WIDTHS:
        before, after = (mean([found[motion, width, name] for motion in MOTIONS]) for name in RANKINGS)
        statement = (
            f"hand: {width} kept, best right of all motions, by our ranking after the reference's ({before.best:.2f})"
        )
        findings.append(claim(statement, after.best, holds=after.best > before.best, source=OURS))
    for motion in MOTIONS:
        one, four = found[motion, 1, "refined"], found[motion, 4, "refined"]
        statement = f"hand: {motion}, any of four is right no less often than one alone ({one.any:.2f})"
        findings.append(claim(statement, four.any, holds=four.any >= one.any, source=TABLE_SOURCE))
    return findings


def switches(pool: Pool, full: bool) -> list[Finding]:
    """Four hands without the comparison of whole silhouettes, and without the prior of a straight wrist."""
    seeds = _seeds(full)
    keys = list(product(WITHOUT, MOTIONS))
    conditions = [
        (motion, _condition(4, "reference", scoring="reference", **{WITHOUT[what][0]: False})) for what, motion in keys
    ]
    allowed = FRACTION * math.sqrt(len(SEEDS) / len(seeds))
    findings = []
    for (what, motion), one in zip(keys, _means(pool, conditions, seeds), strict=True):
        for name, ours, reference in zip(
            ("best right", "any right"), (one.best, one.any), WITHOUT[what][1][motion], strict=True
        ):
            findings.append(_fraction(f"hand: without {what}, {motion}, {name}", ours, reference, allowed))
    return findings


def scorings(pool: Pool, full: bool) -> list[Finding]:
    """The sum over predictions, all joints and the test of reach, with cells and without, after the reference's way."""
    if not full:
        return [not_run("hand-scoring", "two seeds do not tell one scoring from another")]
    keys = [(ranking, width, scoring) for ranking, width, scoring in product(RANKINGS, WIDTHS, SCORINGS)]
    conditions = [
        (motion, _condition(width, ranking, scoring=scoring)) for ranking, width, scoring in keys for motion in MOTIONS
    ]
    found = _means(pool, conditions, _seeds(full))
    of_all = {key: mean(found[len(MOTIONS) * n : len(MOTIONS) * (n + 1)]) for n, key in enumerate(keys)}
    findings = []
    for width in WIDTHS:
        before, points, cells = (of_all["refined", width, scoring].best for scoring in SCORINGS)
        what = f"hand: refined, {width} kept, best right of all motions"
        statement = f"{what}, with the sum over predictions, all joints and reach, after without ({before:.2f})"
        findings.append(claim(statement, points, holds=points >= before, source=OURS))
        statement = f"{what}, as points, no less than as cells of eq. 2.9 ({cells:.2f})"
        findings.append(claim(statement, points, holds=points >= cells, source=OURS))
        before, points, cells = (of_all["reference", width, scoring].best for scoring in SCORINGS)
        what = f"hand: as the steps left them, {width} kept, best right of all motions"
        statement = f"{what}, as cells of eq. 2.9, more than as points ({points:.2f}) or without either ({before:.2f})"
        findings.append(claim(statement, cells, holds=cells > max(points, before), source=OURS))
    return findings


def compare_with_particles(pool: Pool, full: bool) -> list[Finding]:
    """The beam beside a particle filter with the same likelihood, at equal time a frame."""
    if not full:
        return [not_run("hand-particles", "two seeds do not tell the beam from the particles")]
    seeds = _seeds(full)
    beam, particles = _condition(4, "refined"), Condition("particles", (("sample_count", EQUAL_TIME),))
    found = _means(pool, [(motion, one) for motion in MOTIONS for one in (beam, particles)], seeds)
    findings = []
    for motion, ours, other in zip(MOTIONS, found[::2], found[1::2], strict=True):
        statement = f"hand: {motion}, best right by the beam and by {EQUAL_TIME} particles ({other.best:.2f})"
        findings.append(claim(statement, ours.best, holds=ours.best > other.best, source=OURS))
    ratio = sum(one.frame_ms for one in found[1::2]) / sum(one.frame_ms for one in found[::2])
    statement = f"hand: time of a frame with {EQUAL_TIME} particles, by that of the beam"
    return [*findings, claim(statement, ratio, holds=0.5 < ratio < 2.0, source=OURS, timed=True)]


def _fraction(what: str, ours: float, reference: float, tolerance: float) -> Finding:
    """Compare a share of right hands."""
    ground = FEWER if tolerance > FRACTION else PROTOCOL
    return compare(what, ours, reference, tolerance, TABLE_SOURCE, better="higher", reason=WHY_BETTER, ground=ground)


def _condition(width: int, ranking: str, **values: Value) -> Condition:
    return Condition("beam", (("beam_width", width), ("ranking", ranking), *values.items()))


def _seeds(full: bool) -> list[int]:
    return list(SEEDS if full else SEEDS[:FEW])


def _means(pool: Pool, conditions: Sequence[tuple[str, Condition]], seeds: Sequence[int]) -> list[Outcome]:
    """Return what came of each motion under its condition, the mean over the seeds."""
    outcomes = pool.map(follow, [Case(motion, seed, one) for motion, one in conditions for seed in seeds])
    return [mean(outcomes[start : start + len(seeds)]) for start in range(0, len(outcomes), len(seeds))]
