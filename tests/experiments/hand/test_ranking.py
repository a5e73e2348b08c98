"""How parts and wholes are compared with a silhouette, moved nearer to it, and given its protrusions."""

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import convex_hull, fill
from pftrack.experiments.hand.beams import differences, improve, log_score
from pftrack.experiments.hand.candidates import HIDDEN, MOST_PROTRUSIONS, assign, half_steps
from pftrack.experiments.hand.fingers import features_in
from pftrack.experiments.hand.likelihood import (
    NODES,
    PictureTables,
    axis_distances,
    cell_log_fit,
    contour_of,
    displacements,
    farthest,
    finger_fit,
    ideals_of,
    tables_of,
    tip_distances,
    x_p,
)
from pftrack.experiments.hand.model import JOINT_COST, HandTrackerParameters, Predictions, Task, settings
from pftrack.experiments.hand.shape import MODEL, joints, open_pose, palm_points, silhouette
from pftrack.experiments.hand.silhouette import Finding, Silhouette
from tests.experiments.hand.seen import SCALE, SIDE, sight

TASK = Task(SCALE, MODEL, settings(HandTrackerParameters(), SCALE))
POSE = open_pose((100.0, 137.0))
POSE[3] = 0.4
EXPECTED = Predictions(POSE[None], np.zeros(1))
NO_MOVES, NO_IDEALS = np.empty((0, 4, 2)), np.empty(0)


def test_x_p_is_the_area_outside_by_the_contour_inside() -> None:
    """Counted in a drawn mask it is the same."""
    seen = sight(POSE)
    moved = POSE.copy()
    moved[0] += 6.0
    hull = convex_hull(palm_points(moved, SCALE, MODEL))
    drawn = fill(hull[None], np.array([len(hull)]), SIDE, SIDE)
    outside = np.count_nonzero(drawn & ~seen.silhouette)
    touching = np.count_nonzero(drawn & contour_of(seen.silhouette))
    assert x_p(hull, seen, SCALE) == pytest.approx(50.0 * outside / (SCALE * touching))
    assert outside > 50
    assert x_p(convex_hull(palm_points(POSE, SCALE, MODEL)), seen, SCALE) == 0.0


def test_a_finger_along_its_protrusion_fits_wholly() -> None:
    """One that ends 3.5 px beside it loses half, and one whose tip is hidden pays for that alone."""
    seen, places = sight(POSE, fingers=(2,)), joints(POSE, SCALE, MODEL)[2]
    radii = MODEL.radii[2]
    assert finger_fit(places, NO_MOVES, NO_IDEALS, radii, 0, seen, TASK, -np.inf) == pytest.approx(0.0, abs=1e-3)
    beside = places + np.array([3.5, 0.0, 0.0])
    assert finger_fit(beside, NO_MOVES, NO_IDEALS, radii, 0, seen, TASK, -np.inf) == pytest.approx(-0.5, abs=1e-3)
    assert finger_fit(beside, NO_MOVES, NO_IDEALS, radii, 0, seen, TASK, -0.4) == -np.inf
    from_joint = seen._replace(axes=seen.axes[:, 11:], lengths=seen.lengths - 11)
    assert -1.7 < finger_fit(places, NO_MOVES, NO_IDEALS, radii, 0, from_joint, TASK, -np.inf) <= -1.5


def test_a_hidden_finger_within_the_silhouette_pays_its_price_only() -> None:
    """Outside it pays for sticking out as well."""
    seen, places = sight(POSE), joints(POSE, SCALE, MODEL)[2]
    assert finger_fit(places, NO_MOVES, NO_IDEALS, MODEL.radii[2], HIDDEN, seen, TASK, -np.inf) == pytest.approx(
        -2.0, abs=0.05
    )
    assert (
        finger_fit(places - (0.0, 40.0, 0.0), NO_MOVES, NO_IDEALS, MODEL.radii[2], HIDDEN, seen, TASK, -np.inf) < -10.0
    )


