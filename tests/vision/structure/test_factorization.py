"""Factorization of tracks: exact without noise, refused where nothing is determined; alignment of shapes."""

import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.core.numerics.matrices import product
from pftrack.reproduce.structure import prism_tracks
from pftrack.vision.structure import factorization
from pftrack.vision.structure.factorization import Tracks, align, factorize, metric_transform, shape_error
from pftrack.vision.structure.recursive import accumulate, empty, principal_shape
from tests.vision.refusing import refuse
from tests.vision.structure.bodies import body, cameras, seen

BODY = body()
ROUND = seen(BODY, cameras())
STILL = np.tile(cameras(1), (20, 1))


def gram(points: np.ndarray) -> np.ndarray:
    centred = points - points.mean(axis=0)
    return centred @ centred.T


@pytest.mark.parametrize(("points", "frames"), [(4, 3), (9, 20), (40, 4)])
def test_noise_free_tracks_are_recovered(points: int, frames: int) -> None:
    """The factors of noise-free tracks give the tracks and, up to an affine map, the shape, to 1e-8."""
    shape, motion = body(points), cameras(frames)
    tracks = seen(shape, motion)
    found = factorize(tracks)
    assert np.abs(product(found.motion, found.shape.T) + found.offsets[:, None] - tracks.matrix).max() < 1e-8
    if points > 4:
        assert shape_error(found.shape, shape) < 1e-8


def test_the_metric_map_is_exact() -> None:
    """On noise-free tracks distances between points are right to 1e-8, in px, up to a mirror image."""
    found = factorize(ROUND)
    transform = metric_transform(found.motion)
    shape, motion = found.shape @ np.linalg.inv(transform).T, found.motion @ transform
    assert np.abs(gram(shape) - gram(BODY)).max() < 1e-8 * gram(BODY).max()
    assert np.linalg.norm(motion, axis=1) == pytest.approx(1.0)
    assert (motion[::2] * motion[1::2]).sum(axis=1) == pytest.approx(0.0, abs=1e-9)


def test_depth_that_noise_hides_is_told() -> None:
    """With noise the third singular value of a body that does not turn is like the fourth; otherwise it stands out."""
    ratios = []
    for tracks in (seen(BODY, STILL, 1.0, noise=1.0), seen(BODY, cameras(), 1.0, noise=1.0), ROUND):
        strengths = factorize(tracks).strengths
        ratios.append(float(strengths[2] / max(float(strengths[3]), 1e-300)))
    assert ratios[0] < 1.5
    assert ratios[1] > 5.0
    assert ratios[2] > 1e8


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
    """Frame by frame it comes to the singular values and, up to an affine map, the shape of all frames at once.

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


def test_an_affine_image_of_the_truth_has_no_error() -> None:
    """Whatever the map, the error after alignment is zero to 1e-12."""
    image = TRUTH @ np.random.default_rng(1).normal(size=(3, 3)) + [3.0, -4.0, 5.0]
    assert shape_error(image, TRUTH) < 1e-12
    assert np.allclose(align(image, TRUTH), TRUTH)


def test_a_similarity_may_mirror_but_not_stretch() -> None:
    """A scaled, turned, moved and mirrored copy has no error; a stretched one has."""
    copy = 0.3 * (TRUTH * [1.0, 1.0, -1.0]) @ rotation(np.array([0.3, -0.5, 1.0])).T + 7.0
    assert shape_error(copy, TRUTH, "similarity") < 1e-12
    assert shape_error(TRUTH * [1.0, 1.0, 2.0], TRUTH, "similarity") > 0.05


def test_the_error_is_relative_to_the_centred_truth() -> None:
    """What is left is compared with the size about the centre (eq. 4.19); a point's own is in the truth's unit."""
    estimate = TRUTH + np.random.default_rng(2).normal(size=TRUTH.shape)
    left = factorization.residuals(estimate, TRUTH)
    size = np.linalg.norm(TRUTH - TRUTH.mean(axis=0))
    assert shape_error(estimate, TRUTH) == pytest.approx(np.linalg.norm(left) / size)
    full = np.column_stack([estimate, np.ones(8)])
    best = full @ np.linalg.lstsq(full, TRUTH, rcond=None)[0]
    assert left == pytest.approx(np.linalg.norm(best - TRUTH, axis=1), abs=1e-9)


def test_shapes_that_cannot_be_compared_are_refused() -> None:
    """Another number of points, NaN and a flat estimate are refused."""
    refuse(r"got \(7, 3\) and \(8, 3\)", shape_error, TRUTH[:7], TRUTH)
    refuse("finite shapes", shape_error, np.nan * TRUTH, TRUTH)
    refuse("one plane", shape_error, TRUTH * [1.0, 1.0, 0.0], TRUTH)


ONE = np.ones((3, 5, 2))


def test_rows_are_coordinates_in_turn() -> None:
    """Rows are x_1, y_1, x_2, ...; what was not seen is zero, with no precision."""
    positions = np.arange(30.0).reshape(3, 5, 2)
    variances = 4.0 * ONE
    positions[1, 2], variances[1, 2] = np.nan, np.inf
    tracks = Tracks(positions, variances)
    assert np.array_equal(tracks.matrix[[0, 5]], [positions[0, :, 0], positions[2, :, 1]])
    assert (tracks.matrix[2, 2], tracks.precisions[2, 2], tracks.precisions[0, 0]) == (0.0, 0.0, 0.25)
    assert tracks.seen.all()
    assert not Tracks(positions, np.where(np.arange(5)[:, None] == 3, np.inf, variances)).seen[3]


def test_what_are_no_tracks_is_refused() -> None:
    """Wrong shapes, too few points or frames, variances that are none and NaN that counts are refused."""
    shapes = r"expected positions and variances \(frames, points, 2\), got \(3, 5, 2\) and \(2, 5, 2\)"
    refuse(shapes, Tracks, ONE, ONE[:2])
    refuse("at least 4 points in 2 frames, got 3 points in 3", Tracks, ONE[:, :3], ONE[:, :3])
    refuse("at least 4 points in 2 frames, got 5 points in 1", Tracks, ONE[:1], ONE[:1])
    refuse("variances above 0", Tracks, ONE, 0.0 * ONE)
    refuse("variances above 0, got one that is not, or NaN", Tracks, ONE, np.nan * ONE)
    refuse("finite positions where the variance is finite", Tracks, np.nan * ONE, ONE)


def test_tracks_keep_what_they_were_given() -> None:
    """Later changes of an array do not reach the tracks, and the tracks cannot be written."""
    positions = ONE.copy()
    tracks = Tracks(positions, ONE)
    positions[:] = 7.0
    assert (tracks.positions == 1.0).all()
    with pytest.raises(ValueError, match="read-only"):
        tracks.variances[0] = 2.0
