"""Regions of a chain hold the truth as long as noise and motion keep their bounds, whatever is known or changed."""

from collections.abc import Mapping

import pytest

from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.recipe import Change
from pftrack.core.model.setup import Setup
from pftrack.experiments import find
from pftrack.runs.run import Run
from tests.making import whole_run

LINKAGE = find("linkage")
TRACKERS = ("ellipsoids", "ellipsoids-literal", "box-guides")


def contained(tracker: str, values: Mapping[str, Value], *timeline: Change, frames: int = 16) -> set[float]:
    """Return the values of `contained` in all frames of a run."""
    run = whole_run(LINKAGE, values=values, tracker=tracker, seed=3, frames=frames, timeline=timeline)
    return {row.number("contained") for row in run.diagnostics}


@pytest.mark.parametrize("tracker", TRACKERS)
def test_a_change_of_scale_loses_nothing(tracker: str) -> None:
    """Angles take another scale up in mid-run, from 1 px a rad as well, which is the unit of lengths."""
    changes = (
        Change(6, {"angle_scale_px": 55}),
        Change(9, {"angle_scale_px": 1, "split_regions": False}),
        Change(12, {"angle_scale_px": 200}),
    )
    assert contained(tracker, {"angle_scale_px": 1}, *changes) == {1.0}


@pytest.mark.parametrize("tracker", TRACKERS)
@pytest.mark.parametrize(
    "values",
    [
        {f"length_{i}_{end}_px": length for i, length in ((1, 70), (2, 60), (3, 50)) for end in ("low", "high")},
        {"true_length_2_px": 70, "length_difference_12_px": 0, "length_difference_23_px": 20},
        {"start_angle_bound_rad": 0, "start_length_bound_px": 0},
        {"chain_path": "static", "motion_bound_rad": 0, "start_angle_bound_rad": 0, "angle_scale_px": 1},
        {"measurement_noise_px": 0, "error_bound_px": 0},
    ],
    ids=["lengths", "difference", "beginning", "still", "observed"],
)
def test_what_is_known_exactly_is_contained_too(tracker: str, values: Mapping[str, Value]) -> None:
    """Lengths that are known, or equal, a known beginning, a chain that stands still, points without any error."""
    assert contained(tracker, values) == {1.0}


@pytest.mark.parametrize("tracker", TRACKERS)
def test_what_contradicts_a_bound_is_not_known_exactly(tracker: str) -> None:
    """A beginning outside the bounds comes to them as wide as it was; the picture says that the truth is excluded."""
    setup = LINKAGE.simulate()
    values = {"true_length_1_px": 110, "start_length_bound_px": 8}
    setup = Setup(setup.open_source, revise(setup.parameters, values), success=setup.success)
    run = Run(LINKAGE, setup, tracker=tracker, seed=3, frames=2)
    first = run.diagnostics[0]
    assert first.vector("length_1") == pytest.approx((64.0, 80.0))
    assert first.number("contained") == 0.0
    assert "truth excluded" in LINKAGE.draw(run.current, run.diagnostics).caption


@pytest.mark.parametrize("tracker", TRACKERS)
def test_a_root_that_nobody_sees_is_contained(tracker: str) -> None:
    """In space the root moves on while the whole chain is hidden."""
    scene = LINKAGE.preset_named("3d").parameters
    hidden, seen = Change(4, {"occlusion_width_px": 640}), Change(14, {"occlusion_width_px": 0})
    assert contained(tracker, scene, hidden, seen, frames=18) == {1.0}
