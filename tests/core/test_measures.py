"""Measures of whole runs: each by a case small enough to compute by hand."""

from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.model import measures
from pftrack.core.model.measures import HIT_RATE, MEAN_IOU, PICTURE_MEASURES, EvaluatedRun, evaluate

NAN = np.nan


def course(offsets: list[tuple[float, float]], extent: tuple[float, float] = (30.0, 40.0)) -> EvaluatedRun:
    """Return a run whose estimates are off by these, px, from a target in a box; NaN where nothing is known of it."""
    estimates = np.full((len(offsets), 2), 100.0)
    truths = estimates - np.array(offsets)
    errors = np.hypot(*np.array(offsets).T)
    extents = np.where(np.isnan(errors)[:, None], NAN, np.array(extent))
    return EvaluatedRun(estimates, truths, errors, errors > 60.0, extents, np.full_like(extents, NAN))


FIVE = course([(0.0, 0.0), (15.0, 0.0), (0.0, 21.0), (NAN, NAN), (30.0, 0.0), (3.0, 4.0)])
"""In a box of 30 x 40 px: in its middle, on its edge, above it, unknown, one width aside, and 5 px off."""


def test_a_small_run_by_hand() -> None:
    """Errors of 0, 15, 21, 30 and 5 px in a box whose diagonal is 50 px; a box one width aside touches, and no more."""
    assert evaluate(PICTURE_MEASURES, FIVE) == {
        "inside_share": pytest.approx(3 / 5),
        "precision_20px": pytest.approx(3 / 5),
        "normalised_error": pytest.approx(15 / 50),
        "median_error_px": 15.0,
        "frames_to_failure": 4,
    }
    assert HIT_RATE.of(FIVE) == 1.0
    assert evaluate(PICTURE_MEASURES, course([(1.0, 1.0), (29.9, 39.9), (NAN, NAN)]))["frames_to_failure"] == 3


def test_boxes_overlap_by_hand() -> None:
    """A box of 30 x 40 px: met, half a width aside, half as large in its middle, one width aside, and no number."""
    run = course([(0.0, 0.0), (15.0, 0.0), (0.0, 0.0), (30.0, 0.0), (1.0, 1.0)])
    believed = np.array([30.0, 40.0]) * [[1], [1], [0.5], [1], [1]]
    estimates = np.where(np.arange(5)[:, None] == 4, NAN, run.estimates)
    sized = replace(run, estimates=estimates, believed=believed)
    assert MEAN_IOU.values(sized) == pytest.approx([1.0, 1 / 3, 1 / 4, 0.0, 0.0])
    assert MEAN_IOU.of(sized) == pytest.approx((1 + 1 / 3 + 1 / 4) / 5)
    assert MEAN_IOU.of(run) is None


def test_what_has_no_truth_or_no_box_has_no_measure_of_it() -> None:
    """Without truth a measure is absent, not 0; truth without a box, such as a signal's, keeps the errors."""
    assert evaluate(PICTURE_MEASURES, course([(NAN, NAN)] * 3)) == {}
    bare = replace(FIVE, extents=np.full((6, 2), NAN))
    assert evaluate(PICTURE_MEASURES, bare).keys() == {"precision_20px", "median_error_px"}


def test_an_estimate_that_is_none_counts_as_wrong() -> None:
    """Where the truth is known an estimate that is not finite misses it; medians that are not finite are absent."""
    off = np.array([[0.0, 0.0], [NAN, NAN], [NAN, NAN]])
    truths, errors = np.full((3, 2), 100.0), np.array([0.0, np.inf, np.inf])
    run = EvaluatedRun(truths + off, truths, errors, errors > 60.0, np.full((3, 2), 30.0), np.full((3, 2), NAN))
    assert evaluate((HIT_RATE, *PICTURE_MEASURES), run) == {
        "hit_rate": pytest.approx(1 / 3),
        "inside_share": pytest.approx(1 / 3),
        "precision_20px": pytest.approx(1 / 3),
        "frames_to_failure": 1,
    }


def test_a_pose_by_hand() -> None:
    """Errors of 2, 10, 12 and 20 degrees; the last counts as lost."""
    errors, nothing = np.array([2.0, 10.0, 12.0, 20.0]), np.full((4, 2), NAN)
    turned = EvaluatedRun(errors[:, None], np.zeros((4, 1)), errors, errors > 15.0, nothing, nothing)
    expected = {"precision_10deg": 0.5, "median_error_deg": 11.0, "frames_to_failure": 3}
    assert evaluate(measures.POSE_MEASURES, turned) == expected


@pytest.mark.parametrize(("allowed", "expected"), [(0.4, True), (0.39, False)])
def test_success_counts_the_frames_that_miss(allowed: float, expected: bool) -> None:
    """Two of five labelled frames may miss at 0.4, to the frame."""
    assert measures.is_success(PICTURE_MEASURES[0], FIVE, allowed) is expected
    assert measures.is_success(PICTURE_MEASURES[0], course([(NAN, NAN)]), allowed) is None
