"""The face model that grows while a head is tracked: it nears the driver's face, and is drawn as it is."""

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
from pftrack.vision.face import FEATURES, fit_similarity, mean_model, person, spread_mm2
from pftrack.vision.model_files import as_json
from pftrack.vision.structure.factorization import residuals
from pftrack.vision.structure.growing import Growing
from tests.experiments.head.heads import simulated
from tests.making import whole_run

HEAD = find("head")
SMALL: dict[str, Value] = {"image_width_px": 320, "feature_noise_px": 3}
MEAN, COUNT = mean_model().points_mm, len(FEATURES)


def variances(state: PoseState, correlations: NDArray[np.float64], eyes_px: float = 54.0) -> NDArray[np.float64]:
    return face_growth.position_variances(state, correlations, eyes_px, 0.5)


def run_of(frames: int, **values: Value) -> Run:
    timeline = (Change(0, {**AS_PUBLISHED, "face_model": "growing", "person": 102, **values}),)
    return Run(HEAD, HEAD.simulate(), seed=1, frames=frames, timeline=timeline)


def growth_of(run: Run) -> Growing:
    growth: Growing = run.current.state.memory.growth
    return growth


def error_mm(shape: NDArray[np.float64], driver: int) -> float:
    return float(np.sqrt(np.square(residuals(shape, person(driver).points_mm, "similarity")).mean()))


@pytest.fixture(scope="module")
def grown() -> Run:
    """Sixty small pictures of driver 102, whose nose is 6 mm longer than the mean's."""
    run = run_of(60, **SMALL)
    run.finish()
    return run


@pytest.fixture(scope="module")
def state(grown: Run) -> PoseState:
    found: PoseState = grown.current.state
    return found


def test_the_face_nears_the_drivers(grown: Run) -> None:
    """Within sixty frames of a head that has hardly turned, the model is at most 0.85 times as far off as the mean."""
    grown.finish()
    errors = [float(row.series["shape_error_mm"]) for row in grown.diagnostics]
    assert errors[0] == pytest.approx(error_mm(MEAN, 102))
    assert errors[-1] == pytest.approx(error_mm(growth_of(grown).shape, 102))
    assert errors[-1] < 0.85 * errors[0]


def test_the_tracker_uses_what_it_has_learned(grown: Run, state: PoseState) -> None:
    """The solid has the published points of the frame before, to the accuracy at which it is made again."""
    before: PoseState = grown.seek(grown.position - 1).state
    grown.finish()
    published = before.memory.growth.shape
    assert np.abs(published - MEAN).max() > 1.0
    assert np.abs(state.solid.points_mm - published).max() < 0.2
    assert np.array_equal(state.memory.model.points_mm, state.solid.points_mm)


def test_what_it_says_of_itself(grown: Run) -> None:
    """It reports share, probability, evidence, deviation and frames; nothing of that does a model that stays."""
    row = grown.diagnostics[-1].series
    assert 0.5 < float(row["own_share"]) <= 1.0
    assert 0.0 < float(row["own_probability"]) < 1.0
    assert row["shape_frames"] == 59
    assert float(row["shape_sd_mm"]) < float(grown.diagnostics[0].series["shape_sd_mm"])
    shares = [float(one.series["own_share"]) for one in grown.diagnostics]
    assert np.abs(np.diff(shares)).max() <= 1.0 / 30.0 + 1e-12
    usual = Run(HEAD, HEAD.simulate(), frames=2, timeline=(Change(0, {**SMALL, "face_model": "mean"}),))
    assert not {"own_share", "shape_error_mm", "free_energy"} & set(usual.finish().diagnostics.series)


def test_a_frozen_model_learns_no_more(grown: Run) -> None:
    """From the frame of the change on, the own face stays to the bit; thawed, it goes on."""
    frozen = grown.branch(40, {"model_frozen": True})
    learned = growth_of(frozen).own.shape
    frozen.seek(46)
    assert np.array_equal(growth_of(frozen).own.shape, learned)
    assert growth_of(frozen).own.frames == 40
    frozen.change({"model_frozen": False})
    frozen.seek(50)
    assert growth_of(frozen).own.frames == 44


def test_forgetting_may_begin_in_mid_run(grown: Run) -> None:
    """With a memory below 1 the model goes another way from there on; nothing of the past changes."""
    forgetting = grown.branch(40, {"model_memory": 0.9})
    forgetting.seek(59)
    assert forgetting.diagnostics[:41] == grown.diagnostics[:41]
    assert not np.array_equal(growth_of(forgetting).own.shape, growth_of(grown).own.shape)
    assert float(forgetting.diagnostics[-1].series["shape_error_mm"]) < error_mm(MEAN, 102)


