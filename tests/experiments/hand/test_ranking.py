"""How parts and wholes are compared with a silhouette, moved nearer to it, and given its protrusions."""

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import convex_hull, fill
from pftrack.experiments.hand import likelihood
from pftrack.experiments.hand.beams import differences, improve, log_score
from pftrack.experiments.hand.candidates import HIDDEN, MOST_PROTRUSIONS, assign, half_steps
from pftrack.experiments.hand.fingers import features_in
from pftrack.experiments.hand.likelihood import NODES, PictureTables, axis_distances, cell_log_fit, tip_distances, x_p
from pftrack.experiments.hand.model import JOINT_COST, HandTrackerParameters, Predictions, Task, settings
from pftrack.experiments.hand.shape import MODEL, joints, open_pose, palm_points, silhouette
from pftrack.experiments.hand.silhouette import Finding, Silhouette
from tests.experiments.hand.seen import SCALE, SIDE, sight

Numbers = NDArray[np.float64]
TASK = Task(SCALE, MODEL, settings(HandTrackerParameters(), SCALE))
CELLS = TASK._replace(settings=TASK.settings._replace(cells=True))
POSE = open_pose((100.0, 137.0))
POSE[3] = 0.4
EXPECTED = Predictions(POSE[None], np.zeros(1))
NO_MOVES = np.empty((0, 4, 2))
INDEX, MIDDLE, TIP = 1, 2, 3


def palm_misfit(pose: Numbers, seen: PictureTables) -> float:
    return x_p(convex_hull(palm_points(pose, SCALE, MODEL)), seen, SCALE)


def fit(
    places: Numbers,
    protrusion: int,
    seen: PictureTables,
    least: float = -np.inf,
    *,
    finger: int = MIDDLE,
    task: Task = TASK,
    moves: Numbers = NO_MOVES,
) -> float:
    radii = MODEL.radii[finger]
    return likelihood.finger_fit(places, moves, np.empty(0), radii, protrusion, seen, task, least)


def test_x_p_is_the_area_outside_by_the_contour_inside() -> None:
    """Counted in a drawn mask it is the same."""
    seen, moved = sight(POSE), POSE.copy()
    moved[0] += 6.0
    hull = convex_hull(palm_points(moved, SCALE, MODEL))
    drawn = fill(hull[None], np.array([len(hull)]), SIDE, SIDE)
    outside = np.count_nonzero(drawn & ~seen.silhouette)
    touching = np.count_nonzero(drawn & likelihood.contour_of(seen.silhouette))
    assert palm_misfit(moved, seen) == pytest.approx(50.0 * outside / (SCALE * touching))
    assert outside > 50
    assert palm_misfit(POSE, seen) == 0.0


def test_a_finger_along_its_protrusion_fits_wholly() -> None:
    """One that ends 3.5 px beside it loses half, and one whose tip is hidden pays for that alone."""
    seen, places = sight(POSE, fingers=(MIDDLE,)), joints(POSE, SCALE, MODEL)[MIDDLE]
    beside = places + np.array([3.5, 0.0, 0.0])
    assert fit(places, 0, seen) == pytest.approx(0.0, abs=1e-3)
    assert fit(beside, 0, seen) == pytest.approx(-0.5, abs=1e-3)
    assert fit(beside, 0, seen, -0.4) == -np.inf
    assert -1.7 < fit(places, 0, seen._replace(axes=seen.axes[:, 11:], lengths=seen.lengths - 11)) <= -1.5


def test_a_hidden_finger_within_the_silhouette_pays_its_price_only() -> None:
    """Outside it pays for sticking out as well."""
    seen, places = sight(POSE), joints(POSE, SCALE, MODEL)[MIDDLE]
    assert fit(places, HIDDEN, seen) == pytest.approx(-2.0, abs=0.05)
    assert fit(places - (0.0, 40.0, 0.0), HIDDEN, seen) < -10.0


def test_moving_uphill_mends_a_pose_that_is_beside() -> None:
    """The score that is returned is that of the pose, though fingers were drawn by themselves; the fit gets better."""
    seen, assignment, begin = sight(POSE), np.arange(5), POSE.copy()
    begin[[0, 3, 5, 10, 11, 12]] += 2.0, -0.2, 0.1, 0.2, 0.2, 0.2
    pose, score = improve(begin, 0, EXPECTED, assignment, seen, TASK)
    own, first, true = (log_score(each, 0, EXPECTED, assignment, seen, TASK) for each in (pose, begin, POSE))
    assert score == pytest.approx(own, abs=1e-9)
    assert first + 10.0 < score <= true + 1e-9
    before, after = differences(np.array([begin, pose]), seen, TASK)
    assert after < 0.3 * before


