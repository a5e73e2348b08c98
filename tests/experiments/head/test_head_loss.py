"""A face that leaves: its loss, the search, and its recognition."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import Value, revise
from pftrack.experiments.head import trackers as head
from pftrack.experiments.head.appearance import SEARCH_EVERY, around
from pftrack.experiments.head.detection import DetectedFace
from pftrack.experiments.head.first_sight import EYES, is_same_face, pose_found
from pftrack.experiments.head.parameters import HeadTrackerParameters
from pftrack.experiments.shared.pose.methods import METHODS, Method
from pftrack.experiments.shared.pose.state import PoseState
from tests.experiments.head import moving_face
from tests.experiments.head.moving_face import POINTS, begun, grey, grey_at, memory, parameters, similar, stepped

Picture, Points = NDArray[np.uint8], NDArray[np.float64]


class Search:
    """A face that leaves, with a finder whose answers depend on the frame."""

    def __init__(self, given: HeadTrackerParameters, find: Callable[[int], object]) -> None:
        self.given, self.answer, self.index = given, find, 0
        self.asked: list[tuple[int, object, object]] = []
        self.state = begun("pf-asd", given)

    def find(self, picture: Picture, box: object, model: object) -> object:
        self.asked.append((self.index, box, model))
        return self.answer(self.index)

    def step(self, picture: Picture, method: Method = "pf-asd") -> PoseState:
        self.index += 1
        self.state = stepped(self.state, method, self.given, self.index, picture)
        return self.state


@pytest.fixture
def search(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Search]:
    """Return a function that starts a search for a face at some points, or in some frames."""

    def begin(found: Points | Callable[[int], object], **values: Value) -> Search:
        given = parameters(**{"find_again": True, "patience_frames": 1, **values})
        run = Search(given, found if callable(found) else lambda _: detected(found))
        monkeypatch.setattr(head, "find_again", run.find)
        return run

    return begin


def detected(points: Points) -> DetectedFace:
    return DetectedFace(points, (0.0, 0.0, 1.0, 1.0), 2)


def test_a_lost_face_is_searched_for(search: Callable[..., Search]) -> None:
    """After `patience` doubtful frames it is lost; the search runs in the next frame and every fifth one after it."""
    run = search(lambda _: None, patience_frames=3, pose_noise_deg=2.0, face_model="personal")
    known = run.step(grey())
    found = [memory(run.step(moving_face.NOTHING)) for _ in range(3)]
    assert [(one.doubtful_frames, one.lost) for one in found] == [(1, False), (2, False), (3, True)]
    tracker = head.TRACKERS["pf-asd"]
    assert [tracker.searching(state) for state in (known, run.state)] == [False, True]
    run.state = replace(run.state, recognised=np.ones(11, np.bool_))
    lost_at, before = run.index, run.state
    for count in range(2, 20):
        state = run.step(moving_face.NOTHING)
        assert memory(state).lost_frames == count
        assert not state.recognised.any()
        assert not state.switched
        held, had = state.belief.kept.features, before.belief.kept.features
        assert held.coordinates is had.coordinates
        assert held.parents.ravel().tolist() == list(range(held.parents.size))
        variances = before.pose.covariance.diagonal() + (count - 1) * np.deg2rad(2.0) ** 2
        assert state.sigma == pytest.approx(np.sqrt(variances))
        assert np.array_equal(state.estimate, before.estimate)
    assert [index for index, _, _ in run.asked] == [lost_at + 1 + SEARCH_EVERY * times for times in range(4)]
    assert {box for _, box, _ in run.asked} == {memory(known).box}
    assert {id(model) for _, _, model in run.asked} == {id(memory(known).sight.own)}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("scale", [0.81, 1.0, 1.24])
def test_a_face_of_much_the_same_size_is_found_again(
    method: Method, scale: float, search: Callable[..., Search]
) -> None:
    """It keeps its templates and first sight, and begins at the new points with their roll and size."""
    points = similar(scale, 0.2, (6.0, -4.0))
    run = search(points)
    before = memory(run.step(grey(), method))
    assert memory(run.step(moving_face.NOTHING, method)).lost
    state = run.step(grey_at(points), method)
    found = memory(state)
    assert (found.lost, found.doubtful_frames, state.switched) == (False, 0, True)
    assert found.templates is before.templates
    assert found.sight is before.sight
    assert found.enlarged == pytest.approx(scale)
    assert found.box == pytest.approx(around(points))
    assert state.recognised.all()
    assert state.estimate == pytest.approx([0, 0, 0.2])
    assert np.rad2deg(state.sigma) == pytest.approx([10.0] * 3)
    assert state.feature_means == pytest.approx(points, abs=4)
    assert state.project(state.solid.points_mm) == pytest.approx(points, abs=1e-6 if method != "rb-pf" else 1e-5)
    spread = np.sqrt(np.trace(state.feature_covariances, axis1=1, axis2=2) / 2)
    assert method == "rb-pf" or np.mean(spread) == pytest.approx(0.05 * before.box[2] / 1.5, rel=0.1)


@pytest.mark.parametrize("scale", [0.79, 1.26])
def test_a_face_of_another_size_begins_again(scale: float, search: Callable[..., Search]) -> None:
    """Its templates are cut at its new place, the pose begins at 0, and the person stays the same."""
    points = similar(scale, 0.0, (0.0, 0.0))
    run, picture = search(points), grey_at(points)
    before = memory(run.step(grey()))
    run.step(moving_face.NOTHING)
    state = run.step(picture)
    found = memory(state)
    assert not found.lost
    assert found.templates is not before.templates
    assert np.array_equal(found.sight.points_px, points)
    assert np.array_equal(found.sight.grey, picture)
    assert found.sight.own == before.sight.own
    assert found.enlarged == 1.0
    assert state.estimate.tolist() == [0, 0, 0]
    assert memory(run.step(picture)).correlations.min() > 0.7


def test_templates_in_relief_fit_any_size(search: Callable[..., Search]) -> None:
    """A face found 1.5 times as large keeps them; built again in another form they are those of first sight."""
    points = similar(1.5, 0.0, (0.0, 0.0))
    run = search(points, templates="relief", upper_layer="perspective")
    before = memory(run.step(grey()))
    run.step(moving_face.NOTHING)
    found = memory(run.step(grey_at(points)))
    assert found.enlarged == pytest.approx(1.5, rel=0.1)
    assert found.sight is before.sight
    assert found.reliefs is before.reliefs
    for changed in ({"face_model": "personal"}, {"template_scale": 0.7}, {"focal_widths": 1.0}):
        other = revise(run.given, changed)
        again, fresh = memory(head._form(run.state, other)).reliefs, memory(begun("pf-asd", other)).reliefs
        assert again is not before.reliefs
        assert np.array_equal(again.points_mm, fresh.points_mm)
        assert np.array_equal(again.levels, fresh.levels)


def test_a_false_detection_is_rejected(search: Callable[..., Search]) -> None:
    """A small face in the texture beside the true one is ignored, and the search continues."""
    wrong = similar(0.25, 0.0, (10.0, 30.0))
    run = search(lambda index: detected(wrong if index < 8 else POINTS))
    run.step(grey())
    run.step(moving_face.NOTHING)
    assert [memory(run.step(grey())).lost for _ in range(6)] == [True] * 5 + [False]
    assert [index for index, _, _ in run.asked] == [3, 8]


# The judgement of a detection: whether it is the lost face, and its pose.

SIGHT = memory(begun("pf-asd", parameters())).sight


@pytest.mark.parametrize(("scale", "roll"), [(1.0, 0.0), (0.6, 0.4), (1.4, -0.3)])
def test_a_face_is_known_again_at_any_size_and_roll(scale: float, roll: float) -> None:
    """It may be darker, with less contrast and some pixels off; another place or picture is rejected.

    Five features in place are enough.
    """
    points = similar(scale, roll, (8.0, -5.0))
    picture, half = grey_at(points), grey()
    half[int(np.sort(POINTS[:, 1])[5]) + 12 :] = 128
    assert is_same_face(picture, SIGHT, points)
    assert is_same_face((20 + picture // 3).astype(np.uint8), SIGHT, points + 3.0 * scale)
    assert is_same_face(half, SIGHT, POINTS)
    assert not is_same_face(grey_at(POINTS)[::-1, ::-1].copy(), SIGHT, points)
    assert not is_same_face(moving_face.NOTHING, SIGHT, points)
    assert not is_same_face(picture, SIGHT, similar(0.3 * scale, roll, (0.0, 30.0)))


@pytest.mark.parametrize(("pitch", "yaw"), [(0, 30), (-20, 45)])
def test_the_pose_comes_from_the_picture(pitch: float, yaw: float) -> None:
    """A clear picture gives exactly its pose on the grid, size and places; an empty one gives the front."""
    solid = begun("pf-asd", parameters()).solid
    theta = np.deg2rad([pitch, yaw, 5.0])
    true = 1.3 * solid.points_mm @ (solid.reference[:, :3] @ rotation(theta)).T + (100.0, 90.0)

    def scores(slopes: NDArray[np.float64], positions: NDArray[np.float64]) -> NDArray[np.float64]:
        assert slopes.shape == (11, 2, 3)
        return -20.0 * np.square(positions - true[:, None]).sum(axis=2)

    found = pose_found(solid, true[EYES], theta[2], scores)
    np.testing.assert_allclose(found.theta, theta, atol=1e-6)
    assert found.scale == pytest.approx(1.3, rel=1e-6)
    np.testing.assert_allclose(found.points_px, true, atol=1e-4)
    nothing = pose_found(solid, true[EYES], theta[2], lambda _, positions: np.zeros(positions.shape[:2]))
    np.testing.assert_allclose(nothing.theta[:2], 0.0, atol=1e-9)
