"""Trackers of a head, step by step: a face that moves, turns or is covered, and the memory of a tracker."""

from functools import partial

import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.recipe import Change
from pftrack.core.numerics.matrices import pinhole
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.head import appearance
from pftrack.experiments.head import trackers as head
from pftrack.experiments.head.appearance import around, template_sizes, widen
from pftrack.experiments.head.detection import eye_distance
from pftrack.experiments.head.first_sight import fit_pose
from pftrack.experiments.head.parameters import AS_PUBLISHED
from pftrack.experiments.shared.pose import methods as pose
from pftrack.experiments.shared.pose.methods import METHODS, Method
from pftrack.reproduce.head_turns import film, watch
from pftrack.runs.run import Run
from pftrack.vision.face import FEATURES, mean_model
from pftrack.vision.likelihoods import separation, template
from tests.experiments.head import moving_face
from tests.experiments.head.moving_face import POINTS, begun, covered, followed, grey, memory, parameters, stepped


@pytest.mark.parametrize("method", METHODS)
def test_a_still_face_stays_where_it_is(method: Method) -> None:
    """Angles stay near 0, features stay in place and are recognised, and no frame is doubtful."""
    given = parameters(joint_sample_count=3000)
    state = begun(method, given)
    for index in range(1, 7):
        state = stepped(state, method, given, index, grey())
        assert state.recognised.all()
        assert memory(state).doubtful_frames == 0
        assert memory(state).correlations.min() > (0.8 if method != "rb-pf" else 0.6)
    assert np.rad2deg(np.abs(state.estimate)).max() < 3
    assert np.abs(state.feature_means - POINTS).max() < (1.0 if method != "rb-pf" else 2.0)
    assert state.project(state.solid.points_mm) == pytest.approx(POINTS, abs=2.0)


def test_reports_are_of_the_current_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    """Correlations are those at the current estimates, whose misfit decides on doubt."""
    # Few particles with nearly equal weights, so that features lie beside their places.
    given = parameters(sample_count=10, feature_noise_px=12.0, correlation_spread=1.0)
    monkeypatch.setattr(head, "RECOGNISED_CORRELATION", 0.0)
    monkeypatch.setattr(head, "LARGEST_MISFIT", 2.0)
    state = followed("alpha-0", given, (grey(3 * index, 0) for index in range(1, 4)))
    after = stepped(state, "alpha-0", given, 4, grey(12, 0))
    there = template.correlations(grey(12, 0), after.feature_means[:, None], memory(state).templates)[:, 0]
    assert memory(after).correlations == pytest.approx(there, abs=1e-12)
    misfit = memory(after).misfit(after.project(after.solid.points_mm), after.feature_means)
    assert 0.02 < misfit < 2.0
    for limit, doubtful in ((misfit * (1 - 1e-9), 1), (misfit * (1 + 1e-9), 0)):
        monkeypatch.setattr(head, "LARGEST_MISFIT", limit)
        assert memory(stepped(state, "alpha-0", given, 4, grey(12, 0))).doubtful_frames == doubtful


def test_covered_features_are_not_recognised(monkeypatch: pytest.MonkeyPatch) -> None:
    """Features under a flat patch are not recognised and less certain; the rest of the face is followed.

    With nine of eleven features a face is doubtful only if ten are needed; its box then stays.
    """
    names = ("lmou", "rmou")
    state = followed("pf-asd", parameters(hidden_weight=0.25, sample_count=300), [covered(grey(), names)] * 6)
    hidden = np.isin(FEATURES, names)
    assert state.recognised.tolist() == (~hidden).tolist()
    assert memory(state).correlations[hidden].max() < 0.5
    found = head.TRACKERS["pf-asd"].measure(state)
    assert found["feature_recognised"] == tuple((~hidden).astype(float))
    assert found["correlation"] == tuple(memory(state).correlations.tolist())
    deviations, off = np.array(found["feature_sd_px"]), np.abs(state.feature_means - POINTS)
    assert deviations[hidden].min() > 1.5 * np.median(deviations[~hidden])
    # Only the rest of the face and their last places tell where they are.
    assert off[hidden].max() < 12
    assert off[~hidden].max() < 1.5
    for least in (9, 10):
        monkeypatch.setattr(head, "LEAST_RECOGNISED", least)
        judged = followed("pf-asd", parameters(hidden_weight=0.25), [covered(grey(), names)] * 3)
        assert (memory(judged).doubtful_frames > 0) == (least == 10)
        assert (memory(judged).box == around(judged.feature_means)) == (least == 9)