def test_it_may_begin_and_end_in_mid_run() -> None:
    """Chosen in mid-run it begins with the mean face; given up, the mean face is back at once."""
    values = {**SMALL, "person": 102, "face_model": "mean", "hidden_weight": 0.0}
    run = Run(HEAD, HEAD.simulate(), seed=1, frames=16, timeline=(Change(0, values),))
    run.seek(4)
    assert run.current.state.memory.growth is None
    run.change({"face_model": "growing"})
    run.seek(10)
    assert growth_of(run).own.frames == 6
    run.change({"face_model": "mean", "upper_layer": "perspective"})
    run.finish()
    assert run.current.state.memory.growth is None
    assert np.array_equal(run.current.state.memory.model.points_mm, MEAN)


def test_another_focal_length_begins_the_model_again() -> None:
    """What was learned by another camera is given up, what was learned by the other upper layer is not."""
    run = run_of(14, **SMALL)
    run.seek(6)
    run.change({"upper_layer": "perspective"})
    run.seek(8)
    assert growth_of(run).own.frames == 8
    run.change({"focal_widths": 1.2})
    run.seek(10)
    assert growth_of(run).own.frames == 2
    assert growth_of(run).settings.focal_px == pytest.approx(1.2 * 320)


def test_what_is_not_recognised_teaches_nothing(state: PoseState) -> None:
    """A feature that is not recognised, or whose place is no number, has an infinite variance."""
    recognised = np.arange(COUNT) > 2
    sure, unlike, unknown = (variances(state, np.full(COUNT, it)) for it in (1.0, 0.75, np.nan))
    assert (unlike > sure + 5 * 99 * 0.2).all()
    hidden = variances(replace(state, recognised=recognised), np.ones(COUNT))
    assert np.array_equal(np.isfinite(hidden).all(axis=1), recognised)
    assert not np.isfinite(unknown).any()


def test_positions_are_as_sure_as_particles_and_templates_allow(state: PoseState) -> None:
    """The slip of a template grows with the face; a belief of few effective particles counts as less than it says."""
    near, nearer = (variances(state, np.ones(COUNT), size) for size in (54.0, 108.0))
    slip = (nearer - near) / 3.0
    assert slip == pytest.approx(np.full((COUNT, 2), slip[0, 0]))
    assert slip[0, 0] > 1.0
    told = np.maximum(state.feature_covariances.diagonal(axis1=1, axis2=2), 0.5**2)
    assert (near - slip > 1.005 * face_growth.PERSISTENCE * told)[state.recognised].all()


def test_frames_in_which_features_may_be_hidden_teach_nothing() -> None:
    """The face is learned only where it is clear that all features are seen."""
    given = {"person": 102, **SMALL}
    state, frame = whole_run(HEAD, seed=1, frames=12, values=given).current.state, simulated(14)[13]
    values, rival = revise(HEAD.simulate().parameters, given), state.belief.rival
    learned = []
    for log_odds in (15.0, -2.0, -15.0):
        belief = replace(state.belief, rival=replace(rival, doubting=False, log_odds=log_odds))
        after = HEAD.trackers["pf-asd"].step(replace(state, belief=belief), frame, values, Stream(1, 13, Purpose.TRACK))
        learned.append(not np.array_equal(after.memory.growth.shape, state.memory.growth.shape))
    assert learned == [False, False, True]


def learned_from(growth: Growing, state: PoseState) -> Growing:
    return face_growth.learn(growth, state, np.ones(COUNT), 54.0, revise(HEAD.simulate().parameters, SMALL))


def begun(state: PoseState) -> Growing:
    return face_growth.begin(mean_model(), state.solid.focal_px, revise(HEAD.simulate().parameters, SMALL))


def test_positions_are_taken_from_the_principal_point(state: PoseState) -> None:
    """The camera that is found for the face sees its points where they are in the picture."""
    own, solid = learned_from(begun(state), state).own, state.solid
    x, y, z = own.camera[:, :3] @ own.shape.T + own.camera[:, 3:]
    seen = solid.focal_px * np.column_stack([x, y]) / z[:, None] + solid.principal_px
    assert np.abs(seen - state.feature_means).max() < 5.0


def test_too_few_points_teach_nothing(state: PoseState) -> None:
    """With three features that are recognised the model stays as it was, the same object."""
    three, growth = replace(state, recognised=np.arange(COUNT) < 3), state.memory.growth
    assert learned_from(growth, three) is growth


