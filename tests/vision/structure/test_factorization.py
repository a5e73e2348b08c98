import numpy as np
import pytest

from pftrack.core.numerics.matrices import product
from pftrack.vision.structure.factorization import Factorization, factorize, metric_transform, shape_error
from tests.vision.structure.bodies import body, cameras, seen

BODY = body()


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
    found = factorize(seen(BODY, cameras()))
    transform = metric_transform(found.motion)
    shape, motion = found.shape @ np.linalg.inv(transform).T, found.motion @ transform
    assert np.abs(gram(shape) - gram(BODY)).max() < 1e-8 * gram(BODY).max()
    assert np.linalg.norm(motion, axis=1) == pytest.approx(1.0)
    assert (motion[::2] * motion[1::2]).sum(axis=1) == pytest.approx(0.0, abs=1e-9)


def test_a_body_that_does_not_turn_has_no_depth() -> None:
    """Without rotation, and for a flat body that turns, there is no third direction, and the sentence says why."""
    still = np.tile(cameras(1), (6, 1)) + np.column_stack([np.zeros((12, 3)), np.arange(12.0)])
    for tracks in (seen(BODY, still), seen(BODY * [1.0, 1.0, 0.0], cameras())):
        with pytest.raises(ValueError, match="a body that turns and points that do not lie in one plane"):
            factorize(tracks)


def depth_ratio(found: Factorization) -> float:
    """Return the third singular value over the fourth; near 1 the depth cannot be told from noise."""
    return float(found.strengths[2] / max(float(found.strengths[3]), 1e-300))


def test_depth_that_noise_hides_is_told() -> None:
    """With noise the third singular value of a body that does not turn is like the fourth; otherwise it stands out."""
    still = np.tile(cameras(1), (20, 1))
    assert depth_ratio(factorize(seen(BODY, still, 1.0, noise=1.0))) < 1.5
    assert depth_ratio(factorize(seen(BODY, cameras(), 1.0, noise=1.0))) > 5.0
    assert depth_ratio(factorize(seen(BODY, cameras()))) > 1e8


def test_views_that_do_not_differ_give_no_metric_shape() -> None:
    """Two views are too few, and one that is repeated does not count twice."""
    with pytest.raises(ValueError, match="at least 3 views for a metric shape, got 2"):
        metric_transform(factorize(seen(BODY, cameras(2))).motion)
    repeated = np.tile(cameras(2), (3, 1))
    with pytest.raises(ValueError, match="differ in rotation"):
        metric_transform(factorize(seen(BODY, repeated)).motion)


def test_a_missing_point_is_refused_by_its_number() -> None:
    """Positions that were not seen are for the variational method."""
    sd = np.full((20, 9), 1e-4)
    sd[3, 5] = np.inf
    with pytest.raises(ValueError, match="point 5 is missing in some"):
        factorize(seen(BODY, cameras(), sd))