def test_a_finger_of_which_the_middle_joint_is_seen_fits_its_protrusion() -> None:
    """With all joints as ends it pays the price of a hidden tip and little more; with the last one it is far off.

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


# The likelihood of a hand that stands for a cell of poses: eq. 2.9 against integrals, measures against drawn hands.

BENT = open_pose((100.0, 137.0))
BENT[3], BENT[6:9], BENT[10:13] = 0.3, 0.4, 0.6
HALVES = half_steps(BENT, CELLS)


def turned(pose: Numbers, finger: int, steps: Numbers) -> Numbers:
    """Return a pose that is some half steps (5,) away in the cell of a finger."""
    moved, at = pose.copy(), 5 + 4 * finger
    moved[2:5] += steps[:3] * HALVES[finger, :3]
    moved[at] += steps[3] * HALVES[finger, 3]
    moved[at + 1 : at + 4] += steps[4] * HALVES[finger, 4]
    return moved


def moves_of(finger: int) -> Numbers:
    """Return the displacements (5, 4, 2) of a finger."""
    spread, flexed = (
        np.array([joints(turned(BENT, f, one), SCALE, MODEL)[f] for f in range(5)]) for one in np.eye(5)[3:]
    )
    places = joints(BENT, SCALE, MODEL)
    return likelihood.displacements(BENT, places, spread, flexed, HALVES[0, :3], SCALE, MODEL.side)[finger]


def axis(places: Numbers) -> Numbers:
    """Return points 1 px apart along a finger, from its tip on."""
    back = places[::-1, :2]
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(back, axis=0).T))])
    return np.column_stack([np.interp(np.arange(along[-1]), along, back[:, i]) for i in range(2)])


@pytest.mark.parametrize("sd", [1.0, 2.5])
def test_the_mean_over_a_cell_is_the_integral_of_eq_2_9(sd: float) -> None:
    """Against 100,000 points of the five angles, from a measure of 0 to beyond the farthest; no term is above 0."""
    moves = moves_of(MIDDLE)
    fine = np.random.default_rng(0).uniform(-1.0, 1.0, (100_000, 5))
    distances = np.hypot(*np.tensordot(fine, moves[:, TIP], axes=1).T)
    for measure in np.linspace(0.0, likelihood.farthest(moves, TIP), 7):
        integral = np.exp(-0.5 * np.square((measure - distances) / sd)).mean()
        found = cell_log_fit(measure**2, tip_distances(moves, TIP), sd)
        assert np.exp(found) == pytest.approx(integral, abs=0.02)
        assert found <= 0.0


def test_a_hand_that_stands_for_no_cell_has_a_gaussian_alone() -> None:
    """And so has a cell in which nothing moves."""
    assert len(tip_distances(NO_MOVES, TIP)) == len(axis_distances(NO_MOVES, np.zeros((4, 2)), TIP, 9.0)) == 0
    assert likelihood.farthest(NO_MOVES, TIP) == 0.0
    assert cell_log_fit(9.0, np.empty(0), 1.5) == -2.0
    assert cell_log_fit(9.0, tip_distances(np.zeros((5, 4, 2)), TIP), 1.5) == pytest.approx(-2.0)


@pytest.mark.parametrize("finger", [0, 1, MIDDLE])
def test_tips_and_axes_go_evenly_as_those_of_poses_in_the_cell(finger: int) -> None:
    """Within a px or a tenth of those of poses between the middle of the cell and its corners."""
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


def test_an_axis_is_compared_as_far_as_it_is_explained() -> None:
    """A turn about the tip moves a point as far as it is away, so the mean is half that of the end."""
    places = np.array([[0.0, 0.0], [10.0, 0.0], [25.0, 0.0], [40.0, 0.0]])
    moves = np.zeros((5, 4, 2))
    moves[0, :, 1] = 0.1 * (40.0 - places[:, 0])
    for length in (40.0, 20.0, 7.0):
        found = axis_distances(moves, places, TIP, length)
        assert found == pytest.approx(0.05 * length * np.abs(NODES[:, 0]))
    whole = axis_distances(moves, places, TIP, 40.0)
    assert (axis_distances(moves, places, 2, 25.0) < whole + 1e-9).all()


def test_palms_of_a_cell_stick_out_of_the_drawn_hand_by_what_is_measured_there() -> None:
    """Interpolated between half a step either way; a finger before the palm sticks out of nothing."""
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
def test_a_finger_that_is_seen_beside_its_candidate_is_weighed_over_the_cell(off: float) -> None:
    """By its tip and by its axis; and a score is not given up that is just above what is of interest."""
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


def by_trying_all(scores: Numbers, costs: Numbers) -> float:
    """Return the best sum over all ways of giving each finger a protrusion or none."""
    best = -np.inf
    for way in product(range(-1, len(costs)), repeat=len(scores)):
        taken = [p for p in way if p >= 0]
        if len(taken) == len(set(taken)):
            best = max(best, scores[np.arange(len(scores)), way].sum() - np.delete(costs, taken).sum())
    return best


@pytest.mark.parametrize("protrusions", range(5))
def test_it_is_the_best_of_all_ways(protrusions: int) -> None:
    """The table over sets finds what trying all ways finds, and the assignment has the score that is said."""
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


def test_many_protrusions_leave_some_of_no_finger() -> None:
    """With as many as there may be, every finger has its own and the others are paid for."""
    scores = np.full((5, MOST_PROTRUSIONS + 1), -9.0)
    scores[np.arange(5), np.arange(5) + 2] = -1.0
    score, chosen = assign(scores, np.ones(MOST_PROTRUSIONS))
    assert chosen.tolist() == [2, 3, 4, 5, 6]
    assert score == -5.0 - (MOST_PROTRUSIONS - 5)
