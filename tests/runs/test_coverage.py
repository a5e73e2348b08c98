"""Coverage is counted in each frame after the first, and its error treats a run as one observation."""

import math

import pytest

from pftrack.experiments import find
from pftrack.runs.coverage import count_held, measured_run, pool_counts


def test_every_frame_after_the_first_counts() -> None:
    """Each of the numbers of an estimate, by both shares."""
    run = measured_run(find("ball"), "kalman", "", 0, 5)
    run.finish()
    assert {share: total for share, (_, total) in count_held(run)["estimate"].items()} == {0.5: 8, 0.95: 8}


def test_a_setting_has_the_values_of_its_preset_and_another_scene_for_each_seed() -> None:
    """Where scenes have a number, the seed is added to it."""
    fish = find("fish")
    preset = fish.preset_named("rudder")
    parameters = measured_run(fish, "guided", "rudder", 3, 2).parameters_at(0)
    assert parameters.tank == preset.parameters["tank"]
    assert parameters.tank_number == fish.simulate().parameters.tank_number + 3


def test_the_error_knows_that_frames_of_a_run_are_alike() -> None:
    """Two runs of which one holds all and one nothing tell little, however long they are; two that agree have none."""
    apart = pool_counts([{"it": {0.5: (100, 100)}}, {"it": {0.5: (0, 100)}}])[0]
    assert (apart.share, apart.runs) == (0.5, 2)
    assert apart.error == pytest.approx(0.5)
    assert pool_counts([{"it": {0.5: (5, 10)}}, {"it": {0.5: (50, 100)}}])[0].error == 0.0
    assert math.isnan(pool_counts([{"it": {0.5: (5, 10)}}])[0].error)


def test_what_is_never_known_is_left_out() -> None:
    """A band without any number is no band of nothing."""
    assert pool_counts([{"it": {0.5: (0, 0)}}, {"other": {}}]) == ()
