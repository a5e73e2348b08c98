"""The head's own memory: templates by pose or renewed, and doubt."""

import numpy as np
import pytest

from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.recipe import Change
from pftrack.core.numerics.random import Gaussian
from pftrack.experiments import find
from pftrack.experiments.head import trackers as head
from pftrack.experiments.head.appearance import HeadMemory, around, widen
from pftrack.experiments.head.detection import eye_distance
from pftrack.experiments.head.parameters import AS_PUBLISHED
from pftrack.runs.run import Run
from tests.experiments.head.moving_face import begun, grey, parameters, stepped

HEAD = find("head")


def memory_after(frames: int, **values: Value) -> tuple[HeadMemory, HeadMemory]:
    timeline = (Change(0, {"image_width_px": 320, "feature_noise_px": 3, **values}),)
    run = Run(HEAD, HEAD.simulate(), seed=1, frames=frames, timeline=timeline)
    first = run.current.state.memory
    return first, run.finish().state.memory


def test_doubt_needs_patience() -> None:
    """A face is lost after as many doubtful frames in a row as patience allows, never without; a good one resets."""
    memory, _ = memory_after(1)
    points = memory.sight.points_px + 5
    for count in (1, 2):
        memory = memory.judge(np.zeros(11), points, 3, doubtful=True)
        assert (memory.doubtful_frames, memory.lost) == (count, False)
    assert memory.judge(np.zeros(11), points, 3, doubtful=True).lost
    assert not memory.judge(np.zeros(11), points, 0, doubtful=True).lost
    good = memory.judge(np.ones(11), points, 3, doubtful=False)
    assert good.doubtful_frames == 0
    assert good.box == around(points)
    assert memory.box != good.box


def test_one_feature_out_of_place_is_no_misfit() -> None:
    """The median counts: five of eleven may be anywhere, six make a misfit."""
    memory, _ = memory_after(1)
    expected = memory.sight.points_px
    for count, misfit in ((5, 0.0), (6, 2.0)):
        moved = expected.copy()
        moved[:count, 0] += 2 * eye_distance(expected)
        assert memory.misfit(expected, moved) == pytest.approx(misfit)


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
    beginning = {"face_model": "mean", "image_width_px": 320, "feature_noise_px": 3, "joint_sample_count": 500}
    begun = Run(HEAD, HEAD.simulate(), tracker=tracker, frames=12, timeline=(Change(0, {**beginning, name: value}),))
    run = Run(HEAD, HEAD.simulate(), tracker=tracker, frames=12, timeline=(Change(0, beginning),))
    before = run.seek(10).state
    run.change({name: value})
    after = run.advance().state
    wanted, got = begun.current.state.solid, after.solid
    for field in ("points_mm", "reference", "focal_px", "principal_px", "translation_mm"):
        np.testing.assert_array_equal(getattr(got, field), getattr(wanted, field))
    sets = (state.memory.templates for state in (begun.current.state, after))
    np.testing.assert_array_equal(*(templates.pixels for templates in sets))
    # Five hundred joint particles of 22 numbers are few: they jump by some degrees from frame to frame.
    assert np.rad2deg(np.abs(after.estimate - before.estimate)).max() < (4.0 if tracker == "pf-asd" else 8.0)


@pytest.mark.parametrize(
    ("tracker", "beginning", "name", "value"),
    [
        ("pf-asd", AS_PUBLISHED, "focal_widths", 1.2),
        ("rb-pf", {**AS_PUBLISHED, "joint_sample_count": 500}, "focal_widths", 1.2),
        ("rb-pf", {"joint_sample_count": 500}, "template_scale", 0.9),
        ("pf-asd", {"upper_layer": "perspective"}, "template_scale", 0.9),
    ],
)
def test_what_the_upper_layer_does_not_read_leaves_it_alone(
    tracker: str, beginning: dict[str, Value], name: str, value: Value
) -> None:
    """Its motion is not interrupted by the slider of something else."""
    timeline = (Change(0, {"image_width_px": 320, "feature_noise_px": 3, **beginning}),)
    run = Run(HEAD, HEAD.simulate(), tracker=tracker, frames=12, timeline=timeline)
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