def test_templates_scale_with_the_face() -> None:
    """Their sizes are even, follow the distance of the eyes and end at 6 px.

    With twice the spread of correlations a log likelihood is a quarter.
    """
    for given in ((54,), (108, 0.5)):
        assert template_sizes(["nose", "lmou"], *given).tolist() == [[32, 20], [12, 12]]
    assert template_sizes(["nose"], 1).tolist() == [[6, 6]]
    points = POINTS[:, None] + np.array([[0.0, 0.0], [9.0, -7.0], [900.0, 0.0]])
    look = partial(template.correlations, grey(), templates=memory(begun("pf-asd", parameters())).templates)
    plain = head._log_likelihood(look, parameters(), points)
    assert plain[:, 0] == pytest.approx(np.zeros(11), abs=1e-6)
    assert head._log_likelihood(look, parameters(correlation_spread=0.3), points) == pytest.approx(plain / 4)


def test_templates_are_renewed_only_while_nothing_is_doubtful() -> None:
    """With renewal they change in a good frame, and stay the very same in a doubtful one."""
    given = parameters(template_renewal=0.1)
    state = begun("pf-asd", given)
    good = stepped(state, "pf-asd", given, 1, grey())
    assert memory(good).templates is not memory(state).templates
    bad = stepped(good, "pf-asd", given, 2, moving_face.NOTHING)
    assert memory(bad).templates is memory(good).templates


@pytest.mark.parametrize("upper", ["affine", "perspective"])
def test_the_solid_at_first_sight_is_where_the_features_are(upper: str) -> None:
    """At theta = 0 the affine camera sees every feature in its place; the pinhole to a tenth of the eye distance."""
    given = parameters(upper_layer=upper, focal_widths=1.3)
    state = begun("pf-asd", given)
    assert state.solid.focal_px == pytest.approx(1.3 * moving_face.WIDTH)
    assert state.solid.principal_px.tolist() == [moving_face.WIDTH / 2, moving_face.HEIGHT / 2]
    expected = state.solid.points_mm @ state.solid.reference[:, :3].T + state.solid.reference[:, 3]
    assert expected == pytest.approx(POINTS, abs=1e-6)
    away = np.abs(state.project(state.solid.points_mm, np.zeros(3)) - POINTS).max()
    assert away < (1e-6 if upper == "affine" else 0.1 * eye_distance(POINTS))
    assert state.solid.translation_mm[2] == pytest.approx(1.3 * moving_face.WIDTH / moving_face.PX_PER_MM, rel=0.1)


def test_the_pose_before_a_pinhole_is_found_exactly() -> None:
    """From the exact pixels of a turned face angles and place come back, to a hundredth of a degree and of a mm."""
    theta, place, focal = np.array([0.12, -0.2, 0.15]), np.array([30.0, -20.0, 600.0]), 700.0
    points_mm, principal = mean_model().points_mm, np.array([120.0, 100.0])
    pixels = pinhole(points_mm @ rotation(theta).T + place, focal) + principal
    first = pose.translation(points_mm, pixels, focal, principal)
    found, where = fit_pose(points_mm, pixels, focal, principal, first)
    assert np.rad2deg(found) == pytest.approx(np.rad2deg(theta), abs=0.01)
    assert where == pytest.approx(place, abs=0.01)


# Fast turns need templates in relief.


def test_a_fast_turn_is_followed_by_default() -> None:
    """The head turns by 35 degrees in half a second; flat templates lose it, those in relief do not."""
    clip = film(323, 26)
    flat, bent = (watch(clip, values, 0) for values in (AS_PUBLISHED, {}))
    assert bent.tracked_share == 1.0
    assert bent.errors_deg[0] < 5.0
    assert bent.errors_deg[0] < flat.errors_deg[0] / 2.0


def test_relief_may_be_chosen_in_mid_run() -> None:
    """Templates are laid onto the head, or taken off it, and the pose continues."""
    flat, bent = parameters(), parameters(templates="relief", slack_px=4.0)
    before = stepped(begun("pf-asd", flat), "pf-asd", flat, 1, grey(1, 0))
    laid = stepped(before, "pf-asd", bent, 2, grey(2, 0))
    after = stepped(laid, "pf-asd", flat, 3, grey(3, 0))
    assert [memory(state).reliefs is None for state in (before, laid, after)] == [True, False, True]
    small = stepped(laid, "pf-asd", revise(bent, {"template_scale": 0.5}), 3, grey(3, 0))
    least, most = (np.abs(memory(state).reliefs.points_mm).max() for state in (small, laid))
    assert least < 0.6 * most
    assert np.rad2deg(np.abs(after.estimate)).max() < 6


def test_a_look_computes_detail_where_it_is_needed() -> None:
    """In any order of places it gives the correlations with the detail of the whole picture."""
    sight = memory(begun("pf-asd", parameters())).sight
    bent = memory(begun("pf-asd", parameters(templates="relief"))).reliefs
    assert bent is not None
    views = separation.project_views(bent, np.tile([[1.1, 0.0, 0.0], [0.0, 1.1, 0.0]], (11, 1, 1)))
    look, whole = appearance.Look(grey(), sight, views), appearance.detail(grey(), sight)
    for shift in (0.0, 30.0, 5.0, -60.0, 500.0, np.nan):
        positions = (POINTS + shift)[:, None] + np.random.default_rng(1).uniform(-9.0, 9.0, (11, 8, 2))
        assert np.array_equal(look(positions), separation.correlations(whole, positions, views))


