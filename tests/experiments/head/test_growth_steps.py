"""The face model that grows while a head is tracked: it approaches the driver's face, and its drawing shows it."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.recipe import Change
from pftrack.core.model.setup import find_export
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.experiments.head import parameters as face_growth
from pftrack.experiments.head.experiment import UNCERTAINTY, front, points_of, surface_of
from pftrack.experiments.head.parameters import AS_PUBLISHED, starting_model
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.runs.run import Run
from pftrack.vision.face import FEATURES, fit_similarity, mean_model, person
from pftrack.vision.model_files import as_json
from pftrack.vision.structure.factorization import residuals
from pftrack.vision.structure.growing import Growing
from tests.experiments.head.heads import simulated
from tests.making import whole_run

HEAD = find("head")
SMALL: dict[str, Value] = {"image_width_px": 320, "feature_noise_px": 3, "person": 102}
"""Small pictures of driver 102, whose nose is 6 mm longer than the mean's."""
MEAN, COUNT = mean_model().points_mm, len(FEATURES)


def variances(state: PoseState, correlations: NDArray[np.float64], eyes_px: float = 54.0) -> NDArray[np.float64]:
    return face_growth.position_variances(state, correlations, eyes_px, 0.5)


def run_of(frames: int, *changes: Change, **values: Value) -> Run:
    timeline = (Change(0, {**AS_PUBLISHED, **SMALL, "face_model": "growing", **values}), *changes)
    return Run(HEAD, HEAD.simulate(), seed=1, frames=frames, timeline=timeline)


def growth_of(run: Run) -> Growing:
    growth: Growing = run.current.state.memory.growth
    return growth


def error_mm(shape: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.square(residuals(shape, person(102).points_mm, "similarity")).mean()))


@pytest.fixture(scope="module")
def whole() -> Run:
    """Sixty frames of a head that hardly turns; tests branch from it and seek in it."""
    return run_of(60)


@pytest.fixture
def grown(whole: Run) -> Run:
    whole.finish()
    return whole


@pytest.fixture
def state(grown: Run) -> PoseState:
    return grown.current.state  # type: ignore[no-any-return] # it is of a head


def test_the_face_approaches_the_drivers(grown: Run) -> None:
    """After sixty frames its error is at most 0.85 times the mean face's; the series report its state."""
    rows = [row.series for row in grown.diagnostics]
    first, last = float(rows[0]["shape_error_mm"]), float(rows[-1]["shape_error_mm"])
    assert (first, last) == pytest.approx((error_mm(MEAN), error_mm(growth_of(grown).shape)))
    assert last < 0.85 * first
    assert 0.5 < float(rows[-1]["own_share"]) <= 1.0
    assert 0.0 < float(rows[-1]["own_probability"]) < 1.0
    assert rows[-1]["shape_frames"] == 59
    assert float(rows[-1]["shape_sd_mm"]) < float(rows[0]["shape_sd_mm"])
    assert np.abs(np.diff([float(row["own_share"]) for row in rows])).max() <= 1.0 / 30.0 + 1e-12


def test_the_tracker_uses_the_grown_face(grown: Run, state: PoseState) -> None:
    """The solid has the points of the frame before, to the accuracy at which it is built again."""
    published = grown.seek(grown.position - 1).state.memory.growth.shape
    assert np.abs(published - MEAN).max() > 1.0
    assert np.abs(state.solid.points_mm - published).max() < 0.2
    assert np.array_equal(state.memory.model.points_mm, state.solid.points_mm)


def test_a_frozen_model_stays(grown: Run) -> None:
    """While frozen, the learned face stays to the bit; afterwards learning continues."""
    frozen = grown.branch(40, {"model_frozen": True})
    learned = growth_of(frozen).own.shape
    frozen.seek(46)
    assert np.array_equal(growth_of(frozen).own.shape, learned)
    frozen.change({"model_frozen": False})
    frozen.seek(50)
    assert growth_of(frozen).own.frames == 44


def test_forgetting_may_begin_in_mid_run(grown: Run) -> None:
    """With a memory below 1 the model takes another course, and still improves on the mean face."""
    forgetting = grown.branch(50, {"model_memory": 0.9})
    forgetting.seek(59)
    assert not np.array_equal(growth_of(forgetting).own.shape, growth_of(grown).own.shape)
    assert float(forgetting.diagnostics[-1].series["shape_error_mm"]) < error_mm(MEAN)


def test_growth_may_begin_and_end_in_mid_run() -> None:
    """It begins with the mean face; afterwards the mean face is back at once, and nothing of growth is reported.

    Another focal length starts it again, another upper layer does not.
    """
    run = run_of(20, face_model="mean")
    run.seek(4)
    assert run.current.state.memory.growth is None
    run.change({"face_model": "growing"})
    run.seek(8)
    run.change({"upper_layer": "perspective"})
    run.seek(10)
    assert growth_of(run).own.frames == 6
    run.change({"focal_widths": 1.2})
    run.seek(12)
    assert growth_of(run).own.frames == 2
    assert growth_of(run).settings.focal_px == pytest.approx(1.2 * 320)
    run.change({"face_model": "mean"})
    run.seek(14)
    assert run.current.state.memory.growth is None
    assert np.array_equal(run.current.state.memory.model.points_mm, MEAN)
    assert not {"own_share", "shape_error_mm", "free_energy"} & set(run.current.diagnostics.series)


