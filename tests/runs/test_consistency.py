"""Coverage of bands, consistency of errors with the deviations told, and the probability of a loss."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pftrack
from pftrack.core.model.band import Calibration, EstimateBand
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


def test_it_is_the_mean_of_squares_in_deviations() -> None:
    """The mean is over all coordinates, or all measured numbers, of some frames, with limits of a chi-square variable.

    Frames without a truth are left out, and a tracker without a declared band has no mean.
    """
    found = measure_consistency([signal()])
    limits = tuple(round(chi_square_limit(360, level) / 360, 6) for level in (0.025, 0.975))
    assert found.nis_limits == limits
    assert limits[0] < found.nis < limits[1]
    assert 0.2 < found.nees < 5.0
    run = signal(dimension=2)
    found = measure_consistency([run], 10, 60)
    rows = run.diagnostics[10:60]
    errors = np.array([np.subtract(row.estimate, row.truth or ()) for row in rows])
    assert found.nees == pytest.approx(np.mean((errors / [row.sigma for row in rows]) ** 2))
    assert found.nis == pytest.approx(sum(row.number("nis") for row in rows) / 100)
    run.diagnostics = [row if 10 <= row.frame < 60 else replace(row, truth=None) for row in run.diagnostics]
    assert measure_consistency([run]).nees == found.nees
    bands = Calibration(bands=(EstimateBand(trackers=("condensation",)),))
    run.experiment = replace(run.experiment, quality=Quality(bands))
    assert measure_consistency([run]).nees is None


def test_runs_of_one_recording_have_the_limits_of_one() -> None:
    """They measure the same, so they add no evidence.

    An assumed measurement noise that is four times too large makes the mean square far too small.
    """
    run = signal(assumed_noise_sd=0.4, process_noise_sd=0.004)
    one, three = measure_consistency([run]), measure_consistency([run, run, run])
    assert one.nis == pytest.approx(1 / 16, rel=0.2)
    assert one.nis < one.nis_limits[0]
    assert (three.nis, three.nis_limits) == (pytest.approx(one.nis), one.nis_limits)
    assert three.nees == pytest.approx(one.nees)


def test_what_is_not_known_is_left_out() -> None:
    """A tracker without innovations has no mean of them, and before any frame there is none."""
    run = pftrack.run("ball", tracker="condensation", frames=5)
    found = measure_consistency([run])
    assert (found.nis, found.nis_limits) == (None, None)
    assert found.nees is not None
    assert measure_consistency([run], 5) == Consistency()


# Coverage is counted in each frame after the first, and its error treats a run as one observation.


def test_a_setting_has_the_values_of_its_preset_and_another_scene_for_each_seed() -> None:
    """Where scenes have a number, the seed is added to it. Each number of an estimate counts, by both shares."""
    fish = find("fish")
    preset = fish.preset_named("rudder")
    parameters = measured_run(fish, "guided", "rudder", 3, 2).parameters_at(0)
    assert parameters.tank == preset.parameters["tank"]
    assert parameters.tank_number == fish.simulate().parameters.tank_number + 3
    run = measured_run(find("ball"), "kalman", "", 0, 5)
    run.finish()
    assert {share: total for share, (_, total) in count_held(run)["estimate"].items()} == {0.5: 8, 0.95: 8}


def test_the_error_knows_that_frames_of_a_run_are_alike() -> None:
    """Two runs, where one holds all and the other nothing, tell little; two that agree have no error.

    A band that never has a number has no coverage.
    """
    apart = pool_counts([{"it": {0.5: (100, 100)}}, {"it": {0.5: (0, 100)}}])[0]
    assert (apart.share, apart.runs, apart.error) == (0.5, 2, pytest.approx(0.5))
    assert pool_counts([{"it": {0.5: (5, 10)}}, {"it": {0.5: (50, 100)}}])[0].error == 0.0
    assert math.isnan(pool_counts([{"it": {0.5: (5, 10)}}])[0].error)
    assert pool_counts([{"it": {0.5: (0, 0)}}, {"other": {}}]) == ()


# The probability of a loss is told from the rows: of runs of any age, as they go on, and by the tracker in force.

BALL = find("ball")


def test_a_run_that_continues_has_the_same_probabilities() -> None:
    """Frame by frame, in pieces and at once they are the same bits; a branch, and another tracker, begin anew.

    The first frame of a tracker has no probability, and a tracker without a model has none at all.
    """
    run, account = Run(BALL, BALL.simulate(), tracker="h-spf", frames=20), LossAccount()
    for frame in (3, 4, 9):
        run.seek(frame)
        found = account.follow(run)
    assert np.array_equal(found, loss_probabilities(run), equal_nan=True)
    run.change({"tracker": "apf"})
    run.finish()
    told = account.follow(run)
    assert np.flatnonzero(np.isnan(told)).tolist() == [0, 10]
    assert np.array_equal(told, loss_probabilities(run), equal_nan=True)
    branch = run.branch(8, {"sample_count": 50})
    assert np.array_equal(account.follow(branch), told[:9], equal_nan=True)


def test_a_file_of_probabilities_comes_back(tmp_path: Path) -> None:
    """Models are the same after a file; another file, or one of an unknown tracker, is refused."""
    path, scenes = tmp_path / "loss_probability.json", Scenes({})
    models = BALL.quality.loss_probability.models
    described = describe_models(models, {"kalman": 0.5}, {"experiment": "ball"})
    path.write_text(write_models(described), "utf-8")
    again = read_declaration(path, BALL.trackers, scenes)
    assert (again.models, again.refused) == (models, {"kalman": 0.5})
    path.write_text("{}", "utf-8")
    with pytest.raises(ValueError, match="is not a file of loss probabilities"):
        read_declaration(path, BALL.trackers, scenes)
