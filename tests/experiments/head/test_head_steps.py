"""Trackers of a head, step by step: what they say of a face that moves, is covered, or is seen in another light."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.core.numerics.matrices import pinhole
from pftrack.experiments.head import trackers as head
from pftrack.experiments.head.appearance import FirstSight, Form, around
from pftrack.experiments.head.detection import eye_distance
from pftrack.experiments.head.first_sight import fit_pose, solid_of
from pftrack.experiments.shared.pose import methods as pose
from pftrack.experiments.shared.pose.methods import METHODS, Method
from pftrack.vision.face import FEATURES, FaceModel, mean_model
from pftrack.vision.likelihoods import template
from tests.experiments.head.moving_face import (
    HEIGHT,
    NOTHING,
    POINTS,
    PX_PER_MM,
    WIDTH,
    begun,
    covered,
    grey,
    memory,
    parameters,
    similar,
    stepped,
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
    loose = {"sample_count": 10, "feature_noise_px": 12.0, "correlation_spread": 1.0}
    given = parameters(**loose)
    monkeypatch.setattr(head, "RECOGNISED_CORRELATION", 0.0)
    monkeypatch.setattr(head, "LARGEST_MISFIT", 2.0)
    state = begun("alpha-0", given)
    for index in range(1, 4):
        state = stepped(state, "alpha-0", given, index, grey(3 * index, 0))
    after = stepped(state, "alpha-0", given, 4, grey(12, 0))
    templates = memory(state).templates
    there = template.correlations(grey(12, 0), after.feature_means[:, None], templates)[:, 0]
    assert memory(after).correlations == pytest.approx(there, abs=1e-12)
    misfit = memory(after).misfit(after.project(after.solid.points_mm), after.feature_means)
    assert 0.02 < misfit < 2.0
    for limit, doubtful in ((misfit * (1 - 1e-9), 1), (misfit * (1 + 1e-9), 0)):
        monkeypatch.setattr(head, "LARGEST_MISFIT", limit)
        judged = stepped(state, "alpha-0", given, 4, grey(12, 0))
        assert memory(judged).doubtful_frames == doubtful


def test_covered_features_are_not_recognised() -> None:
    """What lies under something flat correlates with nothing; the rest of the face is followed all the same."""
    # If they were never hidden they would cling to what looks like them by chance.
    given = parameters(hidden_weight=0.25, sample_count=300)
    state = begun("pf-asd", given)
    names = ("lmou", "rmou")
    for index in range(1, 7):
        state = stepped(state, "pf-asd", given, index, covered(grey(), names))
    hidden = np.array([name in names for name in FEATURES])
    assert state.recognised.tolist() == (~hidden).tolist()
    assert memory(state).correlations[hidden].max() < 0.5
    found = head.TRACKERS["pf-asd"].measure(state)
    assert found["feature_recognised"] == tuple((~hidden).astype(float))
    assert found["correlation"] == tuple(memory(state).correlations.tolist())
    deviations = np.array(found["feature_sd_px"])
    assert deviations[hidden].min() > 1.5 * np.median(deviations[~hidden])
    # Nothing says where they are but the rest of the face, and that they are where they were.
    assert np.abs(state.feature_means - POINTS)[hidden].max() < 12
    assert np.abs(state.feature_means - POINTS)[~hidden].max() < 1.5
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
    given = parameters(hidden_weight=0.25)
    state = begun("pf-asd", given)
    for index in range(1, 4):
        state = stepped(state, "pf-asd", given, index, covered(grey(), ("lmou", "rmou")))
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
    off = np.where(np.arange(11) % 2, 4.0, -4.0)[:, None] * [1.0, 0.0]
    moved = replace(state.solid, points_mm=state.solid.points_mm + np.column_stack([off / PX_PER_MM, np.zeros(11)]))
    state = replace(state, solid=moved)
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
    points_mm = mean_model().points_mm
    symmetric = FaceModel((points_mm + points_mm[MIRRORED] * [-1, 1, 1]) / 2)
    points = similar(1.0, 0.15, (3.0, 5.0)) * [0.9, 1.0]
    mirrored = points[MIRRORED] * [-1, 1] + np.array([WIDTH, 0])
    form = Form("personal", "perspective", 1.2, 1.0)
    one, other = (solid_of(FirstSight(grey(), seen, symmetric), symmetric, form)[1] for seen in (points, mirrored))
    mirror = np.diag([-1.0, 1.0, 1.0])
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
