"""The likelihood of parts and whole hands, and the assignment of fingers to protrusions."""

from itertools import product

import numpy as np
import pytest

from pftrack.core.arrays import Floats
from pftrack.core.geometry import convex_hull, fill
from pftrack.experiments.hand import likelihood
from pftrack.experiments.hand.beams import differences, improve, log_score
from pftrack.experiments.hand.candidates import HIDDEN, assign, half_steps
from pftrack.experiments.hand.fingers import features_in
from pftrack.experiments.hand.likelihood import NODES, PictureTables, axis_distances, cell_log_fit, tip_distances, x_p
from pftrack.experiments.hand.model import JOINT_COST, HandTrackerParameters, Predictions, Task, settings
from pftrack.experiments.hand.shape import MODEL, joints, open_pose, palm_points, silhouette
from pftrack.experiments.hand.silhouette import Finding, Silhouette
from tests.experiments.hand.seen import SCALE, SIDE, axis, sight

TASK = Task(SCALE, MODEL, settings(HandTrackerParameters(), SCALE))
CELLS = TASK._replace(settings=TASK.settings._replace(cells=True))
POSE = open_pose((100.0, 137.0))
POSE[3] = 0.4
EXPECTED = Predictions(POSE[None], np.zeros(1))
NO_MOVES = np.empty((0, 4, 2))
INDEX, MIDDLE, TIP = 1, 2, 3


def palm_misfit(pose: Floats, seen: PictureTables) -> float:
    return x_p(convex_hull(palm_points(pose, SCALE, MODEL)), seen, SCALE)


def fit(
    places: Floats,
    protrusion: int,
    seen: PictureTables,
    least: float = -np.inf,
    *,
    finger: int = MIDDLE,
    task: Task = TASK,
    moves: Floats = NO_MOVES,
) -> float:
    radii = MODEL.radii[finger]
    return likelihood.finger_fit(places, moves, np.empty(0), radii, protrusion, seen, task, least)


def test_x_p_is_the_area_outside_by_the_contour_inside() -> None:
    """A count in a drawn mask gives the same."""
    seen, moved = sight(POSE), POSE.copy()
    moved[0] += 6.0
    hull = convex_hull(palm_points(moved, SCALE, MODEL))
    drawn = fill(hull[None], np.array([len(hull)]), SIDE, SIDE)
    outside = np.count_nonzero(drawn & ~seen.silhouette)
    touching = np.count_nonzero(drawn & likelihood.contour_of(seen.silhouette))
    assert palm_misfit(moved, seen) == pytest.approx(50.0 * outside / (SCALE * touching))
    assert outside > 50
    assert palm_misfit(POSE, seen) == 0.0


def test_a_finger_is_scored_by_its_protrusion() -> None:
    """Along it the score is 0, 3.5 px beside it half less; a hidden tip or finger costs its price.

    A hidden finger outside the silhouette costs more.
    """
    seen, places = sight(POSE, fingers=(MIDDLE,)), joints(POSE, SCALE, MODEL)[MIDDLE]
    assert fit(places, HIDDEN, sight(POSE)) == pytest.approx(-2.0, abs=0.05)
    assert fit(places - (0.0, 40.0, 0.0), HIDDEN, sight(POSE)) < -10.0
    beside = places + np.array([3.5, 0.0, 0.0])
    assert fit(places, 0, seen) == pytest.approx(0.0, abs=1e-3)
    assert fit(beside, 0, seen) == pytest.approx(-0.5, abs=1e-3)
    assert fit(beside, 0, seen, -0.4) == -np.inf
    assert -1.7 < fit(places, 0, seen._replace(axes=seen.axes[:, 11:], lengths=seen.lengths - 11)) <= -1.5


def test_moving_uphill_improves_the_fit() -> None:
    """The returned score is that of the whole pose, though fingers are drawn one by one."""
    seen, assignment, begin = sight(POSE), np.arange(5), POSE.copy()
    begin[[0, 3, 5, 10, 11, 12]] += 2.0, -0.2, 0.1, 0.2, 0.2, 0.2
    pose, score = improve(begin, 0, EXPECTED, assignment, seen, TASK)
    own, first, true = (log_score(each, 0, EXPECTED, assignment, seen, TASK) for each in (pose, begin, POSE))
    assert score == pytest.approx(own, abs=1e-9)
    assert first + 10.0 < score <= true + 1e-9
    before, after = differences(np.array([begin, pose]), seen, TASK)
    assert after < 0.3 * before


