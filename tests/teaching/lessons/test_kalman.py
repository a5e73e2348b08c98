"""Lesson 6: tracks with a velocity that is never measured."""

import numpy as np
import pytest

from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.course.kalman import apply_filter, errors, riccati, simulate
from tests.teaching.lessons.demonstrations import shown

LESSON = LESSONS["kalman"]


def test_riccati_settles_at_the_known_variances() -> None:
    """Predicted variances of position and velocity, in m^2 and m^2/s^2."""
    assert riccati(0.05, 4.0).diagonal() == pytest.approx([2.41836, 0.238449], rel=2e-6)


@pytest.mark.parametrize(("process", "noise"), [(0.005, 25.0), (0.05, 4.0), (0.5, 0.5)])
def test_riccati_is_a_fixed_point(process: float, noise: float) -> None:
    """Predictions of the library's filter come to it from any noise."""
    predicted = apply_filter(process, noise, np.zeros(300)).predicted[-1]
    assert predicted == pytest.approx(riccati(process, noise), rel=1e-6)


def test_further_tracks_are_filtered_as_the_first_is() -> None:
    """Gains of one track, applied to all, come to the library's own estimate on that track."""
    tracks = simulate(0.05, 4.0, 3, 60, 5)
    measured = tracks.measured[:, 2].copy()
    measured[20:40] = np.nan
    known = apply_filter(0.05, 4.0, measured)
    for frames in (1, 30, 60):
        off = errors(tracks, known.gains[:frames])[:, 2]
        assert off == pytest.approx(tracks.states[frames - 1, :, 2] - known.means[frames - 1], abs=1e-9)


def test_the_ellipse_grows_and_tilts_while_frames_are_dropped() -> None:
    """As the answer says: each second of the gap is less sure of the position, and of how it goes with the velocity."""
    known = apply_filter(0.05, 4.0, [*np.zeros(20), *np.full(20, np.nan), 0.0])
    covariances = known.covariances[19:40]
    correlations = covariances[:, 0, 1] / np.sqrt(covariances[:, 0, 0] * covariances[:, 1, 1])
    assert (np.diff(covariances[:, 0, 0]) > 0).all()
    assert (np.diff(covariances[:, 1, 1]) > 0).all()
    assert correlations[-1] > correlations[0] + 0.15
    assert known.covariances[40, 0, 0] < 4.0


def test_a_gap_is_not_measured() -> None:
    """Frames that are dropped have no dot, and the filter believes nothing in them."""
    there = shown(LESSON, dropped=20, frame=30)
    dots = next(trace for trace in there.figure.panels[0].traces if trace.title == "measured")
    assert dots.kind == "scatter"
    assert not set(range(20, 40)) & set(dots.x)
    assert there.numbers[2].value == 0.0
