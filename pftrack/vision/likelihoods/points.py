"""Likelihood of positions when points are measured: Gaussian, with each point's own noise.

A hidden point is measured too, but wildly; its noise is known to be large, so that it says next to nothing (Bando 2007,
ch. 4, eq. 4.7, with the noise of each point in place of one for all).
"""

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import compiled


@compiled
def log_likelihood(positions: Floats, measured: Floats, noise_sd: Floats) -> Floats:
    """Return log N(y_n | x, s_n^2 I) up to a constant, (F, N).

    Args:
        positions: x, (F, N, 2) px.
        measured: y, (F, 2) px.
        noise_sd: s, (F,) px.

    Raises:
        ValueError: The sizes do not agree.
    """
    features, count, axes = positions.shape
    if axes != 2 or measured.shape != (features, 2) or noise_sd.shape[0] != features:
        raise ValueError("expected measured points (F, 2) and noises (F,) for positions (F, N, 2), got other sizes")
    scores = np.empty((features, count))
    for n in range(features):
        factor = -0.5 / noise_sd[n] ** 2
        for i in range(count):
            x, y = positions[n, i, 0] - measured[n, 0], positions[n, i, 1] - measured[n, 1]
            scores[n, i] = factor * (x * x + y * y)
    return scores