def test_moving_uphill_mends_a_pose_that_is_beside() -> None:
    """The score that is returned is that of the pose, though fingers were drawn by themselves; the fit gets better."""
    seen, assignment = sight(POSE), np.arange(5)
    begin = POSE.copy()
    begin[[0, 3, 5, 10, 11, 12]] += 2.0, -0.2, 0.1, 0.2, 0.2, 0.2
    pose, score = improve(begin, 0, EXPECTED, assignment, seen, TASK)
    assert score == pytest.approx(log_score(pose, 0, EXPECTED, assignment, seen, TASK), abs=1e-9)
    assert score > log_score(begin, 0, EXPECTED, assignment, seen, TASK) + 10.0
    before, after = differences(np.array([begin, pose]), seen, TASK)
    assert after < 0.3 * before
    assert score <= log_score(POSE, 0, EXPECTED, assignment, seen, TASK) + 1e-9


# Fingers whose tips are hidden: a protrusion may end at any joint (Shimada 1997, section 2.6.3).

ENDS_SCALE, ENDS_SIDE = 52.0, 200
INDEX, TIP = 1, 3


def half_hidden() -> NDArray[np.float64]:
    """Return a pose whose index finger is bent back from its middle joint, which is all that is seen of it."""
    pose = open_pose((100.0, 137.0))
    pose[10:13] = 0.3, 1.75, 1.0
    return pose


def seen_of(pose: NDArray[np.float64]) -> PictureTables:
    mask = silhouette(pose, ENDS_SCALE, MODEL, (ENDS_SIDE, ENDS_SIDE))
    found = features_in(Silhouette(mask, 1, Finding.CLEAR))
    return tables_of(mask, [each.axis for each in found.protrusions])


def test_a_finger_of_which_the_middle_joint_is_seen_fits_its_protrusion() -> None:
    """With all joints as ends it pays the price of a hidden tip and little more; with the last one it is far off."""
    pose, task = half_hidden(), Task(ENDS_SCALE, MODEL, settings(HandTrackerParameters(), ENDS_SCALE))
    seen, places = seen_of(pose), joints(pose, ENDS_SCALE, MODEL)[INDEX]
    assert len(seen.lengths) == 5
    ends = seen.axes[:, 0]
    nearest = int(np.argmin(np.hypot(*(ends - places[1, :2]).T)))
    assert np.hypot(*(ends[nearest] - places[1, :2])) < 3.0
    assert np.hypot(*(ends[nearest] - places[TIP, :2])) > 10.0
    fits = {
        reference: finger_fit(
            places,
            NO_MOVES,
            NO_IDEALS,
            MODEL.radii[INDEX],
            nearest,
            seen,
            task._replace(settings=task.settings._replace(reference=reference)),
            -np.inf,
        )
        for reference in (False, True)
    }
    assert fits[False] == pytest.approx(-JOINT_COST, abs=0.8)
    assert fits[False] > fits[True] + 1.0


# The likelihood of a hand that stands for a cell of poses: eq. 2.9 against integrals, measures against drawn hands.

CELLS_SCALE, CELLS_SIDE = 52.0, 200
CELLS_TASK = Task(CELLS_SCALE, MODEL, settings(HandTrackerParameters(), CELLS_SCALE)._replace(cells=True))
CELLS_POSE = open_pose((100.0, 137.0))
CELLS_POSE[3], CELLS_POSE[6:9], CELLS_POSE[10:13] = 0.3, 0.4, 0.6
HALVES = half_steps(CELLS_POSE, CELLS_TASK)
MIDDLE, CELLS_TIP = 2, 3


def turned(pose: NDArray[np.float64], finger: int, steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a pose that is some half steps (5,) away in the cell of a finger."""
    moved, at = pose.copy(), 5 + 4 * finger
    moved[2:5] += steps[:3] * HALVES[finger, :3]
    moved[at] += steps[3] * HALVES[finger, 3]
    moved[at + 1 : at + 4] += steps[4] * HALVES[finger, 4]
    return moved


def moves_of(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the displacements (5, 5, 4, 2) of all fingers of a pose."""
    spread, flexed = (
        np.array([joints(turned(pose, f, one), CELLS_SCALE, MODEL)[f] for f in range(5)]) for one in np.eye(5)[3:]
    )
    return displacements(pose, joints(pose, CELLS_SCALE, MODEL), spread, flexed, HALVES[0, :3], CELLS_SCALE, MODEL.side)


def axis(places: NDArray[np.float64], end: int = CELLS_TIP) -> NDArray[np.float64]:
    """Return points 1 px apart along a finger, from one of its joints on."""
    back = places[end::-1, :2]
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(back, axis=0).T))])
    return np.column_stack([np.interp(np.arange(along[-1]), along, back[:, i]) for i in range(2)])


