"""Trackers of a head, step by step: a face that moves, turns, is covered or seen in another light, and their memory."""

from dataclasses import replace
from functools import cache, partial

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
from pftrack.experiments.head.appearance import SIZES_PX, FirstSight, Form, around, template_sizes, widen
from pftrack.experiments.head.detection import eye_distance
from pftrack.experiments.head.first_sight import fit_pose, solid_of
from pftrack.experiments.head.parameters import AS_PUBLISHED
from pftrack.experiments.head.recording import defaults
from pftrack.experiments.shared.pose import methods as pose
from pftrack.experiments.shared.pose.methods import METHODS, Method
from pftrack.reproduce.head_turns import Clip, film, watch
from pftrack.runs.run import Run
from pftrack.vision.face import FEATURES, FaceModel, mean_model
from pftrack.vision.likelihoods import separation, template
from tests.experiments.head.moving_face import (
    HEIGHT,
    NOTHING,
    POINTS,
    PX_PER_MM,
    WIDTH,
    begun,
    covered,
    followed,
    frame,
    grey,
    memory,
    parameters,
    similar,
    stepped,
    target,
)


@pytest.mark.parametrize("method", METHODS)
def test_a_still_face_stays_where_it_is(method: Method) -> None:
    """Without any motion the angles stay near 0, the features at their places, recognised, with nothing doubtful."""
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