def test_a_point_never_seen_stays_as_unsure_as_at_first(state: PoseState) -> None:
    """The nose, if never recognised, keeps a depth at the mean's and at least 0.9 of the deviation of people there."""
    growth, hidden = begun(state), replace(state, recognised=np.arange(COUNT) > 0)
    first = growth.covariances[0]
    for _ in range(30):
        growth = learned_from(growth, hidden)
    # What is published is partly the mean, which is off as people are.
    own = replace(growth, weight=1.0).covariances[0]
    assert np.sqrt(own[2, 2]) > 0.9 * np.sqrt(first[2, 2])


def test_it_goes_on_when_a_face_is_found_again() -> None:
    """A face that was covered and is found again is the same person: what was learned is kept, and learned on."""
    timeline = (
        Change(0, {"face_model": "growing", "person": 102, "find_again": True, "patience_frames": 2, **SMALL}),
        Change(12, {"hand_cover": 1.0, "pillar_width_px": 500.0}),
        Change(22, {"hand_cover": 0.0, "pillar_width_px": 0.0}),
    )
    run = Run(HEAD, HEAD.simulate(), seed=1, frames=44, timeline=timeline)
    lost = [step.state.memory.lost for step in run]
    assert any(lost)
    assert not lost[-1]
    assert growth_of(run).own.frames > 10
    assert growth_of(run).own.camera is not None
    assert np.isfinite(growth_of(run).shape).all()


def test_a_face_that_is_found_again_may_be_anywhere(state: PoseState) -> None:
    """Both cameras are given up, and what was learned of the shape is kept."""
    growth: Growing = state.memory.growth
    again = face_growth.widen_motion(growth)
    assert growth.own.camera is not None
    assert growth.mean_camera is not None
    assert (again.own.camera, again.mean_camera) == (None, None)
    assert np.array_equal(again.own.precision, growth.own.precision)


def test_frames_share_templates_in_relief() -> None:
    """They are the same for all frames, so that they are kept once."""
    first, *_, last = (step.state.memory for step in run_of(4, **SMALL, templates="relief"))
    assert first.reliefs is last.reliefs


def test_people_vary_as_they_are_drawn() -> None:
    """The covariance of the prior is that of people drawn from the statistics."""
    people = np.array([person(seed).points_mm.ravel() for seed in range(600)])
    drawn, said = np.cov(people.T), spread_mm2()
    assert np.sqrt(drawn.diagonal()) == pytest.approx(np.sqrt(said.diagonal()), rel=0.15)
    spread = np.sqrt(said.diagonal())
    assert np.abs(drawn - said).max() < 0.25 * (spread[:, None] * spread).max()
    assert np.linalg.eigvalsh(said).min() > 0.0


def test_it_may_begin_with_a_face_that_was_learned(grown: Run) -> None:
    """With what was exported it begins where that ended: nearer to the driver's face than the mean, from frame 0 on."""
    grown.finish()
    text = find_export(HEAD.exports, "face-json").make(grown.current.state, grown.diagnostics).decode()
    run = run_of(6, **SMALL, starting_face=text)
    learned = growth_of(grown).shape
    first = float(run.current.diagnostics.series["shape_error_mm"])
    assert first == pytest.approx(error_mm(learned, 102), abs=0.01)
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
def test_what_is_no_face_is_refused(text: str, words: str) -> None:
    """At the one door, with a sentence that names the parameter: not JSON, another number of points, no face, huge."""
    with pytest.raises(ParameterError, match=words) as caught:
        revise(HEAD.simulate().parameters, {"starting_face": text})
    assert caught.value.field == "starting_face"


def turned(driver: int) -> NDArray[np.float64]:
    return person(driver).points_mm @ rotation(np.array([0.3, -0.5, 0.2])).T


def test_a_face_that_was_brought_along_stays_the_same() -> None:
    """A change of something else leaves it as it is to the digit, or the model would begin again."""
    for driver in range(100, 140):
        first = revise(HEAD.simulate().parameters, {"starting_face": as_json(FEATURES, turned(driver)).decode()})
        assert revise(first, {"model_memory": 0.9}).starting_face == first.starting_face


def test_a_face_that_is_turned_is_turned_back() -> None:
    """A model in another pose and place is laid onto the mean face, as large as it is."""
    large = 1.1 * person(102).points_mm
    found = starting_model(as_json(FEATURES, 1.1 * turned(102) + (10.0, 200.0, -50.0)).decode()).points_mm
    onto = fit_similarity(large, MEAN)
    np.testing.assert_allclose(found, onto(large) / onto.scale, atol=1e-3)