@pytest.mark.parametrize("sd", [1.0, 2.5])
def test_the_mean_over_a_cell_is_the_integral_of_eq_2_9(sd: float) -> None:
    """Against 100,000 points of the five angles, from a measure of 0 to beyond the farthest; no term is above 0."""
    moves = moves_of(CELLS_POSE)[MIDDLE]
    fine = np.random.default_rng(0).uniform(-1.0, 1.0, (100_000, 5))
    distances = np.hypot(*np.tensordot(fine, moves[:, CELLS_TIP], axes=1).T)
    for measure in np.linspace(0.0, farthest(moves, CELLS_TIP), 7):
        integral = np.exp(-0.5 * np.square((measure - distances) / sd)).mean()
        found = cell_log_fit(measure**2, tip_distances(moves, CELLS_TIP), sd)
        assert np.exp(found) == pytest.approx(integral, abs=0.02)
        assert found <= 0.0


def test_a_hand_that_stands_for_no_cell_has_a_gaussian_alone() -> None:
    """And so has a cell in which nothing moves."""
    none = np.empty((0, 4, 2))
    assert len(tip_distances(none, CELLS_TIP)) == len(axis_distances(none, np.zeros((4, 2)), CELLS_TIP, 9.0)) == 0
    assert farthest(none, CELLS_TIP) == 0.0
    assert cell_log_fit(9.0, np.empty(0), 1.5) == -2.0
    assert cell_log_fit(9.0, tip_distances(np.zeros((5, 4, 2)), CELLS_TIP), 1.5) == pytest.approx(-2.0)


@pytest.mark.parametrize("finger", [0, 1, MIDDLE])
def test_tips_and_axes_go_evenly_as_those_of_poses_in_the_cell(finger: int) -> None:
    """Within a px or a tenth of those of poses between the middle of the cell and its corners."""
    places = joints(CELLS_POSE, CELLS_SCALE, MODEL)[finger]
    moves = moves_of(CELLS_POSE)[finger]
    length = len(axis(places)) - 1.0
    tips, axes = tip_distances(moves, CELLS_TIP), axis_distances(moves, places, CELLS_TIP, length)
    for n in range(0, len(NODES), 4):
        there = joints(turned(CELLS_POSE, finger, NODES[n]), CELLS_SCALE, MODEL)[finger]
        assert tips[n] == pytest.approx(np.hypot(*(there - places)[CELLS_TIP, :2]), rel=0.1, abs=1.5)
        own, other = axis(places), axis(there)
        count = min(len(own), len(other))
        apart = (other[:count] - other[0]) - (own[:count] - own[0])
        assert axes[n] == pytest.approx(np.hypot(*apart.T).mean(), rel=0.1, abs=0.5)


def test_an_axis_is_compared_as_far_as_it_is_explained() -> None:
    """A turn about the tip moves a point as far as it is away, so the mean is half that of the end."""
    places = np.array([[0.0, 0.0], [10.0, 0.0], [25.0, 0.0], [40.0, 0.0]])
    moves = np.zeros((5, 4, 2))
    moves[0, :, 1] = 0.1 * (40.0 - places[:, 0])
    for length in (40.0, 20.0, 7.0):
        found = axis_distances(moves, places, CELLS_TIP, length)
        assert found == pytest.approx(0.05 * length * np.abs(NODES[:, 0]))
    assert (axis_distances(moves, places, 2, 25.0) < axis_distances(moves, places, CELLS_TIP, 40.0) + 1e-9).all()