def test_variances_follow_from_particles_and_templates(state: PoseState) -> None:
    """A template's slip grows with the face, and few effective particles enlarge the variance.

    An unlike feature is less certain; one that is not recognised, or without a number, has an infinite variance.
    """
    recognised = np.arange(COUNT) > 2
    sure, unlike, unknown = (variances(state, np.full(COUNT, it)) for it in (1.0, 0.75, np.nan))
    assert (unlike > sure + 5 * 99 * 0.2).all()
    hidden = variances(replace(state, recognised=recognised), np.ones(COUNT))
    assert np.array_equal(np.isfinite(hidden).all(axis=1), recognised)
    assert not np.isfinite(unknown).any()
    slip = (variances(state, np.ones(COUNT), 108.0) - sure) / 3.0
    assert slip == pytest.approx(np.full((COUNT, 2), slip[0, 0]))
    assert slip[0, 0] > 1.0
    told = np.maximum(state.feature_covariances.diagonal(axis1=1, axis2=2), 0.5**2)
    assert (sure - slip > 1.005 * face_growth.PERSISTENCE * told)[state.recognised].all()


def test_frames_with_possibly_hidden_features_teach_nothing() -> None:
    """The face is learned only while all features are clearly visible."""
    state, frame = whole_run(HEAD, seed=1, frames=12, values=SMALL).current.state, simulated(14)[13]
    values, rival = revise(HEAD.simulate().parameters, SMALL), state.belief.rival
    learned = []
    for log_odds in (15.0, -2.0, -15.0):
        belief = replace(state.belief, rival=replace(rival, doubting=False, log_odds=log_odds))
        after = HEAD.trackers["pf-asd"].step(replace(state, belief=belief), frame, values, Stream(1, 13, Purpose.TRACK))
        learned.append(not np.array_equal(after.memory.growth.shape, state.memory.growth.shape))
    assert learned == [False, False, True]


def learned_from(growth: Growing, state: PoseState) -> Growing:
    return face_growth.learn(growth, state, np.ones(COUNT), 54.0, revise(HEAD.simulate().parameters, SMALL))


def test_learning_uses_the_recognised_points(state: PoseState) -> None:
    """The camera of the learned face projects its points to their places in the picture.

    Three points teach nothing. The depth of a nose that is never recognised stays as uncertain as people vary.
    """
    begun = face_growth.begin(mean_model(), state.solid.focal_px, revise(HEAD.simulate().parameters, SMALL))
    own, solid = learned_from(begun, state).own, state.solid
    x, y, z = own.camera[:, :3] @ own.shape.T + own.camera[:, 3:]
    seen = solid.focal_px * np.column_stack([x, y]) / z[:, None] + solid.principal_px
    assert np.abs(seen - state.feature_means).max() < 5.0
    assert learned_from(begun, replace(state, recognised=np.arange(COUNT) < 3)) is begun
    growth = begun
    for _ in range(30):
        growth = learned_from(growth, replace(state, recognised=np.arange(COUNT) > 0))
    # The published face is partly the mean, whose variance is that of people.
    assert replace(growth, weight=1.0).covariances[0][2, 2] > 0.81 * begun.covariances[0][2, 2]


def test_growth_continues_when_a_face_is_found_again() -> None:
    """The model of a face that was covered for some frames is kept and improved; only its cameras start again."""
    covered, clear = ({"hand_cover": cover, "pillar_width_px": 500.0 * cover} for cover in (1.0, 0.0))
    values: dict[str, Value] = {
        name: revise(HEAD.simulate().parameters, {}).model_dump()[name] for name in AS_PUBLISHED
    }
    run = run_of(44, Change(12, covered), Change(22, clear), **values, find_again=True, patience_frames=2)
    lost = [step.state.memory.lost for step in run]
    assert any(lost)
    assert not lost[-1]
    growth = growth_of(run)
    assert growth.own.frames > 10
    assert np.isfinite(growth.shape).all()
    again = face_growth.widen_motion(growth)
    assert growth.own.camera is not None
    assert (again.own.camera, again.mean_camera) == (None, None)
    assert np.array_equal(again.own.precision, growth.own.precision)


