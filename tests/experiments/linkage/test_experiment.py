"""The experiment of a chain of links: what its presets promise, what a run says of itself, and bad values."""

import json
from functools import cache
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from pftrack.cli.app import app
from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change
from pftrack.core.model.tracker import Diagnostics
from pftrack.experiments import find
from pftrack.experiments.linkage.experiment import direction_error
from tests.making import whole_run

LINKAGE = find("linkage")


@cache
def rows(preset: str, tracker: str = "", seed: int = -1) -> tuple[Diagnostics, ...]:
    """Return the frames of a preset, with another tracker or another seed than its own if that is asked for."""
    chosen = LINKAGE.preset_named(preset)
    seed = chosen.seed if seed < 0 else seed
    run = whole_run(LINKAGE, values=chosen.parameters, tracker=tracker or chosen.tracker, seed=seed)
    return tuple(run.diagnostics)


def errors(preset: str) -> list[float]:
    return [row.error or 0.0 for row in rows(preset)]


@pytest.mark.parametrize(("preset", "split", "refuted"), [("mirror3", 63, 75), ("mirror2", 50, 54)])
def test_regions_split_and_one_is_refuted_when_it_is_said(preset: str, split: int, refuted: int) -> None:
    """There are two regions from the one frame to the other, and both frames are marked."""
    found = rows(preset)
    assert [row.frame for row in found if row.number("split")] == [split]
    assert [row.frame for row in found if row.number("refuted")] == [refuted]
    assert {row.number("hypothesis_count") for row in found[split:refuted]} == {2.0}
    assert {row.number("hypothesis_count") for row in found[refuted:]} == {1.0}
    assert {row.number("contained") for row in found} == {1.0}


def test_regions_are_lost_by_what_they_exclude_and_filters_by_their_estimate() -> None:
    """The middle of all that is possible may be far off while nothing true is excluded."""
    regions = rows("mirror3")
    assert max(errors("mirror3")) > 11.5
    assert not any(row.lost for row in regions)
    wrong = rows("mirror3", "ekf-truncated")
    assert [row.lost for row in wrong] == [(row.error or 0.0) > 11.5 for row in wrong]


def test_both_sides_are_followed_until_bounds_leave_one_behind() -> None:
    """The wrong side is ahead up to frame 35 and refuted soon; from frame 36 on the estimate is within 5 degrees."""
    found = errors("cross")
    assert min(found[27:36]) > 30.0
    assert max(found[36:]) < 5.0
    assert [row.frame for row in rows("cross") if row.number("refuted")] == [38, 39]


def test_a_filter_is_sure_of_a_wrong_length_and_a_region_is_not() -> None:
    """Of the same frames the filter makes half a pixel about 48 px, the region 14 px that hold the 50."""
    (low, high), (least, most) = (rows(preset)[-1].vector("length_3") for preset in ("static", "static-regions"))
    assert round(low) == round(high) == 48
    assert 0.3 < high - low < 0.6
    assert 13.0 < most - least < 15.0


def test_lengths_in_space_come_within_a_pixel() -> None:
    """Of the truth, all three."""
    found = np.array([rows("3d")[-1].vector(f"length_{link}") for link in (1, 2, 3)])
    assert np.abs(found - [[68.0], [58.0], [48.0]]).max() < 1.0


def said(*options: str) -> dict[str, Any]:
    """Return what `pftrack run linkage --json` says."""
    done = CliRunner().invoke(app, ["run", "linkage", "--json", *options])
    assert done.exit_code == 0, done.output
    return dict(json.loads(done.stdout.splitlines()[-1]))


def test_a_run_says_what_it_came_to() -> None:
    """Regions tell how often the truth was contained; all tell the intervals and the worst direction, in rad."""
    regions = said("--tracker", "ellipsoids", "--frames", "12")
    assert regions["contained_share"] == 1.0
    assert np.shape(regions["intervals_px"]) == (3, 2)
    assert regions["max_angle_error_rad"] == pytest.approx(np.deg2rad(max(errors("mirror3")[:12])))
    assert "contained_share" not in said("--tracker", "ekf", "--frames", "4")


@pytest.mark.parametrize("tracker", LINKAGE.trackers)
def test_all_trackers_cope_with_what_is_not_seen_and_with_outliers(tracker: str) -> None:
    """Points behind a strip are left out, frames that contradict all bounds are marked, and nothing ever ends a run."""
    values: dict[str, Value] = {"motion_bound_rad": 0, "outlier_share": 0.5, "outlier_px": 200, "sample_count": 200}
    timeline = (Change(8, {"occlusion_width_px": 640}), Change(10, {"occlusion_width_px": 0}))
    run = whole_run(LINKAGE, values=values, tracker=tracker, seed=2, frames=14, timeline=timeline)
    assert np.isfinite(run.diagnostics[-1].estimate).all()


def test_errors_of_directions_are_those_of_vectors() -> None:
    """A turn of one joint turns all that follow; in space a rotation turns all alike, and a full turn none."""
    straight = np.array([10.0, 20.0, 30.0, 70.0, 60.0, 50.0])
    for change, error in (([0, 5, 10, 0, 0, 0], 15.0), ([360, 0, 0, 0, 0, 0], 0.0)):
        assert direction_error(straight + np.array(change), straight) == pytest.approx(error, abs=1e-9)
    space = np.concatenate([np.zeros(5), straight - np.array([10.0, 0, 0, 0, 0, 0])])
    turned = space + np.array([0.0, 0.0, 25.0, *np.zeros(8)])
    np.testing.assert_allclose(direction_error(np.stack([turned, space]), space), [25.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("preset", ["cross", "3d"])
def test_particles_are_drawn_around_the_estimate(preset: str) -> None:
    """Both worlds show a cloud, of joints in depth and of lengths, where the estimate is."""
    values = {**LINKAGE.preset_named(preset).parameters, "sample_count": 60}
    run = whole_run(LINKAGE, values=values, tracker="particles", seed=1, frames=2)
    worlds = LINKAGE.draw(run.current, run.diagnostics).worlds
    for world, name, size in zip(worlds, ("joints", "estimate"), (0.4, 2.0), strict=True):
        cloud, estimate = world.primitives["particles"], world.primitives[name]
        assert 20 < len(cloud.positions) <= 300
        apart = np.linalg.norm(cloud.positions[:, None] - estimate.positions[None], axis=2).min(axis=1)
        assert np.median(apart) < size