def test_a_protrusion_may_end_at_the_middle_joint() -> None:
    """The bent finger then costs little more than a hidden tip; if only the last joint may be the end, it is far off.

    A protrusion may end at any joint (Shimada 1997, section 2.6.3).
    """
    pose = open_pose((100.0, 137.0))
    pose[10:13] = 0.3, 1.75, 1.0  # the index finger is bent back from its middle joint, which is all that is seen of it
    mask = silhouette(pose, SCALE, MODEL, (SIDE, SIDE))
    found = features_in(Silhouette(mask, 1, Finding.CLEAR)).protrusions
    seen, places = likelihood.tables_of(mask, [each.axis for each in found]), joints(pose, SCALE, MODEL)[INDEX]
    assert len(seen.lengths) == 5
    apart = np.hypot(*(seen.axes[:, 0, None] - places[:, :2]).transpose(2, 0, 1))
    nearest = int(apart[:, 1].argmin())
    assert apart[nearest, 1] < 3.0
    assert apart[nearest, TIP] > 10.0
    by_any, by_last = (
        fit(places, nearest, seen, finger=INDEX, task=TASK._replace(settings=TASK.settings._replace(reference=last)))
        for last in (False, True)
    )
    assert by_any == pytest.approx(-JOINT_COST, abs=0.8)
    assert by_any > by_last + 1.0


# The likelihood of a cell of poses: eq. 2.9 against integrals, measures against drawn hands.

BENT = open_pose((100.0, 137.0))
BENT[3], BENT[6:9], BENT[10:13] = 0.3, 0.4, 0.6
HALVES = half_steps(BENT, CELLS)


def turned(pose: Floats, finger: int, steps: Floats) -> Floats:
    """Return a pose that is some half steps (5,) away in the cell of a finger."""
    moved, at = pose.copy(), 5 + 4 * finger
    moved[2:5] += steps[:3] * HALVES[finger, :3]
    moved[at] += steps[3] * HALVES[finger, 3]
    moved[at + 1 : at + 4] += steps[4] * HALVES[finger, 4]
    return moved


def moves_of(finger: int) -> Floats:
    """Return the displacements (5, 4, 2) of a finger."""
    spread, flexed = (
        np.array([joints(turned(BENT, f, one), SCALE, MODEL)[f] for f in range(5)]) for one in np.eye(5)[3:]
    )
    places = joints(BENT, SCALE, MODEL)
    return likelihood.displacements(BENT, places, spread, flexed, HALVES[0, :3], SCALE, MODEL.side)[finger]


@pytest.mark.parametrize("sd", [1.0, 2.5])
def test_the_mean_over_a_cell_is_the_integral_of_eq_2_9(sd: float) -> None:
    """It agrees with 100,000 points of the five angles, from 0 to beyond the farthest measure; no term is above 0."""
    moves = moves_of(MIDDLE)
    fine = np.random.default_rng(0).uniform(-1.0, 1.0, (100_000, 5))
    distances = np.hypot(*np.tensordot(fine, moves[:, TIP], axes=1).T)
    for measure in np.linspace(0.0, likelihood.farthest(moves, TIP), 7):
        integral = np.exp(-0.5 * np.square((measure - distances) / sd)).mean()
        found = cell_log_fit(measure**2, tip_distances(moves, TIP), sd)
        assert np.exp(found) == pytest.approx(integral, abs=0.02)
        assert found <= 0.0


