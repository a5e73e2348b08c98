"""Consistency: errors and innovations in the deviations told are 1 if these are right, and in proportion if not."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import pftrack
from pftrack.core.model.band import Calibration, EstimateBand
from pftrack.core.numerics.statistics import chi_square_limit
from pftrack.experiments.experiment import Quality
from pftrack.runs.coverage import Consistency, measure_consistency
from pftrack.runs.run import Run


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
