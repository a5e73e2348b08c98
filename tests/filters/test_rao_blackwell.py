from functools import partial

import numpy as np

from pftrack.core.numerics.matrices import affine_projection
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.filters import rao_blackwell
from pftrack.filters.affine import AffineLayer
from pftrack.vision.likelihoods import points

CAMERA = np.array([[5.0, 0.0, 0.0, 0.0], [0.0, 5.0, 0.0, 0.0]])
LAYER = AffineLayer(np.array([[0.0, 0.0, 0.0], [6.0, 2.0, -3.0]]), CAMERA)
NOISE = np.array([2.0, 3.0])


def test_it_is_exact_though_it_resamples_in_every_frame() -> None:
    """On Gaussian measurements of two points the camera is the Kalman filter's; tests of poses leave out resampling."""
    numbers = np.random.default_rng(0)
    exact, state = LAYER.begin(), rao_blackwell.begin(LAYER, 60_000)
    row = np.column_stack([LAYER.points_mm, np.ones(2)])
    for t in range(1, 5):
        rng = Stream(4, t, Purpose.TRACK)
        seen = affine_projection(CAMERA, LAYER.points_mm) + [1.5, -1.0] * np.array([t]) + numbers.normal(size=(2, 2))
        exact = LAYER.update(LAYER.predict(exact), seen, np.repeat(NOISE[:, None] ** 2 + 1.0, 2, axis=1), rng)
        near = partial(points.log_likelihood, measured=seen, noise_sd=NOISE)
        state = rao_blackwell.step(state, LAYER, near, rng, threshold=1.0)
        weights, known = np.exp(state.log_weights), LAYER.project(exact)
        # In px at the points: the entries themselves are poorly determined by two of them.
        assert np.allclose(row @ (state.cameras @ weights)[:, :4].T, known.positions, atol=0.05)
        for axis in range(2):
            spread = state.covariance + np.cov(state.cameras[axis], aweights=weights, bias=True)
            assert np.allclose(np.diag(row @ spread[:4, :4] @ row.T), known.variances[:, axis], rtol=0.05)
