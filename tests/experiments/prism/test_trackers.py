"""Trackers of a prism: its camera and solid, and the use of each measurement."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.source import Frame, History, Measurements
from pftrack.core.numerics.matrices import pinhole
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.experiments.prism import experiment as prism
from pftrack.experiments.prism.experiment import TRACKERS, TrackedPrismParameters
from pftrack.experiments.prism.scene import NAMES, PRINCIPAL_PX, VERTICES_MM, PrismSource
from pftrack.experiments.shared.pose.calibrated import AS_PUBLISHED
from pftrack.experiments.shared.pose.methods import METHODS, Method
from pftrack.experiments.shared.pose.state import PoseState
from tests.making import whole_run


def parameters(**values: Value) -> TrackedPrismParameters:
    return revise(TrackedPrismParameters(), {**AS_PUBLISHED, "joint_sample_count": 500, **values})


def begun(method: Method, given: TrackedPrismParameters, seed: int = 1) -> PoseState:
    source = PrismSource(seed, given)
    return prism.start(method, source.start, source.frame(0, History(((0, given),))), given, rng(0))


def stepped(
    state: PoseState,
    method: Method,
    given: TrackedPrismParameters,
    frame: int,
    points_px: NDArray[np.float64],
    sd_px: float | NDArray[np.float64] = 1.0,
) -> PoseState:
    """Take a frame in which the vertices are measured at these points."""
    sd = np.broadcast_to(sd_px, 8).astype(np.float64)
    shown = Frame(frame, frame / 30, measurements=Measurements(points_px, sd))
    return prism.step(method, state, shown, given, rng(frame))


def rng(frame: int, seed: int = 2) -> Stream:
    return Stream(seed, frame, Purpose.TRACK if frame else Purpose.START)


def posed(
    theta: tuple[float, float, float], given: TrackedPrismParameters, place: tuple[float, float, float] | None = None
) -> NDArray[np.float64]:
    """Return the pixels of the vertices of a prism in this pose and place."""
    placed = VERTICES_MM @ rotation(np.array(theta)).T + (place or (0.0, 0.0, given.distance_mm))
    return pinhole(placed, given.focal_length_px) + PRINCIPAL_PX


@pytest.mark.parametrize("distance", [60.0, 400.0])
def test_the_affine_camera_sees_the_middle_plane_as_the_pinhole_does(distance: float) -> None:
    """At theta = 0 both cameras and the scale agree on points at the prism's own distance."""
    given = parameters(distance_mm=distance, focal_length_px=500)
    state = begun("pf-asd", given)
    plane = np.array([[0.0, 0.0, 0.0], [7.0, -3.0, 0.0], [-5.0, 9.0, 0.0]])
    by_pinhole = pinhole(plane + np.array([0, 0, distance]), 500.0) + PRINCIPAL_PX
    assert plane @ state.solid.reference[:, :3].T + state.solid.reference[:, 3] == pytest.approx(by_pinhole)
    assert state.solid.scale == pytest.approx(500 / distance)
    assert state.solid.translation_mm.tolist() == [0, 0, distance]
    assert np.array_equal(state.solid.points_mm, VERTICES_MM)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("angle", [0, 1, 2])
def test_each_angle_turns_its_own_way(method: Method, angle: int) -> None:
    """From exact vertices of a turn about one axis, each angle is right to 2 degrees."""
    given = parameters(distance_mm=800, focal_length_px=2000, sample_count=100, joint_sample_count=4000)
    state, axis = begun(method, given), np.eye(3)[angle]
    for frame in range(1, 13):
        x, y, z = np.deg2rad(min(frame, 10)) * axis
        state = stepped(state, method, given, frame, posed((x, y, z), given), 0.5)
    assert np.abs(np.rad2deg(state.estimate) - 10 * axis).max() < 2


def test_a_vertex_is_recognised_by_its_noise() -> None:
    """Measurements less than three times as noisy as the best one count as seen, the others as hidden."""
    given, noise = parameters(), np.array([2.0, 2.5, 5.9, 6.0, 6.1, 100.0, 2.0, 3.0])
    after = stepped(begun("pf-asd", given), "pf-asd", given, 1, posed((0, 0, 0), given), noise)
    assert after.recognised.tolist() == [True, True, True, False, False, False, True, True]
    found = TRACKERS["pf-asd"].measure(after)
    assert found["feature_recognised"] == (1, 1, 1, 0, 0, 0, 1, 1)
    assert len(found["feature_sd_px"]) == len(NAMES)  # type: ignore[arg-type] # a vector


