"""Shimada 1997, chapter 2: the share of right poses of a hand from its silhouette, with one hypothesis and four.

Beside the table (docs/methods/hands.md) are its figures, and how much of a silhouette a step of a finger's angle
changes.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.geometry import fill
from pftrack.core.model.parameters import Value
from pftrack.experiments import find
from pftrack.experiments.hand.candidates import chain_rate
from pftrack.experiments.hand.shape import MODEL, joints, open_pose, parts
from pftrack.output.figures.style import CURVE_COLOURS, INK, explain_below, new_figure, write_title
from pftrack.reproduce.finding import Findings, References
from pftrack.reproduce.pool import Key, Pool, begin, recipe, rows_of, seeded
from pftrack.runs.run import Run
from pftrack.vision.rendering import render_beside

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REFERENCES = References(__file__)

Condition: TypeAlias = tuple[str, Mapping[str, Value]]
"""A tracker, and values of parameters that differ from the defaults."""


class Outcome(NamedTuple):
    """Results of a run, as means over its frames except the first.

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


def measure(run: Run) -> Outcome:
    """Return what came of a run."""
    rows = rows_of(run)
    said = run.experiment.measured.report(run.diagnostics) if run.experiment.measured.report else {}

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
"""Presets in which one hand is lost and four are not, with a frame that shows it."""


def right_figure(found: Mapping[tuple[str, int, str], Outcome]) -> "Figure":
    """Draw how often the best hand is right, and any that is kept, by both rankings, beside the reference's figures.

    Args:
        found: By motion, hands that are kept, and ranking.
    """
    figure, panels = new_figure(2.9, columns=len(MOTIONS), share="y")
    for panel, motion in zip(panels, MOTIONS, strict=True):
        for place, ranking in enumerate(("reference", "refined")):
            at = np.arange(len(WIDTHS)) + (place - 0.5) * BAR
            chosen = [found[motion, width, ranking] for width in WIDTHS]
            colour = CURVE_COLOURS[1 - place]
            panel.bar(at, [one.any for one in chosen], 0.9 * BAR, color=colour, alpha=0.35, label=f"any, {ranking}")
            panel.bar(at, [one.best for one in chosen], 0.9 * BAR, color=colour, label=f"best, {ranking}")
        marks = [REFERENCES.table("right")[motion][width]["best right"] for width in WIDTHS]
        panel.plot(
            np.arange(len(WIDTHS)) - 0.5 * BAR,
            marks,
            "_",
            color=INK["truth"],
            ms=18,
            label="reference implementation",
        )
        write_title(panel, motion)
        panel.set_xticks(np.arange(len(WIDTHS)), [f"{width} kept" for width in WIDTHS])
        panel.set_ylim(0.0, 1.0)
    panels[0].set_ylabel("share of the frames")
    explain_below(figure, panels[0], 3)
    return figure


def kept_figure() -> NDArray[np.uint8]:
    """Return a picture of the same frame with one hand kept (left) and with four, each with the hand in space."""
    pictures = []
    hand = find("hand")
    for width in WIDTHS:
        run = begin(recipe("hand", "beam", {"motion": "wrist", "beam_width": width}, seed=SEED))
        drawing = replace(hand.draw(run.seek(FRAME), run.diagnostics), caption="")
        pictures.append(render_beside(drawing, layers=hand.display.shown, scale=SCALE))
    return np.hstack(pictures)


# The integral of eq. 2.3, which sets the step of an angle, is compared with what becomes of the finger's own pixels
# when the angle is turned a little. It leaves out the disc at the finger's root, which is why it is a little low; the
# reference allows 20 %.

SCALE_PX, TURN_RAD = 312.0, 0.03
SIDE_PX = 1000
MIDDLE = 2
BENT = 0.3
"""Flexion of every joint: a straight finger that faces the camera hardly moves in the picture as it bends."""


def steps(pool: Pool, full: bool) -> Findings:
    """The rate of change of a middle finger's silhouette as it is spread and bent, facing the camera and turned."""
    del pool, full
    for view, turned in (("facing the camera", 0.0), ("turned by 1 rad", 1.0)):
        pose = open_pose((0.5 * SIDE_PX, 0.75 * SIDE_PX))
        pose[3] = turned
        pose[6 + 4 * MIDDLE : 9 + 4 * MIDDLE] = BENT
        for way, angle in (("spread", 5 + 4 * MIDDLE), ("bent", 6 + 4 * MIDDLE)):
            ratio = _predict(pose, angle) / _measure(pose, angle)
            yield REFERENCES.judge("step", ratio, way, view)


def _predict(pose: Floats, angle: int) -> float:
    """Return D of the middle finger for a turn of one angle, px^2/rad."""
    small, moved = 1e-6, pose.copy()
    moved[angle] += small
    before, after = (joints(one, SCALE_PX, MODEL)[MIDDLE] for one in (pose, moved))
    return float(chain_rate(before, (after - before) / small, SCALE_PX * MODEL.radii[MIDDLE, 3]))


def _measure(pose: Floats, angle: int) -> float:
    """Return the number of the finger's pixels that change with a turn, px^2/rad."""
    masks = []
    for sign in (-0.5, 0.5):
        moved = pose.copy()
        moved[angle] += sign * TURN_RAD
        corners, counts = parts(moved, SCALE_PX, MODEL)
        own = slice(2 + 3 * MIDDLE, 5 + 3 * MIDDLE)
        masks.append(fill(corners[own], counts[own], SIDE_PX, SIDE_PX))
    return float(np.count_nonzero(masks[0] != masks[1])) / TURN_RAD


