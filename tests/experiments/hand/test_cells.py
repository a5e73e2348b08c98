"""The likelihood of a hand that stands for a cell of poses: eq. 2.9 against integrals, measures against drawn hands."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import convex_hull
from pftrack.experiments.hand.candidates import half_steps
from pftrack.experiments.hand.likelihood import (
    NODES,
    axis_distances,
    cell_log_fit,
    displacements,
    farthest,
    finger_fit,
    ideals_of,
    tables_of,
    tip_distances,
    x_p,
)
from pftrack.experiments.hand.model import HandTrackerParameters, Task, settings
from pftrack.experiments.hand.shape import MODEL, joints, open_pose, palm_points, silhouette

SCALE, SIDE = 52.0, 200
TASK = Task(SCALE, MODEL, settings(HandTrackerParameters(), SCALE)._replace(cells=True))
POSE = open_pose((100.0, 137.0))
POSE[3], POSE[6:9], POSE[10:13] = 0.3, 0.4, 0.6
HALVES = half_steps(POSE, TASK)
MIDDLE, TIP = 2, 3


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
        np.array([joints(turned(pose, f, one), SCALE, MODEL)[f] for f in range(5)]) for one in np.eye(5)[3:]
    )
    return displacements(pose, joints(pose, SCALE, MODEL), spread, flexed, HALVES[0, :3], SCALE, MODEL.side)


def axis(places: NDArray[np.float64], end: int = TIP) -> NDArray[np.float64]:
    """Return points 1 px apart along a finger, from one of its joints on."""
    back = places[end::-1, :2]
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(back, axis=0).T))])
    return np.column_stack([np.interp(np.arange(along[-1]), along, back[:, i]) for i in range(2)])


@pytest.mark.parametrize("sd", [1.0, 2.5])
def test_the_mean_over_a_cell_is_the_integral_of_eq_2_9(sd: float) -> None:
    """Against 100,000 points of the five angles, from a measure of 0 to beyond the farthest; no term is above 0."""
    moves = moves_of(POSE)[MIDDLE]
    fine = np.random.default_rng(0).uniform(-1.0, 1.0, (100_000, 5))
    distances = np.hypot(*np.tensordot(fine, moves[:, TIP], axes=1).T)
    for measure in np.linspace(0.0, farthest(moves, TIP), 7):
        integral = np.exp(-0.5 * np.square((measure - distances) / sd)).mean()
        found = cell_log_fit(measure**2, tip_distances(moves, TIP), sd)
        assert np.exp(found) == pytest.approx(integral, abs=0.02)
        assert found <= 0.0


def test_a_hand_that_stands_for_no_cell_has_a_gaussian_alone() -> None:
    """And so has a cell in which nothing moves."""
    none = np.empty((0, 4, 2))
    assert len(tip_distances(none, TIP)) == len(axis_distances(none, np.zeros((4, 2)), TIP, 9.0)) == 0
    assert farthest(none, TIP) == 0.0
    assert cell_log_fit(9.0, np.empty(0), 1.5) == -2.0
    assert cell_log_fit(9.0, tip_distances(np.zeros((5, 4, 2)), TIP), 1.5) == pytest.approx(-2.0)


@pytest.mark.parametrize("finger", [0, 1, MIDDLE])
def test_tips_and_axes_go_evenly_as_those_of_poses_in_the_cell(finger: int) -> None:
    """Within a px or a tenth of those of poses between the middle of the cell and its corners."""
    places = joints(POSE, SCALE, MODEL)[finger]
    moves = moves_of(POSE)[finger]
    length = len(axis(places)) - 1.0
    tips, axes = tip_distances(moves, TIP), axis_distances(moves, places, TIP, length)
    for n in range(0, len(NODES), 4):
        there = joints(turned(POSE, finger, NODES[n]), SCALE, MODEL)[finger]
        assert tips[n] == pytest.approx(np.hypot(*(there - places)[TIP, :2]), rel=0.1, abs=1.5)
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
        found = axis_distances(moves, places, TIP, length)
        assert found == pytest.approx(0.05 * length * np.abs(NODES[:, 0]))
    assert (axis_distances(moves, places, 2, 25.0) < axis_distances(moves, places, TIP, 40.0) + 1e-9).all()


def test_palms_of_a_cell_stick_out_of_the_drawn_hand_by_what_is_measured_there() -> None:
    """Interpolated between half a step either way; a finger before the palm sticks out of nothing."""
    pose = POSE.copy()
    pose[14:17] = 1.3  # the middle finger is folded
    drawn = tables_of(silhouette(pose, SCALE, MODEL, (SIDE, SIDE)), [])
    (found,) = ideals_of(pose[None], drawn, TASK)
    steps = half_steps(pose, TASK)[0]
    ways = np.zeros((3, 2))
    for i in range(3):
        for way, sign in enumerate((-1.0, 1.0)):
            moved = pose.copy()
            moved[2 + i] += sign * steps[i]
            ways[i, way] = x_p(convex_hull(palm_points(moved, SCALE, MODEL)), drawn, SCALE)
    expected = [sum(abs(node[i]) * ways[i, int(node[i] > 0.0)] for i in range(3)) for node in NODES]
    assert found[0] == pytest.approx(expected)
    assert 0.0 < found[0].max() < 1.0
    assert found[1 + MIDDLE].max() < 0.5 * found[2].max()
    assert ideals_of(pose[None], drawn, TASK._replace(settings=TASK.settings._replace(cells=False))).size == 0


@pytest.mark.parametrize("off", [0.0, 2.0, 5.0])
def test_a_finger_that_is_seen_beside_its_candidate_is_weighed_over_the_cell(off: float) -> None:
    """By its tip and by its axis; and a score is not given up that is just above what is of interest."""
    places, moves = joints(POSE, SCALE, MODEL)[MIDDLE], moves_of(POSE)[MIDDLE]
    seen_axis = axis(places) + np.array([off, 0.0])
    seen = tables_of(silhouette(POSE, SCALE, MODEL, (SIDE, SIDE)), [seen_axis])
    length = len(seen_axis) - 1.0
    wanted = cell_log_fit(off**2, tip_distances(moves, TIP), TASK.settings.tip_sd)
    wanted += cell_log_fit(0.0, axis_distances(moves, places, TIP, length), TASK.settings.axis_sd)
    for least in (-np.inf, wanted - 1e-3):
        found = finger_fit(places, moves, np.empty(0), MODEL.radii[MIDDLE], 0, seen, TASK, least)
        assert found == pytest.approx(wanted, abs=1e-2)
    alone = finger_fit(places, np.empty((0, 4, 2)), np.empty(0), MODEL.radii[MIDDLE], 0, seen, TASK, -np.inf)
    assert alone == pytest.approx(-0.5 * (off / TASK.settings.tip_sd) ** 2, abs=1e-3)
    assert abs(found - alone) > 0.05