def test_a_moving_start_is_found() -> None:
    """A face that moves by 12 px a frame from the start is followed from its first picture on."""
    given = parameters(
        templates="relief", upper_layer="perspective", sample_count=50, slack_px=8.0, initial_speed_px=8.0
    )
    for seed in range(3):
        start = Stream(seed, 0, Purpose.START)
        state = head.start("pf-asd", moving_face.target(), moving_face.frame(0, grey()), given, start)
        for index in range(1, 4):
            picture = moving_face.frame(index, grey(-12 * index, 0))
            state = head.step("pf-asd", state, picture, given, Stream(seed, index, Purpose.TRACK))
        assert np.abs(np.median(state.feature_means - POINTS, axis=0) - (-36, 0)).max() < 2


HEAD = find("head")


def small_run(tracker: str, **values: Value) -> Run:
    timeline = (Change(0, {"image_width_px": 320, "feature_noise_px": 3, **values}),)
    return Run(HEAD, HEAD.simulate(), tracker=tracker, frames=12, timeline=timeline)


def test_the_misfit_of_a_face_is_a_median() -> None:
    """The median counts: five of eleven may be anywhere, six make a misfit. Without patience a face is never lost."""
    kept = memory(begun("pf-asd", parameters()))
    expected = kept.sight.points_px
    for count, misfit in ((5, 0.0), (6, 2.0)):
        moved = expected.copy()
        moved[:count, 0] += 2 * eye_distance(expected)
        assert kept.misfit(expected, moved) == pytest.approx(misfit)
    assert not kept.judge(np.zeros(11), expected, 0, doubtful=True).lost
    points = np.array([[10.0, 20.0], [50.0, 30.0], [30.0, 80.0]])
    assert around(points) == pytest.approx((30 - 45, 50 - 45, 90, 90)), "a square, 1.5 times as long as the points"


def test_the_bound_of_uncertainty_is_sixty_degrees() -> None:
    """A deviation below it only grows by a frame's noise, up to the bound."""
    nearly = Gaussian(np.zeros(3), np.deg2rad(59.5) ** 2 * np.eye(3))
    wider = widen(nearly, np.deg2rad(5.0))
    assert np.rad2deg(wider.standard_deviations) == pytest.approx([np.hypot(59.5, 5.0)] * 3)
    assert np.rad2deg(widen(wider, np.deg2rad(12.0)).standard_deviations) == pytest.approx([60.0] * 3)


@pytest.mark.parametrize("tracker", ["pf-asd", "rb-pf"])
@pytest.mark.parametrize(
    ("name", "value"),
    [("face_model", "personal"), ("upper_layer", "affine"), ("focal_widths", 1.0), ("template_scale", 0.6)],
)
def test_the_form_of_the_solid_may_change_in_mid_run(tracker: str, name: str, value: Value) -> None:
    """Solid and templates are then those of a run that began with the new value, and the pose continues."""
    beginning: dict[str, Value] = {"face_model": "mean", "joint_sample_count": 500}
    wanted = small_run(tracker, **{**beginning, name: value}).current.state
    run = small_run(tracker, **beginning)
    before = run.seek(10).state
    run.change({name: value})
    after = run.advance().state
    for field in ("points_mm", "reference", "focal_px", "principal_px", "translation_mm"):
        np.testing.assert_array_equal(getattr(after.solid, field), getattr(wanted.solid, field))
    np.testing.assert_array_equal(after.memory.templates.pixels, wanted.memory.templates.pixels)
    # With so few joint particles the pose jumps by some degrees from frame to frame.
    assert np.rad2deg(np.abs(after.estimate - before.estimate)).max() < (4.0 if tracker == "pf-asd" else 8.0)


def test_unrelated_sliders_leave_the_upper_layer_alone() -> None:
    """The focal length does not interrupt the motion of an affine camera, nor the size of templates any."""
    for upper, name in (("affine", "focal_widths"), ("perspective", "template_scale")):
        run = small_run("pf-asd", upper_layer=upper)
        state, given = run.seek(3).state, run.parameters_at(3)
        assert head._form(state, revise(given, {name: 0.9})).belief is state.belief


def test_a_change_of_method_applies_to_both_filters() -> None:
    """A change to the solid alone draws all particles from it, in the rival filter too."""
    given = parameters(hidden_weight=0.5)
    state = stepped(begun("pf-asd", given), "pf-asd", given, 1, grey(1, 0))
    state = stepped(state, "alpha-1", given, 2, grey(2, 0))
    rival = state.belief.rival
    assert (state.belief.alpha == 1.0).all()
    assert (rival.layers.mixture.ratios == 1.0).all()
    assert (rival.layers.features.upper_counts == given.sample_count).all()
