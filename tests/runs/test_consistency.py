"""Coverage of bands, consistency of errors with the deviations told, and the probability of a loss."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pftrack
from pftrack.core.model.band import Calibration, EstimateBand
from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change
from pftrack.core.numerics.statistics import chi_square_limit
from pftrack.experiments import find
from pftrack.experiments.experiment import Quality
from pftrack.experiments.shared.loss_probability import Scenes, read_declaration
from pftrack.runs.coverage import Consistency, count_held, measure_consistency, measured_run, pool_counts
from pftrack.runs.loss_probability import LossAccount, loss_probabilities
from pftrack.runs.run import Run
from tools.loss_probability import describe_models, write_models


def signal(tracker: str = "kalman", seed: int = 4, **values: Any) -> Run:
    run = pftrack.run("sine", tracker=tracker, seed=seed, **values)
    run.finish()
    return run


def test_a_filter_that_is_right_is_within_the_limits() -> None:
    """Its innovations are independent, so that their sum is a chi-square variable of as many degrees of freedom."""
    found = measure_consistency([signal()])
    limits = tuple(round(chi_square_limit(360, level) / 360, 6) for level in (0.025, 0.975))
    assert found.nis_limits == limits
    assert limits[0] < found.nis < limits[1]
    assert 0.2 < found.nees < 5.0


def test_it_is_the_mean_of_squares_in_deviations() -> None:
    """Over all coordinates of some frames, and over the numbers that were measured in them."""
    run = signal(dimension=2)
    found = measure_consistency([run], 10, 60)
    rows = run.diagnostics[10:60]
    errors = np.array([np.subtract(row.estimate, row.truth or ()) for row in rows])
    assert found.nees == pytest.approx(np.mean((errors / [row.sigma for row in rows]) ** 2))
    assert found.nis == pytest.approx(sum(row.number("nis") for row in rows) / 100)


def test_assumed_noise_sets_it() -> None:
    """A measurement noise that is taken four times too large makes both far too small."""
    found = measure_consistency([signal(assumed_noise_sd=0.4, process_noise_sd=0.004)])
    assert found.nis == pytest.approx(1 / 16, rel=0.2)
    assert found.nis < found.nis_limits[0]


def test_runs_of_one_recording_have_the_limits_of_one() -> None:
    """What was measured is the same in all of them, so they tell no more of it."""
    run = signal()
    one, three = measure_consistency([run]), measure_consistency([run, run, run])
    assert (three.nis, three.nis_limits) == (pytest.approx(one.nis), one.nis_limits)
    assert three.nees == pytest.approx(one.nees)


def test_only_frames_with_a_truth_and_trackers_with_a_band_have_errors() -> None:
    """Frames without a truth count for nothing, and a tracker of which no band is declared has no mean."""
    run = signal(dimension=2)
    expected = measure_consistency([run], 10, 60)
    run.diagnostics = [row if 10 <= row.frame < 60 else replace(row, truth=None) for row in run.diagnostics]
    assert measure_consistency([run]).nees == expected.nees
    run.experiment = replace(
        run.experiment, quality=Quality(Calibration(bands=(EstimateBand(trackers=("condensation",)),)))
    )
    assert measure_consistency([run]).nees is None


def test_what_is_not_known_is_left_out() -> None:
    """Of a tracker that tells no innovation, and before there is any frame."""
    run = pftrack.run("ball", tracker="condensation", frames=5)
    found = measure_consistency([run])
    assert (found.nis, found.nis_limits) == (None, None)
    assert found.nees is not None
    assert measure_consistency([run], 5) == Consistency()


# Coverage is counted in each frame after the first, and its error treats a run as one observation.


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


# The probability of a loss is told from the rows: of runs of any age, as they go on, and by the tracker in force.

BALL = find("ball")
FRAMES = 40


def _run(values: dict[str, Value] | None = None, frames: int = FRAMES) -> Run:
    timeline = (Change(0, values or {}),)
    return Run(BALL, BALL.simulate(), tracker="h-spf", seed=0, frames=frames, timeline=timeline)


@pytest.fixture(scope="module")
def lost() -> Run:
    run = _run({"occlusion_width_px": 100, "distracter_radius_px": 18})
    run.finish()
    return run


def test_it_is_high_where_the_ball_is_lost_and_low_where_it_is_held(lost: Run) -> None:
    """Behind a wide pillar the ball is lost and the tracker says so; without one it says that it follows."""
    told = loss_probabilities(lost)
    assert np.isnan(told[0])
    truly = np.array([row.lost is True for row in lost.diagnostics])
    assert told[truly].mean() > 0.8
    held = _run({"occlusion_width_px": 0, "distracter_radius_px": 0})
    held.finish()
    assert not any(row.lost for row in held.diagnostics)
    assert loss_probabilities(held)[1:].max() < 0.2


def test_a_run_that_goes_on_is_told_the_same(lost: Run) -> None:
    """Frame by frame, in pieces and at once come to the same bits, and a branch begins again."""
    run, account = _run({"occlusion_width_px": 100, "distracter_radius_px": 18}), LossAccount()
    for frame in (3, 4, 20, FRAMES - 1):
        run.seek(frame)
        found = account.follow(run)
    assert np.array_equal(found, loss_probabilities(lost), equal_nan=True)
    assert np.array_equal(account.follow(run), found, equal_nan=True)
    branch = run.branch(10, {"sample_count": 50})
    assert np.array_equal(account.follow(branch), found[:11], equal_nan=True)


def test_a_tracker_that_takes_over_begins_anew() -> None:
    """Its first frame has no probability, and one without a model has none at all."""
    run = _run()
    run.seek(9)
    run.change({"tracker": "apf"})
    run.finish()
    told = loss_probabilities(run)
    assert np.flatnonzero(np.isnan(told)).tolist() == [0, 10]


def test_a_file_of_probabilities_comes_back(tmp_path: Path) -> None:
    """Written and read again, models tell the same; what is no such file, or of another tracker, is refused."""
    path, scenes = tmp_path / "loss_probability.json", Scenes({})
    models = BALL.quality.loss_probability.models
    described = describe_models(models, {"kalman": 0.5}, {"experiment": "ball"})
    path.write_text(write_models(described), "utf-8")
    again = read_declaration(path, BALL.trackers, scenes)
    assert (again.models, again.refused) == (models, {"kalman": 0.5})
    raw = json.loads(path.read_text("utf-8"))
    for wrong in ({}, raw | {"version": 2}, raw | {"trackers": {"nobody": raw["trackers"]["h-spf"]}}):
        path.write_text(json.dumps(wrong), "utf-8")
        with pytest.raises(ValueError, match="is not a file of loss probabilities"):
            read_declaration(path, BALL.trackers, scenes)