@pytest.mark.parametrize("finger", [0, 1, MIDDLE])
def test_tips_and_axes_move_as_those_of_poses_in_the_cell(finger: int) -> None:
    """They agree to 1.5 px or a tenth with poses between the middle of the cell and its corners."""
    places, moves = joints(BENT, SCALE, MODEL)[finger], moves_of(finger)
    own = axis(places)
    tips, axes = tip_distances(moves, TIP), axis_distances(moves, places, TIP, len(own) - 1.0)
    for n in range(0, len(NODES), 4):
        there = joints(turned(BENT, finger, NODES[n]), SCALE, MODEL)[finger]
        assert tips[n] == pytest.approx(np.hypot(*(there - places)[TIP, :2]), rel=0.1, abs=1.5)
        other = axis(there)
        count = min(len(own), len(other))
        apart = (other[:count] - other[0]) - (own[:count] - own[0])
        assert axes[n] == pytest.approx(np.hypot(*apart.T).mean(), rel=0.1, abs=0.5)


def test_palms_of_a_cell_have_interpolated_misfits() -> None:
    """They are interpolated between half steps to either side; a finger before the palm has hardly any."""
    pose = BENT.copy()
    pose[14:17] = 1.3  # the middle finger is folded
    drawn = likelihood.tables_of(silhouette(pose, SCALE, MODEL, (SIDE, SIDE)), [])
    (found,) = likelihood.ideals_of(pose[None], drawn, CELLS)
    ways = np.zeros((3, 2))
    for i, way in np.ndindex(3, 2):
        moved = pose.copy()
        moved[2 + i] += (2 * way - 1) * half_steps(pose, CELLS)[0, i]
        ways[i, way] = palm_misfit(moved, drawn)
    expected = [sum(abs(node[i]) * ways[i, int(node[i] > 0.0)] for i in range(3)) for node in NODES]
    assert found[0] == pytest.approx(expected)
    assert 0.0 < found[0].max() < 1.0
    assert found[1 + MIDDLE].max() < 0.5 * found[2].max()
    assert likelihood.ideals_of(pose[None], drawn, TASK).size == 0


@pytest.mark.parametrize("off", [0.0, 2.0, 5.0])
def test_a_finger_beside_its_candidate_is_weighed_over_the_cell(off: float) -> None:
    """Tip and axis count, and a score just above the least of interest is still returned."""
    places, moves = joints(BENT, SCALE, MODEL)[MIDDLE], moves_of(MIDDLE)
    seen_axis = axis(places) + np.array([off, 0.0])
    seen = sight(BENT, seen_axis, fingers=())
    along = axis_distances(moves, places, TIP, len(seen_axis) - 1.0)
    wanted = cell_log_fit(off**2, tip_distances(moves, TIP), CELLS.settings.tip_sd)
    wanted += cell_log_fit(0.0, along, CELLS.settings.axis_sd)
    for least in (-np.inf, wanted - 1e-3):
        found = fit(places, 0, seen, least, task=CELLS, moves=moves)
        assert found == pytest.approx(wanted, abs=1e-2)
    alone = fit(places, 0, seen, task=CELLS)
    assert alone == pytest.approx(-0.5 * (off / CELLS.settings.tip_sd) ** 2, abs=1e-3)
    assert abs(found - alone) > 0.05


# Which finger is which protrusion.


def by_trying_all(scores: Floats, costs: Floats) -> float:
    """Return the best sum over all ways of giving each finger a protrusion or none."""
    best = -np.inf
    for way in product(range(-1, len(costs)), repeat=len(scores)):
        taken = [p for p in way if p >= 0]
        if len(taken) == len(set(taken)):
            best = max(best, scores[np.arange(len(scores)), way].sum() - np.delete(costs, taken).sum())
    return best


@pytest.mark.parametrize("protrusions", range(5))
def test_it_is_the_best_of_all_ways(protrusions: int) -> None:
    """The table over sets finds the best of all assignments, with its score."""
    draw = np.random.default_rng(protrusions)
    for _ in range(3):
        scores = draw.normal(-5.0, 5.0, (5, protrusions + 1))
        scores[draw.random(scores.shape) < 0.2] = -np.inf
        scores[:, -1] = draw.normal(-5.0, 5.0, 5)
        costs = draw.uniform(0.0, 30.0, protrusions)
        score, chosen = assign(scores, costs)
        assert score == pytest.approx(by_trying_all(scores, costs))
        taken = chosen[chosen != HIDDEN]
        assert len(set(taken)) == len(taken)
        said = scores[np.arange(5), chosen].sum() - np.delete(costs, taken).sum()
        assert said == pytest.approx(score)