# A growing face is drawn as it is: its points, colours by uncertainty, ellipsoids, and the mean face as a wire.

VALUES = {"face_model": "growing", "person": 102, "image_width_px": 320, "feature_noise_px": 3}


@pytest.fixture(scope="module")
def run() -> Run:
    return whole_run(HEAD, seed=1, frames=40, values=VALUES)


def worlds(run: Run, frame: int) -> dict[str, Any]:
    (world,) = HEAD.draw(run.seek(frame), run.diagnostics).worlds
    return dict(world.primitives)


def test_the_mean_head_becomes_the_persons(run: Run) -> None:
    """The surface begins as that of the mean face and ends as that of the model that the tracker uses."""
    first, last = (worlds(run, frame)["surface"].vertices for frame in (0, 39))
    mean = front(mean_model())
    np.testing.assert_allclose(first, mean.vertices_mm, atol=1e-4)
    np.testing.assert_allclose(last, front(run.current.state.memory.model).vertices_mm, atol=1e-4)
    assert np.abs(last - first).max() > 1.0
    assert np.array_equal(worlds(run, 39)["mean face"].segments, mean.vertices_mm.astype(np.float32)[mean.edges])


def test_it_is_coloured_by_how_sure_it_is(run: Run) -> None:
    """On the picture and in the world alike; surer with time, and least sure far from what is seen."""
    before, later = (worlds(run, frame)["surface"] for frame in (1, 39))
    drawing = HEAD.draw(run.current, run.diagnostics)
    assert later.layer == UNCERTAINTY
    assert np.array_equal(later.colour, drawing.primitives["head"].colour)
    points = run.current.state.memory.model.points_mm
    apart = np.linalg.norm(later.vertices[:, None] - points, axis=2).min(axis=1)
    # Viridis grows in green with the amount.
    assert later.colour[apart < 8, 1].mean() < before.colour[apart < 8, 1].mean() - 25
    assert later.colour[apart > 40, 1].mean() > later.colour[apart < 8, 1].mean() + 20
    # Far away nothing was seen, and it stays as unsure as it was.
    assert np.abs(later.colour[apart > 60].astype(int) - before.colour[apart > 60]).max() < 12


def test_points_carry_their_uncertainty(run: Run) -> None:
    """An ellipsoid for each of the eleven points, with the covariance of what is published."""
    ellipsoids = worlds(run, 39)["model ellipsoids"]
    memory = run.current.state.memory
    assert len(ellipsoids.centres) == len(FEATURES)
    np.testing.assert_allclose(ellipsoids.centres, memory.model.points_mm, atol=1e-4)
    np.testing.assert_allclose(ellipsoids.covariances, memory.growth.covariances, rtol=1e-4, atol=1e-4)


def test_a_lost_face_says_nothing_of_itself(run: Run) -> None:
    """It has the colour of what is lost, without ellipsoids."""
    step = run.seek(39)
    lost = replace(step.state, memory=replace(step.state.memory, lost_frames=2))
    (world,) = HEAD.draw(replace(step, state=lost), run.diagnostics).worlds
    assert "model ellipsoids" not in world.primitives
    assert world.primitives["surface"].is_uniform


def test_the_surface_is_taken_away_with_its_outside_out(run: Run) -> None:
    """In the frame of other programs, y up and z to the viewer, all triangles face away from the head's axis."""
    surface = surface_of(run.seek(39).state)
    corners = surface.vertices_mm[surface.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inside = np.array([0.0, 0.0, -90.0])
    assert ((normals * (corners.mean(axis=1) - inside)).sum(axis=1) > 0.0).all()


def test_the_points_are_taken_away_with_what_is_known_of_them(run: Run) -> None:
    """With standard deviations, the share of the own face, and the frames learned from; a model that stays has none."""
    state = run.seek(39).state
    said, growth = json.loads(points_of(state)), state.memory.growth
    variances = np.square([said["standard_deviations"][name] for name in FEATURES])
    np.testing.assert_allclose(variances, growth.covariances.diagonal(axis1=1, axis2=2), atol=1e-3)
    assert said["own_share"] == pytest.approx(growth.weight, abs=1e-4)
    assert said["frames"] == growth.own.frames
    assert 10 < growth.own.frames <= 39
    plain = Run(HEAD, HEAD.simulate(), frames=1, timeline=(Change(0, {**VALUES, "face_model": "mean"}),))
    assert not {"standard_deviations", "own_share"} & set(json.loads(points_of(plain.current.state)))
