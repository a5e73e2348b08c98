"""How often what is believed holds the truth: regions always, within their bounds, and lengths as often as is said."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.band import Miscalibration
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


def coverage(preset: str, tracker: str, seeds: range) -> float:
    """Return the share of frames after the first, and of lengths, in which the range that is told holds the truth."""
    held = []
    for seed in seeds:
        for row in run_of(preset, tracker, seed).diagnostics[1:]:
            for link in (1, 2, 3):
                low, high = row.vector(f"length_{link}") or (np.nan, np.nan)
                held.append(low <= row.number(f"true_length_{link}") <= high)
    return float(np.mean(held))


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["default", "cross", "static", "mirror2"])
def test_particles_hold_the_lengths_as_often_as_they_say(preset: str) -> None:
    """Their range of 95 % holds the truth in 90 % of the reports of six seeds at least."""
    assert coverage(preset, "particles", range(6)) >= 0.9


@pytest.mark.slow
@pytest.mark.parametrize(
    ("preset", "tracker"),
    [("3d", "particles"), ("two-1", "particles"), ("static", "ekf-truncated"), ("default", "ekf-mirrors")],
)
def test_where_ranges_are_too_narrow_it_is_declared(preset: str, tracker: str) -> None:
    """They hold the truth in less than 90 % of the reports, and a run says that they are not to be believed."""
    assert coverage(preset, tracker, range(2)) < 0.9
    parameters = revise(LINKAGE.simulate().parameters, PRESETS[preset])
    assert "overconfident" in LINKAGE.miscalibration((tracker, parameters))


@pytest.mark.parametrize("tracker", REGIONS)
def test_regions_hold_the_truth_in_the_scene_of_a_crossing(tracker: str) -> None:
    """The preset promises them how far off the beginning is and how fast the chain moves."""
    assert {row.number("contained") for row in run_of("cross", tracker, 1).diagnostics} == {1.0}
    assert "overconfident" not in LINKAGE.miscalibration((tracker, LINKAGE.simulate().parameters))


def against_lengths(parameters: Any) -> list[Miscalibration]:
    faults = [fault for fault in LINKAGE.quality.calibration.faults if fault.holds("particles", parameters)]
    return [fault for fault in faults if not fault.bands or "lengths" in fault.bands]


def test_what_is_not_declared_is_said_of_no_run() -> None:
    """Nothing is said against lengths of particles in the default scene; with noises as given, and elsewhere, it is."""
    parameters = LINKAGE.simulate().parameters
    assert against_lengths(parameters) == []
    for values in ({"noise_unknown": False}, {"chain_path": "two"}, {"chain_path": "cross"}, {"chain_path": "3d"}):
        assert against_lengths(revise(parameters, values))


# Regions of a chain hold the truth as long as noise and motion keep their bounds, whatever is known or changed.

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
