"""How often what is believed holds the truth: regions always, within their bounds, and lengths as often as is said."""

from collections.abc import Mapping
from itertools import chain, product

import numpy as np
import pytest

from pftrack.core.model.band import Finding
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.recipe import Change
from pftrack.core.model.setup import Setup
from pftrack.experiments import find
from pftrack.runs.run import Run
from tests.making import whole_run

LINKAGE = find("linkage")
PRESETS: Mapping[str, Mapping[str, Value]] = {"default": {}, **{one.name: one.parameters for one in LINKAGE.presets}}
REGIONS = ("ellipsoids", "ellipsoids-literal", "box-guides")


def run_of(preset: str, tracker: str, seed: int) -> Run:
    return whole_run(LINKAGE, values=PRESETS[preset], tracker=tracker, seed=seed)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("preset", "tracker", "seeds"),
    [
        *((preset, "particles", 6) for preset in ("default", "cross", "static", "mirror2")),
        ("3d", "particles", 2),
        ("two-1", "particles", 2),
        ("static", "ekf-truncated", 2),
        ("default", "ekf-mirrors", 2),
    ],
)
def test_ranges_of_lengths_hold_the_truth_or_are_not_declared_right(preset: str, tracker: str, seeds: int) -> None:
    """Ranges of 95 % hold it in 90 % of the reports, or no run says that they are to be believed."""
    held = []
    for row, link in product(chain(*(run_of(preset, tracker, it).diagnostics[1:] for it in range(seeds))), (1, 2, 3)):
        low, high = row.vector(f"length_{link}") or (np.nan, np.nan)
        held.append(low <= row.number(f"true_length_{link}") <= high)
    assert (np.mean(held) >= 0.9) == (seeds == 6)
    assert seeds == 6 or declared(tracker, PRESETS[preset])["lengths"] != "right"


@pytest.mark.parametrize("tracker", REGIONS)
def test_regions_hold_the_truth_in_the_scene_of_a_crossing(tracker: str) -> None:
    """The preset promises them how far off the beginning is and how fast the chain moves."""
    assert {row.number("contained") for row in run_of("cross", tracker, 1).diagnostics} == {1.0}
    assert declared(tracker, {})["all that is possible"] == "right"


def declared(tracker: str, values: Mapping[str, Value]) -> dict[str, Finding]:
    return LINKAGE.findings(tracker, revise(LINKAGE.simulate().parameters, values))


def test_lengths_of_particles_are_right_in_the_default_scene_alone() -> None:
    """With noises as given, and on other paths, nobody knows."""
    assert declared("particles", {})["lengths"] == "right"
    for values in ({"noise_unknown": False}, {"chain_path": "two"}, {"chain_path": "3d"}):
        assert declared("particles", values)["lengths"] == "uncalibrated"


# Regions of a chain hold the truth as long as noise and motion keep their bounds, whatever is known or changed.


def contained(tracker: str, values: Mapping[str, Value], *timeline: Change, frames: int = 16) -> set[float]:
    """Return the values of `contained` in all frames of a run."""
    run = whole_run(LINKAGE, values=values, tracker=tracker, seed=3, frames=frames, timeline=timeline)
    return {row.number("contained") for row in run.diagnostics}


@pytest.mark.parametrize("tracker", REGIONS)
def test_a_change_of_scale_loses_nothing(tracker: str) -> None:
    """Angles take another scale up in mid-run, from 1 px a rad as well, which is the unit of lengths."""
    changes = ({"angle_scale_px": 55}, {"angle_scale_px": 1, "split_regions": False}, {"angle_scale_px": 200})
    timeline = [Change(frame, values) for frame, values in zip((6, 9, 12), changes, strict=True)]
    assert contained(tracker, {"angle_scale_px": 1}, *timeline) == {1.0}


@pytest.mark.parametrize("tracker", REGIONS)
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


@pytest.mark.parametrize("tracker", REGIONS)
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


@pytest.mark.parametrize("tracker", REGIONS)
def test_a_root_that_nobody_sees_is_contained(tracker: str) -> None:
    """In space the root moves on while the whole chain is hidden."""
    scene = LINKAGE.preset_named("3d").parameters
    hidden, seen = Change(4, {"occlusion_width_px": 640}), Change(14, {"occlusion_width_px": 0})
    assert contained(tracker, scene, hidden, seen, frames=18) == {1.0}
