import numpy as np
import pytest

from pftrack.vision.structure.factorization import Tracks

ONE = np.ones((3, 5, 2))


def test_rows_are_coordinates_in_turn() -> None:
    """Rows are x_1, y_1, x_2, ...; what was not seen is zero, with no precision."""
    positions = np.arange(30.0).reshape(3, 5, 2)
    variances = 4.0 * ONE
    positions[1, 2], variances[1, 2] = np.nan, np.inf
    tracks = Tracks(positions, variances)
    assert np.array_equal(tracks.matrix[0], positions[0, :, 0])
    assert np.array_equal(tracks.matrix[5], positions[2, :, 1])
    assert tracks.matrix[2, 2] == tracks.precisions[2, 2] == 0.0
    assert tracks.precisions[0, 0] == 0.25
    assert tracks.seen.all()
    assert not Tracks(positions, np.where(np.arange(5)[:, None] == 3, np.inf, variances)).seen[3]


@pytest.mark.parametrize(
    ("positions", "variances", "said"),
    [
        (ONE, ONE[:2], r"expected positions and variances \(frames, points, 2\), got \(3, 5, 2\) and \(2, 5, 2\)"),
        (ONE[:, :3], ONE[:, :3], "at least 4 points in 2 frames, got 3 points in 3"),
        (ONE[:1], ONE[:1], "at least 4 points in 2 frames, got 5 points in 1"),
        (ONE, 0.0 * ONE, "variances above 0"),
        (ONE, np.nan * ONE, "variances above 0, got one that is not, or NaN"),
        (np.nan * ONE, ONE, "finite positions where the variance is finite"),
    ],
)
def test_what_are_no_tracks_is_refused(positions: np.ndarray, variances: np.ndarray, said: str) -> None:
    """Wrong shapes, too few points or frames, variances that are none and NaN that counts are refused."""
    with pytest.raises(ValueError, match=said):
        Tracks(positions, variances)


def test_tracks_keep_what_they_were_given() -> None:
    """Later changes of an array do not reach the tracks, and the tracks cannot be written."""
    positions = ONE.copy()
    tracks = Tracks(positions, ONE)
    positions[:] = 7.0
    assert (tracks.positions == 1.0).all()
    with pytest.raises(ValueError, match="read-only"):
        tracks.variances[0] = 2.0
