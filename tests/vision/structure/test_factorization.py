"""Factorization of tracks: exact without noise, refused where nothing is determined; alignment of shapes."""

import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.reproduce.structure import prism_tracks
from pftrack.vision.structure import factorization
from pftrack.vision.structure.factorization import Tracks, align, factorize, metric_transform, shape_error
from pftrack.vision.structure.recursive import accumulate, empty, principal_shape
from tests.vision.refusing import refuse
from tests.vision.structure.bodies import body, cameras, seen

BODY = body()
ROUND = seen(BODY, cameras())


def gram(points: np.ndarray) -> np.ndarray:
    centred = points - points.mean(axis=0)
    return centred @ centred.T


def test_the_metric_map_is_exact() -> None:
    """On noise-free tracks distances between points are right to 1e-8, in px, up to a mirror image."""
    found = factorize(ROUND)
    transform = metric_transform(found.motion)
    shape, motion = found.shape @ np.linalg.inv(transform).T, found.motion @ transform
    assert np.abs(gram(shape) - gram(BODY)).max() < 1e-8 * gram(BODY).max()
    assert np.linalg.norm(motion, axis=1) == pytest.approx(1.0)
    assert (motion[::2] * motion[1::2]).sum(axis=1) == pytest.approx(0.0, abs=1e-9)


def test_tracks_that_give_no_shape_are_refused() -> None:
    """Without rotation, and for a flat body that turns, there is no third direction, and the sentence says why.

    Two views are too few, and one that is repeated does not count twice; missing positions are for another method.
    """
    moved = np.tile(cameras(1), (6, 1)) + np.column_stack([np.zeros((12, 3)), np.arange(12.0)])
    for tracks in (seen(BODY, moved), seen(BODY * [1.0, 1.0, 0.0], cameras())):
        refuse("a body that turns and points that do not lie in one plane", factorize, tracks)
    two, repeated = (factorize(seen(BODY, np.tile(cameras(2), (times, 1)))).motion for times in (1, 3))
    refuse("at least 3 views for a metric shape, got 2", metric_transform, two)
    refuse("differ in rotation", metric_transform, repeated)
    sd = np.full((20, 9), 1e-4)
    sd[3, 5] = np.inf
    refuse("point 5 is missing in some", factorize, seen(BODY, cameras(), sd))


def test_it_is_the_factorization_of_all_frames() -> None:
    """Frame by frame it has the singular values and, up to an affine map, the shape of all frames at once.

    Nothing is made of one frame, nor of the same frame twice.
    """
    tracks = prism_tracks(3, frames=30).tracks
    known = empty(14)
    for positions in tracks.positions:
        known = accumulate(known, positions)
    (shape, strengths), whole = principal_shape(known), factorize(tracks)
    np.testing.assert_allclose(strengths, whole.strengths, rtol=1e-9, atol=1e-4)
    assert shape_error(shape, whole.shape) < 1e-8
    assert known.frames == 30
    positions = prism_tracks(3, frames=2).true_px[0]
    once = accumulate(empty(14), positions)
    assert [principal_shape(known) for known in (once, accumulate(once, positions))] == [None, None]


TRUTH = np.random.default_rng(0).normal(size=(8, 3)) * 20.0 + [100.0, 0.0, 700.0]


def test_shapes_are_compared_up_to_a_map() -> None:
    """An affine image of the truth has no error after alignment, and a flat one is refused.

    Up to a similarity a scaled, turned, moved and mirrored copy has no error; a stretched one has.
    """
    image = TRUTH @ np.random.default_rng(1).normal(size=(3, 3)) + [3.0, -4.0, 5.0]
    assert shape_error(image, TRUTH) < 1e-12
    assert np.allclose(align(image, TRUTH), TRUTH)
    copy = 0.3 * (TRUTH * [1.0, 1.0, -1.0]) @ rotation(np.array([0.3, -0.5, 1.0])).T + 7.0
    assert shape_error(copy, TRUTH, "similarity") < 1e-12
    assert shape_error(TRUTH * [1.0, 1.0, 2.0], TRUTH, "similarity") > 0.05
    refuse("one plane", shape_error, TRUTH * [1.0, 1.0, 0.0], TRUTH)


def test_the_error_is_relative_to_the_centred_truth() -> None:
    """What is left is compared with the size about the centre (eq. 4.19); a point's own is in the truth's unit."""
    estimate = TRUTH + np.random.default_rng(2).normal(size=TRUTH.shape)
    left = factorization.residuals(estimate, TRUTH)
    size = np.linalg.norm(TRUTH - TRUTH.mean(axis=0))
    assert shape_error(estimate, TRUTH) == pytest.approx(np.linalg.norm(left) / size)
    full = np.column_stack([estimate, np.ones(8)])
    best = full @ np.linalg.lstsq(full, TRUTH, rcond=None)[0]
    assert left == pytest.approx(np.linalg.norm(best - TRUTH, axis=1), abs=1e-9)


ONE = np.ones((3, 5, 2))


def test_rows_are_coordinates_in_turn() -> None:
    """Rows are x_1, y_1, x_2, ...; what was not seen is zero, with no precision.

    Later changes of an array do not reach the tracks, and the tracks cannot be written.
    """
    positions = np.arange(30.0).reshape(3, 5, 2)
    variances = 4.0 * ONE
    positions[1, 2], variances[1, 2] = np.nan, np.inf
    tracks = Tracks(positions, variances)
    assert np.array_equal(tracks.matrix[[0, 5]], [positions[0, :, 0], positions[2, :, 1]])
    assert (tracks.matrix[2, 2], tracks.precisions[2, 2], tracks.precisions[0, 0]) == (0.0, 0.0, 0.25)
    assert tracks.seen.all()
    positions[:] = 7.0
    assert tracks.positions[0, 0, 1] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        tracks.variances[0] = 2.0
    positions[1, 2] = np.nan
    assert not Tracks(positions, np.where(np.arange(5)[:, None] == 3, np.inf, variances)).seen[3]
