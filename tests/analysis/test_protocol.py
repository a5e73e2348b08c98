"""One pass through a sequence, and the figures that come of it."""

from pathlib import Path

import numpy as np
import pytest

from pftrack.analysis.evaluation import SUCCESS, evaluate_sequence, find_sequences, published
from pftrack.core.model.measures import EvaluatedRun
from pftrack.core.refusal import RefusedError
from pftrack.experiments import find
from tests.analysis.clips import FRAMES, write_otb


def test_area_under_the_success_curve() -> None:
    """A frame of overlap 1/3 is above 7 of the 21 thresholds, a perfect one above 20, a lost one above none."""
    truths = np.zeros((4, 2))
    estimates = np.array([[0.0, 0.0], [5.0, 0.0], [50.0, 0.0], [np.nan, 0.0]])
    sizes = np.full((4, 2), 10.0)
    course = EvaluatedRun(estimates, truths, np.zeros(4), None, sizes, sizes)
    np.testing.assert_allclose(SUCCESS.frames(course), np.array([20, 7, 0, 0]) / 21.0)


def test_a_plain_target_is_followed(tmp_path: Path) -> None:
    """A red rectangle on green is followed by its colours with every seed."""
    (sequence,) = find_sequences(write_otb(tmp_path / "Clip"))
    score = evaluate_sequence(find("histogram"), sequence, seeds=2)
    assert (score.name, score.frames, score.grey) == ("Clip", FRAMES, False)
    assert len(score.success) == len(score.precision) == 2
    assert min(score.success) > 0.6
    assert score.precision == (1.0, 1.0)
    assert score.frames_per_second > 0


def test_trackers_without_a_box_are_refused(tmp_path: Path) -> None:
    """What believes in a point alone has no overlap."""
    (sequence,) = find_sequences(write_otb(tmp_path / "Clip"))
    with pytest.raises(RefusedError, match="believes in no box"):
        evaluate_sequence(find("ball"), sequence)
    with pytest.raises(RefusedError, match="follows no box"):
        evaluate_sequence(find("sine"), sequence)


def test_published_figures() -> None:
    """The table has the figures that the benchmark's repository has, and none for other names."""
    assert (published("couple")["CPF"], published("Football1")["CPF"], published("Clip")) == (0.567, 0.621, {})