@pytest.mark.parametrize("method", METHODS)
def test_a_noisy_vertex_hardly_counts(method: Method) -> None:
    """A wild measurement with the noise of a hidden vertex changes the pose by less than 3 degrees."""
    given = parameters(sample_count=300, joint_sample_count=4000)
    plain = wild = begun(method, given)
    hidden = np.arange(8) == 1
    for frame in range(1, 7):
        points, noise = posed((0, 0.01 * frame, 0), given), np.where(hidden, 500.0, 1.0)
        plain = stepped(plain, method, given, frame, points, noise)
        wild = stepped(wild, method, given, frame, points + hidden[:, None] * [200.0, -150.0], noise)
    assert np.rad2deg(np.abs(plain.estimate - wild.estimate)).max() < 3
    assert np.abs(plain.feature_means - wild.feature_means).max() < 25


@pytest.mark.parametrize("method", METHODS)
def test_a_measurement_that_is_not_a_number_is_ignored(method: Method) -> None:
    """With one or all measurements not finite, the state stays finite, and the next frame is used."""
    given = parameters()
    state, seen = begun(method, given), posed((0, 0, 0), given)
    for frame, broken in enumerate((slice(2, 3), slice(0, 8)), 1):
        points = seen.copy()
        points[broken] = np.nan
        state = stepped(state, method, given, frame, points)
        assert state.log_evidence == -np.inf
        for values in (state.estimate, state.sigma, state.feature_means, state.feature_covariances):
            assert np.isfinite(values).all()
    assert np.isfinite(stepped(state, method, given, 3, seen, 5.0).log_evidence)


@pytest.mark.parametrize(("upper", "distance", "within"), [("perspective", 64, 2), ("affine", 80, 1)])
def test_the_pinhole_knows_the_distance(upper: str, distance: float, within: float) -> None:
    """A prism that comes nearer by a fifth is found there to 2 mm; with an affine camera the distance stays."""
    given = parameters(upper_layer=upper, sample_count=200)
    state = begun("pf-asd", given)
    for frame in range(1, 25):
        place = (0.0, 0.0, 80.0 * (1 - 0.2 * min(frame / 20, 1.0)))
        state = stepped(state, "pf-asd", given, frame, posed((0, 0, 0), given, place), 0.5)
    assert state.translation_mm == pytest.approx([0, 0, distance], abs=within)
    assert upper == "affine" or np.rad2deg(np.abs(state.estimate)).max() < 3


def test_the_place_is_that_of_this_frame() -> None:
    """The place of a prism that moves by 2 mm a frame is that of the current frame, to 0.8 mm."""
    given = parameters(upper_layer="perspective", sample_count=300)
    state = begun("pf-asd", given)
    for frame in range(1, 11):
        points = posed((0, 0, 0), given, (2.0 * frame, 0.0, 80.0))
        state = stepped(state, "pf-asd", given, frame, points, 0.5)
    assert state.translation_mm[:2] == pytest.approx([20.0, 0.0], abs=0.8)


def test_a_learned_motion_guides_the_pose() -> None:
    """Turns learned from a run guide another run; a motion learned in another experiment is refused."""
    experiment = find("prism")
    run = whole_run(experiment, frames=40, values=AS_PUBLISHED)
    learned = experiment.guidance.learn([experiment.guidance.states(run.diagnostics)])
    turns = np.diff([row.estimate for row in run.diagnostics], axis=0) * np.pi / 180
    assert learned.diffusion("fixed").covariance == pytest.approx(np.cov(turns.T))
    guided = whole_run(experiment, frames=40, values={**AS_PUBLISHED, "learned": learned.text})
    assert guided.estimates_sha256 != run.estimates_sha256
    assert guided.summary().verdict.mean_error < 1.2 * run.summary().verdict.mean_error
    with pytest.raises(ParameterError, match="it was learned in 'head', and this is 'prism'"):
        revise(parameters(), {"learned": learned.text.replace('"prism"', '"head"')})