def test_a_run_may_begin_with_a_learned_face(grown: Run) -> None:
    """From the exported face a run begins with its error, and a change of another parameter keeps it to the digit."""
    text = find_export(HEAD.exports, "face-json").make(grown.current.state, grown.diagnostics).decode()
    learned = growth_of(grown).shape
    run = run_of(6, starting_face=text)
    assert float(run.current.diagnostics.series["shape_error_mm"]) == pytest.approx(error_mm(learned), abs=0.01)
    assert np.abs(run.finish().state.solid.points_mm - learned).max() < 0.5
    assert len(str(run.recipe.timeline[0].values["starting_face"])) < 1500


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nonsense", "must be a face model .expected a JSON file of points"),
        (as_json(FEATURES[:5], MEAN[:5]).decode(), "expected a model of 11 points, got 5"),
        (as_json(FEATURES, 5 * MEAN).decode(), "0.5 to 2 times the mean's size, got 5"),
        (as_json(FEATURES, MEAN * (1, 1, -1)).decode(), "within 25 mm of the mean face's, got nose"),
        (as_json(FEATURES, np.zeros((11, 3))).decode(), "all at one place"),
        ("x" * 100_001, "of at most 100000 characters"),
    ],
)
def test_an_unusable_starting_face_is_refused(text: str, words: str) -> None:
    """The sentence names the parameter and what is wrong with the text."""
    with pytest.raises(ParameterError, match=words) as caught:
        revise(HEAD.simulate().parameters, {"starting_face": text})
    assert caught.value.field == "starting_face"


def test_a_turned_starting_face_is_turned_back() -> None:
    """A model in another pose and place is laid onto the mean face at its own size.

    A change of another parameter leaves it as it is to the digit, or the model would begin again.
    """
    for driver in range(100, 110):
        large = 1.1 * person(driver).points_mm
        text = as_json(FEATURES, large @ rotation(np.array([0.3, -0.5, 0.2])).T + (10.0, 200.0, -50.0)).decode()
        onto = fit_similarity(large, MEAN)
        np.testing.assert_allclose(starting_model(text).points_mm, onto(large) / onto.scale, atol=1e-3)
        first = revise(HEAD.simulate().parameters, {"starting_face": text})
        assert revise(first, {"model_memory": 0.9}).starting_face == first.starting_face


# The drawing of a growing face: its points, colours by uncertainty, ellipsoids, and the mean face as a wire.


def world(run: Run, frame: int) -> dict[str, Any]:
    (drawn,) = HEAD.draw(run.seek(frame), run.diagnostics).worlds
    return dict(drawn.primitives)


def test_the_drawn_surface_becomes_the_persons(grown: Run) -> None:
    """It begins as the mean face's, which stays as a wire, and ends as that of the tracker's model.

    Each point has an ellipsoid with its covariance. A lost face has one colour and no ellipsoids.
    """
    first, drawn = world(grown, 0)["surface"].vertices, world(grown, 59)
    mean, memory, last = front(mean_model()), grown.current.state.memory, drawn["surface"].vertices
    np.testing.assert_allclose(first, mean.vertices_mm, atol=1e-4)
    np.testing.assert_allclose(last, front(memory.model).vertices_mm, atol=1e-4)
    assert np.abs(last - first).max() > 1.0
    assert np.array_equal(drawn["mean face"].segments, mean.vertices_mm.astype(np.float32)[mean.edges])
    np.testing.assert_allclose(drawn["model ellipsoids"].centres, memory.model.points_mm, atol=1e-4)
    covariances = memory.growth.covariances
    np.testing.assert_allclose(drawn["model ellipsoids"].covariances, covariances, rtol=1e-4, atol=1e-4)
    lost = replace(grown.current.state, memory=replace(memory, lost_frames=2))
    (without,) = HEAD.draw(replace(grown.current, state=lost), grown.diagnostics).worlds
    assert "model ellipsoids" not in without.primitives
    assert without.primitives["surface"].is_uniform


def test_the_surface_is_coloured_by_uncertainty(grown: Run) -> None:
    """Picture and world agree; uncertainty falls with time near the features and stays far from them."""
    before, later = (world(grown, frame)["surface"] for frame in (1, 59))
    assert later.layer == UNCERTAINTY
    assert np.array_equal(later.colour, HEAD.draw(grown.current, grown.diagnostics).primitives["head"].colour)
    points = grown.current.state.memory.model.points_mm
    apart = np.linalg.norm(later.vertices[:, None] - points, axis=2).min(axis=1)
    # Viridis has more green for more uncertainty.
    assert later.colour[apart < 8, 1].mean() < before.colour[apart < 8, 1].mean() - 25
    assert later.colour[apart > 40, 1].mean() > later.colour[apart < 8, 1].mean() + 20
    assert np.abs(later.colour[apart > 60].astype(int) - before.colour[apart > 60]).max() < 12


def test_exports_have_surface_and_points(grown: Run, state: PoseState) -> None:
    """The exported surface has its outside out; points come with deviations, own share and number of frames.

    A model that does not grow has none of these.
    """
    surface = surface_of(state)
    corners = surface.vertices_mm[surface.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((normals * (corners.mean(axis=1) - (0.0, 0.0, -90.0))).sum(axis=1) > 0.0).all()
    said, growth = json.loads(points_of(state)), growth_of(grown)
    squares = np.square([said["standard_deviations"][name] for name in FEATURES])
    np.testing.assert_allclose(squares, growth.covariances.diagonal(axis1=1, axis2=2), atol=1e-3)
    assert said["own_share"] == pytest.approx(growth.weight, abs=1e-4)
    assert said["frames"] == growth.own.frames == 59
    plain = run_of(1, face_model="mean")
    assert not {"standard_deviations", "own_share"} & set(json.loads(points_of(plain.current.state)))
