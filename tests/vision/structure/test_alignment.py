import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.vision.structure.factorization import align, residuals, shape_error

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
    left = residuals(estimate, TRUTH)
    size = np.linalg.norm(TRUTH - TRUTH.mean(axis=0))
    assert shape_error(estimate, TRUTH) == pytest.approx(np.linalg.norm(left) / size)
    full = np.column_stack([estimate, np.ones(8)])
    best = full @ np.linalg.lstsq(full, TRUTH, rcond=None)[0]
    assert left == pytest.approx(np.linalg.norm(best - TRUTH, axis=1), abs=1e-9)


def test_shapes_that_cannot_be_compared_are_refused() -> None:
    """Another number of points, NaN and a flat estimate are refused."""
    with pytest.raises(ValueError, match=r"got \(7, 3\) and \(8, 3\)"):
        shape_error(TRUTH[:7], TRUTH)
    with pytest.raises(ValueError, match="finite shapes"):
        shape_error(np.nan * TRUTH, TRUTH)
    with pytest.raises(ValueError, match="one plane"):
        shape_error(TRUTH * [1.0, 1.0, 0.0], TRUTH)