@pytest.mark.parametrize("method", METHODS)
def test_where_the_face_is_in_the_picture_does_not_matter(method: Method) -> None:
    """With the same random numbers features move as the picture does; pose, correlations and evidence stay."""
    given = parameters()
    here, there = begun(method, given), begun(method, given, 16, -8)
    for index in range(1, 5):
        here = stepped(here, method, given, index, grey(index, index))
        there = stepped(there, method, given, index, grey(16 + index, -8 + index))
        assert there.feature_means - here.feature_means == pytest.approx(np.tile([16.0, -8.0], (11, 1)), abs=1e-5)
        assert there.estimate == pytest.approx(here.estimate, abs=1e-6)
        assert there.log_evidence == pytest.approx(here.log_evidence, abs=1e-3)
        assert memory(there).correlations == pytest.approx(memory(here).correlations, abs=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_light_does_not_matter(method: Method) -> None:
    """A picture of half the contrast that is 60 levels brighter is the same one to normalised correlations."""
    given = parameters()
    one = other = begun(method, given)
    for index in range(1, 5):
        picture = grey(index, 0)
        one = stepped(one, method, given, index, picture)
        other = stepped(other, method, given, index, picture // 2 + 60)
        assert other.feature_means == pytest.approx(one.feature_means, abs=1e-3)
        assert other.estimate == pytest.approx(one.estimate, abs=1e-4)
        assert other.recognised.tolist() == one.recognised.tolist()


def test_what_is_reported_is_of_this_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    """Correlations are those at the positions that are estimated now, and doubt is about these positions."""
    # Few particles that are weighed but a little, so that features lie beside their places.
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


def test_covered_features_are_not_recognised() -> None:
    """What lies under something flat correlates with nothing; the rest of the face is followed all the same."""
    # If they were never hidden they would cling to what looks like them by chance.
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
    # Nothing says where they are but the rest of the face, and that they are where they were.
    assert off[hidden].max() < 12
    assert off[~hidden].max() < 1.5
    assert memory(state).doubtful_frames == 0


def test_a_wider_spread_is_less_sure() -> None:
    """With twice the spread of correlations a log likelihood is a quarter."""
    picture, points = grey(), POINTS[:, None] + np.array([[0.0, 0.0], [9.0, -7.0], [900.0, 0.0]])
    templates = memory(begun("pf-asd", parameters())).templates
    look = partial(template.correlations, picture, templates=templates)
    plain = head._log_likelihood(look, parameters(), points)
    assert plain[:, 0] == pytest.approx(np.zeros(11), abs=1e-6)
    assert head._log_likelihood(look, parameters(correlation_spread=0.3), points) == pytest.approx(plain / 4)


@pytest.mark.parametrize(("least", "doubtful"), [(9, False), (10, True)])
def test_a_face_is_doubtful_with_too_few_features(least: int, doubtful: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """With nine of eleven features to be seen it is one if nine make a face, and doubtful if ten do."""
    monkeypatch.setattr(head, "LEAST_RECOGNISED", least)
    state = followed("pf-asd", parameters(hidden_weight=0.25), [covered(grey(), ("lmou", "rmou"))] * 3)
    assert int(state.recognised.sum()) == 9
    assert (memory(state).doubtful_frames > 0) == doubtful
    assert (memory(state).box == around(state.feature_means)) == (not doubtful)


@pytest.mark.parametrize(("largest", "doubtful"), [(0.02, True), (2.0, False)])
def test_a_face_is_doubtful_with_features_out_of_place(
    largest: float, doubtful: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Features that fit no pose are all recognised, and doubtful if they are further off than is allowed."""
    monkeypatch.setattr(head, "LARGEST_MISFIT", largest)
    given = parameters()
    state = begun("alpha-0", given)
    # Every other feature a little to the left: no affine camera sees the face like that.
    off = np.where(np.arange(11) % 2, 4.0, -4.0)[:, None] * [1.0 / PX_PER_MM, 0.0, 0.0]
    state = replace(state, solid=replace(state.solid, points_mm=state.solid.points_mm + off))
    after = stepped(state, "alpha-0", given, 1, grey())
    assert after.recognised.all()
    assert (memory(after).doubtful_frames == 1) == doubtful


def test_templates_are_renewed_only_while_nothing_is_doubtful() -> None:
    """With renewal they change in a good frame, and stay the very same in a doubtful one."""
    given = parameters(template_renewal=0.1)
    state = begun("pf-asd", given)
    good = stepped(state, "pf-asd", given, 1, grey())
    assert memory(good).templates is not memory(state).templates
    bad = stepped(good, "pf-asd", given, 2, NOTHING)
    assert memory(bad).templates is memory(good).templates


SIDES = {"l": "r", "r": "l"}
MIRRORED = [FEATURES.index(SIDES.get(name[0], name[0]) + name[1:]) for name in FEATURES]


def test_a_mirrored_face_is_seen_by_the_mirrored_camera() -> None:
    """Of a face in the middle of a mirrored picture the turn and the roll change sign, and the nod does not."""
    points_mm, mirror = mean_model().points_mm, np.diag([-1.0, 1.0, 1.0])
    symmetric = FaceModel((points_mm + points_mm[MIRRORED] @ mirror) / 2)
    points = similar(1.0, 0.15, (3.0, 5.0)) * [0.9, 1.0]
    mirrored = points[MIRRORED] * [-1, 1] + np.array([WIDTH, 0])
    form = Form("personal", "perspective", 1.2, 1.0)
    one, other = (solid_of(FirstSight(grey(), seen, symmetric), symmetric, form)[1] for seen in (points, mirrored))
    assert other == pytest.approx(mirror @ one @ mirror, abs=1e-6)
    assert np.abs(one - np.eye(3)).max() > 0.1


@pytest.mark.parametrize("upper", ["affine", "perspective"])
def test_the_solid_at_first_sight_is_where_the_features_are(upper: str) -> None:
    """At theta = 0 the affine camera sees every feature where it was; the pinhole does to a tenth of the eyes."""
    given = parameters(upper_layer=upper, focal_widths=1.3)
    state = begun("pf-asd", given)
    assert state.solid.focal_px == pytest.approx(1.3 * WIDTH)
    assert state.solid.principal_px.tolist() == [WIDTH / 2, HEIGHT / 2]
    expected = state.solid.points_mm @ state.solid.reference[:, :3].T + state.solid.reference[:, 3]
    assert expected == pytest.approx(POINTS, abs=1e-6)
    away = np.abs(state.project(state.solid.points_mm, np.zeros(3)) - POINTS).max()
    assert away < (1e-6 if upper == "affine" else 0.1 * eye_distance(POINTS))
    assert state.solid.translation_mm[2] == pytest.approx(1.3 * WIDTH / PX_PER_MM, rel=0.1)


def test_the_pose_before_a_pinhole_is_found_exactly() -> None:
    """From the exact pixels of a turned face angles and place come back, to a hundredth of a degree and of a mm."""
    theta, place, focal = np.array([0.12, -0.2, 0.15]), np.array([30.0, -20.0, 600.0]), 700.0
    points_mm, principal = mean_model().points_mm, np.array([120.0, 100.0])
    pixels = pinhole(points_mm @ rotation(theta).T + place, focal) + principal
    first = pose.translation(points_mm, pixels, focal, principal)
    found, where = fit_pose(points_mm, pixels, focal, principal, first)
    assert np.rad2deg(found) == pytest.approx(np.rad2deg(theta), abs=0.01)
    assert where == pytest.approx(place, abs=0.01)


# Fast turns: what templates in relief are for.

RELIEVED = parameters(templates="relief")


@cache
def clip(person: int, frames: int) -> Clip:
    return film(person, frames)


def test_a_fast_turn_is_followed_by_default() -> None:
    """Within half a second the head turns by 35 degrees; flat templates are left behind, those in relief are not."""
    flat, bent = (watch(clip(323, 26), values, 0) for values in (AS_PUBLISHED, {}))
    assert bent.tracked_share == 1.0
    assert bent.errors_deg[0] < 5.0
    assert bent.errors_deg[0] < flat.errors_deg[0] / 2.0


@pytest.mark.slow
@pytest.mark.parametrize("person", [321, 323, 324])
def test_no_seed_loses_a_fast_head(person: int) -> None:
    """The yaw is right to 5 degrees and the head tracked in 95 % of the frames, with the worst of twenty seeds."""
    outcomes = [watch(clip(person, 150), {}, seed) for seed in range(20)]
    assert max(outcome.errors_deg[0] for outcome in outcomes) <= 5.0
    assert min(outcome.tracked_share for outcome in outcomes) >= 0.95


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("camera", ["affine", "perspective"])
def test_a_face_that_only_moves_keeps_its_pose(method: Method, camera: str) -> None:
    """Every method and either camera may have templates in relief."""
    given = parameters(templates="relief", upper_layer=camera, slack_px=4.0, initial_speed_px=2.0)
    state = followed(method, given, (grey(2 * index, index) for index in range(1, 6)))
    assert memory(state).reliefs is not None
    assert np.rad2deg(np.abs(state.estimate)).max() < 6
    assert np.abs(state.feature_means - POINTS - (10, 5)).max() < 6
    assert memory(state).correlations.min() > 0.6


def test_relief_may_be_chosen_in_mid_run() -> None:
    """Templates are laid onto the head, or taken off it, and the pose goes on from where it was."""
    flat, bent = parameters(), parameters(templates="relief", slack_px=4.0)
    before = stepped(begun("pf-asd", flat), "pf-asd", flat, 1, grey(1, 0))
    laid = stepped(before, "pf-asd", bent, 2, grey(2, 0))
    after = stepped(laid, "pf-asd", flat, 3, grey(3, 0))
    assert [memory(state).reliefs is None for state in (before, laid, after)] == [True, False, True]
    small = stepped(laid, "pf-asd", revise(bent, {"template_scale": 0.5}), 3, grey(3, 0))
    least, most = (np.abs(memory(state).reliefs.points_mm).max() for state in (small, laid))
    assert least < 0.6 * most
    assert np.rad2deg(np.abs(after.estimate)).max() < 6


@pytest.mark.parametrize(
    "part", [(0, 0, 240, 200), (60, 50, 130, 120), (0, 150, 9, 200), (231, 0, 240, 3), (9, 9, 9, 9)]
)
def test_detail_is_the_same_in_every_part(part: separation.Part) -> None:
    """The local mean at the border of a part is taken over what lies beyond it."""
    sight = memory(begun("pf-asd", parameters())).sight
    left, top, right, bottom = part
    whole, found = appearance.detail(grey(), sight), appearance.detail(grey(), sight, part)
    assert found.shape == whole.shape
    assert np.array_equal(found[top:bottom, left:right], whole[top:bottom, left:right])


def test_where_one_looks_does_not_change_what_is_seen() -> None:
    """A look finds detail where it is asked for: here, beside it, within both, and wherever somebody asks for more."""
    sight, bent = memory(begun("pf-asd", parameters())).sight, memory(begun("pf-asd", RELIEVED)).reliefs
    assert bent is not None
    views = separation.project_views(bent, np.tile([[1.1, 0.0, 0.0], [0.0, 1.1, 0.0]], (11, 1, 1)))
    look, whole = appearance.Look(grey(), sight, views), appearance.detail(grey(), sight)
    for shift in (0.0, 30.0, 5.0, -60.0, 500.0, np.nan):
        positions = (POINTS + shift)[:, None] + np.random.default_rng(1).uniform(-9.0, 9.0, (11, 8, 2))
        assert np.array_equal(look(positions), separation.correlations(whole, positions, views))


def test_flat_templates_know_nothing_of_slack_and_speed() -> None:
    """What belongs to templates in relief changes no bit of Bando's trackers."""
    plain, other = parameters(), parameters(slack_px=30.0, initial_speed_px=20.0, pose_change_noise=9.0)
    first, second = (stepped(begun("pf-asd", given), "pf-asd", given, 1, grey(1, 1)) for given in (plain, other))
    assert np.array_equal(first.feature_means, second.feature_means)
    assert np.array_equal(first.estimate, second.estimate)


def test_a_moving_start_is_found() -> None:
    """A face that is already moving by 12 px a frame is followed from its first picture on."""
    given = parameters(
        templates="relief", upper_layer="perspective", sample_count=50, slack_px=8.0, initial_speed_px=8.0
    )
    for seed in range(5):
        state = head.start("pf-asd", target(), frame(0, grey()), given, Stream(seed, 0, Purpose.START))
        for index in range(1, 4):
            picture = frame(index, grey(-12 * index, 0))
            state = head.step("pf-asd", state, picture, given, Stream(seed, index, Purpose.TRACK))
        assert np.abs(np.median(state.feature_means - POINTS, axis=0) - (-36, 0)).max() < 2


@pytest.mark.parametrize(("rate_hz", "noise"), [(30.0, 1.0), (12.0, 6.25), (25.0, 1.44), (120.0, 0.25), (2.0, 20.0)])
def test_a_recording_says_how_fast_a_turn_may_change(rate_hz: float, noise: float) -> None:
    """The change of speed between two pictures grows with the square of the time, and not with the face."""
    for size in (0.5, 2.0):
        found = defaults(size * POINTS, rate_hz)
        assert found.pose_change_noise == pytest.approx(noise)
        values: dict[str, Value] = {"templates": "relief"}
        assert revise(found, values).slack / size == pytest.approx(defaults(POINTS, rate_hz).slack_px)


# Sizes of the templates of a face's features.


def test_sizes_are_those_of_the_table_and_scale_with_the_face() -> None:
    """At 108 px between the eyes the sizes are those of table 4.1; on a face half as large, half of them."""
    assert np.array_equal(template_sizes(FEATURES, 108), list(SIZES_PX.values()))
    for given in ((54,), (108, 0.5)):
        assert template_sizes(["nose", "lmou"], *given).tolist() == [[32, 20], [12, 12]]
    assert template_sizes(["nose"], 1).tolist() == [[6, 6]]


# The head's own memory: templates by pose or renewed, and doubt.

HEAD = find("head")


def small_run(tracker: str, **values: Value) -> Run:
    timeline = (Change(0, {"image_width_px": 320, "feature_noise_px": 3, **values}),)
    return Run(HEAD, HEAD.simulate(), tracker=tracker, frames=12, timeline=timeline)


def test_doubt_needs_patience() -> None:
    """A face is lost after as many doubtful frames in a row as patience allows, never without; a good one resets."""
    kept = memory(begun("pf-asd", parameters()))
    points = kept.sight.points_px + 5
    for count in (1, 2):
        kept = kept.judge(np.zeros(11), points, 3, doubtful=True)
        assert (kept.doubtful_frames, kept.lost) == (count, False)
    assert kept.judge(np.zeros(11), points, 3, doubtful=True).lost
    assert not kept.judge(np.zeros(11), points, 0, doubtful=True).lost
    good = kept.judge(np.ones(11), points, 3, doubtful=False)
    assert good.doubtful_frames == 0
    assert good.box == around(points) != kept.box


def test_one_feature_out_of_place_is_no_misfit() -> None:
    """The median counts: five of eleven may be anywhere, six make a misfit."""
    kept = memory(begun("pf-asd", parameters()))
    expected = kept.sight.points_px
    for count, misfit in ((5, 0.0), (6, 2.0)):
        moved = expected.copy()
        moved[:count, 0] += 2 * eye_distance(expected)
        assert kept.misfit(expected, moved) == pytest.approx(misfit)


def test_the_box_of_a_face_is_half_as_large_again_as_its_features() -> None:
    """A square about the middle of the points, one and a half times as long as their longer extent."""
    points = np.array([[10.0, 20.0], [50.0, 30.0], [30.0, 80.0]])
    assert around(points) == pytest.approx((30 - 45, 50 - 45, 90, 90))


def test_the_bound_of_uncertainty_is_sixty_degrees() -> None:
    """A belief that is a little surer than that stays what it is, with a frame's noise more."""
    nearly = Gaussian(np.zeros(3), np.deg2rad(59.5) ** 2 * np.eye(3))
    wider = widen(nearly, np.deg2rad(5.0))
    assert np.rad2deg(wider.standard_deviations) == pytest.approx([np.hypot(59.5, 5.0)] * 3)
    assert np.rad2deg(widen(wider, np.deg2rad(12.0)).standard_deviations) == pytest.approx([60.0] * 3)


@pytest.mark.parametrize("tracker", ["pf-asd", "rb-pf"])
@pytest.mark.parametrize(
    ("name", "value"),
    [("face_model", "personal"), ("upper_layer", "affine"), ("focal_widths", 1.0), ("template_scale", 0.6)],
)
def test_what_was_made_at_first_sight_can_be_chosen_anew(tracker: str, name: str, value: Value) -> None:
    """Solid and templates are then those of a run that began so, and the pose goes on from where it was."""
    beginning: dict[str, Value] = {"face_model": "mean", "joint_sample_count": 500}
    wanted = small_run(tracker, **{**beginning, name: value}).current.state
    run = small_run(tracker, **beginning)
    before = run.seek(10).state
    run.change({name: value})
    after = run.advance().state
    for field in ("points_mm", "reference", "focal_px", "principal_px", "translation_mm"):
        np.testing.assert_array_equal(getattr(after.solid, field), getattr(wanted.solid, field))
    np.testing.assert_array_equal(after.memory.templates.pixels, wanted.memory.templates.pixels)
    # Five hundred joint particles of 22 numbers are few: they jump by some degrees from frame to frame.
    assert np.rad2deg(np.abs(after.estimate - before.estimate)).max() < (4.0 if tracker == "pf-asd" else 8.0)


@pytest.mark.parametrize(
    ("tracker", "beginning", "name", "value"),
    [
        ("pf-asd", AS_PUBLISHED, "focal_widths", 1.2),
        ("rb-pf", AS_PUBLISHED, "focal_widths", 1.2),
        ("rb-pf", {}, "template_scale", 0.9),
        ("pf-asd", {"upper_layer": "perspective"}, "template_scale", 0.9),
    ],
)
def test_what_the_upper_layer_does_not_read_leaves_it_alone(
    tracker: str, beginning: dict[str, Value], name: str, value: Value
) -> None:
    """Its motion is not interrupted by the slider of something else."""
    run = small_run(tracker, joint_sample_count=500, **beginning)
    state, parameters = run.seek(10).state, run.parameters_at(10)
    assert head._form(state, revise(parameters, {name: value})).belief is state.belief


def test_a_method_has_its_ratios_in_both_filters() -> None:
    """Who goes over to the solid alone draws all particles from it, in the filter that is not believed as well."""
    given = parameters(hidden_weight=0.5)
    state = stepped(begun("pf-asd", given), "pf-asd", given, 1, grey(1, 0))
    state = stepped(state, "alpha-1", given, 2, grey(2, 0))
    rival = state.belief.rival
    assert (state.belief.alpha == 1.0).all()
    assert (rival.layers.mixture.ratios == 1.0).all()
    assert (rival.layers.features.upper_counts == given.sample_count).all()