def test_palms_of_a_cell_stick_out_of_the_drawn_hand_by_what_is_measured_there() -> None:
    """Interpolated between half a step either way; a finger before the palm sticks out of nothing."""
    pose = CELLS_POSE.copy()
    pose[14:17] = 1.3  # the middle finger is folded
    drawn = tables_of(silhouette(pose, CELLS_SCALE, MODEL, (CELLS_SIDE, CELLS_SIDE)), [])
    (found,) = ideals_of(pose[None], drawn, CELLS_TASK)
    steps = half_steps(pose, CELLS_TASK)[0]
    ways = np.zeros((3, 2))
    for i in range(3):
        for way, sign in enumerate((-1.0, 1.0)):
            moved = pose.copy()
            moved[2 + i] += sign * steps[i]
            ways[i, way] = x_p(convex_hull(palm_points(moved, CELLS_SCALE, MODEL)), drawn, CELLS_SCALE)
    expected = [sum(abs(node[i]) * ways[i, int(node[i] > 0.0)] for i in range(3)) for node in NODES]
    assert found[0] == pytest.approx(expected)
    assert 0.0 < found[0].max() < 1.0
    assert found[1 + MIDDLE].max() < 0.5 * found[2].max()
    assert (
        ideals_of(pose[None], drawn, CELLS_TASK._replace(settings=CELLS_TASK.settings._replace(cells=False))).size == 0
    )


@pytest.mark.parametrize("off", [0.0, 2.0, 5.0])
def test_a_finger_that_is_seen_beside_its_candidate_is_weighed_over_the_cell(off: float) -> None:
    """By its tip and by its axis; and a score is not given up that is just above what is of interest."""
    places, moves = joints(CELLS_POSE, CELLS_SCALE, MODEL)[MIDDLE], moves_of(CELLS_POSE)[MIDDLE]
    seen_axis = axis(places) + np.array([off, 0.0])
    seen = tables_of(silhouette(CELLS_POSE, CELLS_SCALE, MODEL, (CELLS_SIDE, CELLS_SIDE)), [seen_axis])
    length = len(seen_axis) - 1.0
    wanted = cell_log_fit(off**2, tip_distances(moves, CELLS_TIP), CELLS_TASK.settings.tip_sd)
    wanted += cell_log_fit(0.0, axis_distances(moves, places, CELLS_TIP, length), CELLS_TASK.settings.axis_sd)
    for least in (-np.inf, wanted - 1e-3):
        found = finger_fit(places, moves, np.empty(0), MODEL.radii[MIDDLE], 0, seen, CELLS_TASK, least)
        assert found == pytest.approx(wanted, abs=1e-2)
    alone = finger_fit(places, np.empty((0, 4, 2)), np.empty(0), MODEL.radii[MIDDLE], 0, seen, CELLS_TASK, -np.inf)
    assert alone == pytest.approx(-0.5 * (off / CELLS_TASK.settings.tip_sd) ** 2, abs=1e-3)
    assert abs(found - alone) > 0.05


# Which finger is which protrusion.


def by_trying_all(scores: np.ndarray, costs: np.ndarray) -> float:
    """Return the best sum over all ways of giving each finger a protrusion or none."""
    best = -np.inf
    for way in product(range(-1, len(costs)), repeat=len(scores)):
        taken = [p for p in way if p >= 0]
        if len(taken) == len(set(taken)):
            left = sum(costs[p] for p in range(len(costs)) if p not in taken)
            best = max(best, sum(scores[finger, p] for finger, p in enumerate(way)) - left)
    return best


@pytest.mark.parametrize("protrusions", range(5))
def test_it_is_the_best_of_all_ways(protrusions: int) -> None:
    """The table over sets finds what trying all ways finds, and the assignment has the score that is said."""
    draw = np.random.default_rng(protrusions)
    for _ in range(6):
        scores = draw.normal(-5.0, 5.0, (5, protrusions + 1))
        scores[draw.random(scores.shape) < 0.2] = -np.inf
        scores[:, -1] = draw.normal(-5.0, 5.0, 5)
        costs = draw.uniform(0.0, 30.0, protrusions)
        score, chosen = assign(scores, costs)
        assert score == pytest.approx(by_trying_all(scores, costs))
        taken = chosen[chosen != HIDDEN]
        assert len(set(taken)) == len(taken)
        said = sum(scores[finger, p] for finger, p in enumerate(chosen)) - np.delete(costs, taken).sum()
        assert said == pytest.approx(score)


def test_many_protrusions_leave_some_of_no_finger() -> None:
    """With as many as there may be, every finger has its own and the others are paid for."""
    scores = np.full((5, MOST_PROTRUSIONS + 1), -9.0)
    scores[np.arange(5), np.arange(5) + 2] = -1.0
    score, chosen = assign(scores, np.ones(MOST_PROTRUSIONS))
    assert chosen.tolist() == [2, 3, 4, 5, 6]
    assert score == -5.0 - (MOST_PROTRUSIONS - 5)