# The reference figures are means over six held-out seeds, with a ranking and a scoring that are kept here as
# "reference"; with fewer seeds the allowance grows as the standard error does.

MOTIONS = "wrist", "bend", "occlusion"
SEEDS = range(100, 106)
"""Held out: no setting was chosen by them."""
FEW = 2
EQUAL_TIME = 100
"""Number of particles whose frame takes about as long as one of the beam."""
WIDTHS = 1, 4
RANKINGS = "reference", "refined"
SCORINGS = "reference", "points", "cells"
SCORED = {"reference": "reference", "refined": "points"}
"""Scoring that belongs to a ranking: that of the reference implementation, and that of the defaults."""
TERMS = {"whole silhouettes": "cover_term", "the straight wrist": "wrist_prior"}


def table(pool: Pool, full: bool) -> Findings:
    """Best right, any right, after backtracking and the tip error, by the reference's ranking and by ours."""
    rankings = RANKINGS if full else RANKINGS[:1]
    conditions = {
        (motion, width, ranking): (motion, _beam(width, ranking, scoring=SCORED[ranking]))
        for motion, width, ranking in product(MOTIONS, WIDTHS, rankings)
    }
    found = _means(pool, conditions, full=full)
    for motion, width in product(MOTIONS, WIDTHS):
        one = found[motion, width, "reference"]
        shares = {"best right": one.best, "any right": one.any, "right after backtracking": one.backtracked}
        yield REFERENCES.judge("tips", one.tips, motion, width, wider=_wider(full))
        yield from REFERENCES.judge_all("right", shares, motion, width, wider=_wider(full))
    if not full:
        return
    pool.draw(lambda: {"figure-hand-right": right_figure(found), "figure-hand-kept": kept_figure()})
    yield from _rankings(found)


def _rankings(found: dict[tuple[str, int, str], Outcome]) -> Findings:
    """Compare our ranking with the reference's on the same seeds, and four hands with one."""
    for width in WIDTHS:
        before, after = (mean([found[motion, width, name] for motion in MOTIONS]).best for name in RANKINGS)
        yield REFERENCES.judge("ranking", after, width, holds=after > before, before=before)
    for motion in MOTIONS:
        one, four = found[motion, 1, "refined"].any, found[motion, 4, "refined"].any
        yield REFERENCES.judge("any-of-four", four, motion, holds=four >= one, one=one)


def switches(pool: Pool, full: bool) -> Findings:
    """Four hands without the comparison of whole silhouettes, and without the prior of a straight wrist."""
    conditions = {
        (it, motion): (motion, _beam(4, "reference", scoring="reference", **{term: False}))
        for (it, term), motion in product(TERMS.items(), MOTIONS)
    }
    for key, one in _means(pool, conditions, full=full).items():
        shares = {"best right": one.best, "any right": one.any}
        yield from REFERENCES.judge_all("without", shares, *key, wider=_wider(full))


def scorings(pool: Pool, full: bool) -> Findings:
    """The sum over predictions, all joints and the test of reach, with cells and without, after the reference's way."""
    keys = list(product(RANKINGS, WIDTHS, SCORINGS))
    conditions = {(*key, motion): (motion, _beam(key[1], key[0], scoring=key[2])) for key in keys for motion in MOTIONS}
    found = _means(pool, conditions, full=full)
    best = {key: mean([found[*key, motion] for motion in MOTIONS]).best for key in keys}
    for width in WIDTHS:
        before, points, cells = (best["refined", width, scoring] for scoring in SCORINGS)
        yield REFERENCES.judge("sum-over-predictions", points, width, holds=points >= before, before=before)
        yield REFERENCES.judge("points", points, width, holds=points >= cells, cells=cells)
        before, points, cells = (best["reference", width, scoring] for scoring in SCORINGS)
        holds = cells > max(points, before)
        yield REFERENCES.judge("cells", cells, width, holds=holds, points=points, before=before)


def compare_with_particles(pool: Pool, full: bool) -> Findings:
    """The beam and a particle filter with the same likelihood, at equal time per frame."""
    beam, others = _beam(4, "refined"), ("particles", {"sample_count": EQUAL_TIME})
    conditions = {(kind[0], motion): (motion, kind) for kind in (beam, others) for motion in MOTIONS}
    found = _means(pool, conditions, full=full)
    beams, particles = ([found[kind[0], motion] for motion in MOTIONS] for kind in (beam, others))
    ratio = sum(one.frame_ms for one in particles) / sum(one.frame_ms for one in beams)
    yield from (
        REFERENCES.judge("beam", ours.best, motion, EQUAL_TIME, holds=ours.best > other.best, other=other.best)
        for motion, ours, other in zip(MOTIONS, beams, particles, strict=True)
    )
    yield REFERENCES.judge("time", ratio, EQUAL_TIME)


def _beam(width: int, ranking: str, **values: Value) -> Condition:
    return "beam", {"beam_width": width, "ranking": ranking, **values}


def _wider(full: bool) -> float:
    return 1.0 if full else math.sqrt(len(SEEDS) / FEW)


def _means(pool: Pool, conditions: Mapping[Key, tuple[str, Condition]], *, full: bool) -> dict[Key, Outcome]:
    """Return what came of each motion under its condition, the mean over the seeds."""
    groups = {
        key: seeded(recipe("hand", tracker, {"motion": motion, **values}), SEEDS if full else SEEDS[:FEW])
        for key, (motion, (tracker, values)) in conditions.items()
    }
    return {key: mean(outcomes) for key, outcomes in pool.run_groups(measure, groups).items()}
