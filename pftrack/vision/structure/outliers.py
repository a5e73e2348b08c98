"""Measurements that are silently wrong: how likely each is right, given a shape.

A point that has slipped to another place is measured as exactly as ever, there. One such measurement in fifty ruins a
factorization of all of them, and a shape that is kept frame by frame still more. So a measurement is right, with the
variance that it comes with and that of the point in the shape, or wrong, and then it may lie anywhere on the body. The
view's camera is fitted to what is likely right, and the probabilities come from its residuals: expectation and
maximisation of a mixture (Dempster, Laird and Rubin 1977; for measurements of which some are wrong A. Aitkin and G.
Wilson 1980). Whoever divides a variance by the probability has the expected log likelihood of the measurement, up to a
constant.

Where no shape is known yet the same is done with the affine fit of a factorization (`fit_despite_outliers`).

A shape is wrong itself at first, and then no point is where it should be. So the variances are those at which half of
the points are as far off as half of them should be, if that is more.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials, logarithms
from pftrack.core.numerics.matrices import product
from pftrack.vision.structure import variational
from pftrack.vision.structure.cameras import fit_camera, residuals_and_slopes
from pftrack.vision.structure.tracks import Tracks
from pftrack.vision.structure.variational import Variational

__all__ = ["find_right", "fit_despite_outliers"]

ROUNDS = 6
NEWTON_STEPS = 5
FITS = 4
TURN_PRECISION = 100.0
"""Of the rotation from frame to frame, 1/rad^2: 6 degrees."""

MEDIAN = 1.3863
"""Of a chi-square with two degrees of freedom."""

FEWEST = 5
"""Points that are measured in a frame: with fewer, a camera fits whatever is seen."""

MOST_SURPRISE = 200.0
"""A log likelihood ratio that is larger counts as this."""

LEAST = 1e-6
"""Probability of being right, at least, so that what is wrong keeps a variance."""


def fit_despite_outliers(tracks: Tracks, wrong: float) -> tuple[Tracks, Variational]:
    """Factor tracks of which some measurements are wrong.

    Args:
        tracks: Positions and variances.
        wrong: Share of the measurements that are wrong, 0..1; at 0 all are believed.

    Returns:
        The tracks with variances over how likely each measurement is right, and their factorization.
    """
    fit = variational.fit(tracks)
    if not wrong > 0.0:
        return tracks, fit
    variances = tracks.variances.mean(axis=2)
    known = np.where(np.isfinite(tracks.variances), tracks.positions, 0.0)
    doubted = tracks
    for _ in range(FITS):
        expected = product(fit.motion[:, :3], fit.shape.T) + fit.motion[:, 3:]
        distances = np.square(known - expected.reshape(len(known), 2, -1).transpose(0, 2, 1)).sum(axis=2)
        right = _find_right(known, distances, variances, wrong)
        doubted = Tracks(tracks.positions, tracks.variances / right[:, :, None])
        fit = variational.fit(doubted)
    return doubted, fit


@compiled
def find_right(
    focal: float,
    before: NDArray[np.float64],
    shape: NDArray[np.float64],
    covariances: NDArray[np.float64],
    rows: NDArray[np.float64],
    precisions: NDArray[np.float64],
    wrong: float,
) -> NDArray[np.float64]:
    """Return how likely each measurement of a view is right, (n,).

    Args:
        focal: px.
        before: (3, 4) camera of the frame before.
        shape: (n, 3).
        covariances: (n, 3, 3) of its points.
        rows: (2, n) positions, px from the principal point.
        precisions: (2, n), 0 where a point was not measured.
        wrong: Share of the measurements that are wrong, 0..1.
    """
    count = len(shape)
    positions, camera = rows.T.copy().reshape(1, count, 2), before
    right: NDArray[np.float64] = np.ones((1, count))
    variances, distances, kept = np.empty((1, count)), np.empty((1, count)), precisions.copy()
    for _ in range(ROUNDS):
        residuals, by_point, _ = residuals_and_slopes(focal, camera, shape, rows)
        for n in range(count):
            variances[0, n], distances[0, n] = 0.0, 0.0
            for d in range(2):
                along = by_point[d, n].copy()
                variances[0, n] += 0.5 / precisions[d, n] + 0.5 * _quadratic(along, covariances[n])
                distances[0, n] += residuals[d, n] ** 2
        right = _find_right(positions, distances, variances, wrong)
        for n in range(count):
            for d in range(2):
                kept[d, n] = precisions[d, n] * right[0, n]
        camera = fit_camera(focal, camera, shape, rows, kept, before, TURN_PRECISION, NEWTON_STEPS)
    likely: NDArray[np.float64] = right[0]
    return likely


@compiled
def _quadratic(along: NDArray[np.float64], covariance: NDArray[np.float64]) -> float:
    """Return the variance of a sum of coordinates, given how much of each there is of it."""
    found = 0.0
    for i in range(along.shape[0]):
        for j in range(along.shape[0]):
            found += along[i] * covariance[i, j] * along[j]
    return found


@compiled
def _find_right(
    positions: NDArray[np.float64], distances: NDArray[np.float64], variances: NDArray[np.float64], wrong: float
) -> NDArray[np.float64]:
    """Return how likely measurements of a few frames are right, (T, n); 1 where there is none.

    Args:
        positions: (T, n, 2) px.
        distances: (T, n) squared distances from where a fit has them, px^2.
        variances: (T, n) of either coordinate, px^2; infinite where a point was not measured.
        wrong: Share of the measurements that are wrong.
    """
    frames, count = distances.shape
    right, measured = np.ones((frames, count)), np.isfinite(variances)
    anywhere = _spread(positions, measured)
    squares: NDArray[np.float64] = np.sort((distances / variances).ravel()[measured.ravel()])
    if squares.shape[0] < FEWEST * frames:
        return right
    wider = max(1.0, squares[squares.shape[0] // 2] / MEDIAN)
    for t in range(frames):
        here = np.where(measured[t], wider * variances[t], 1.0)
        there = here + anywhere[t]
        odds = logarithms(wrong / (1.0 - wrong) * here / there)
        for n in range(count):
            odds[n] += min(0.5 * distances[t, n] * (1.0 / here[n] - 1.0 / there[n]), MOST_SURPRISE)
        likely = exponentials(odds)
        for n in range(count):
            if measured[t, n]:
                right[t, n] = max(1.0 / (1.0 + likely[n]), LEAST)
    return right


@compiled
def _spread(positions: NDArray[np.float64], measured: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the variance of a coordinate of what is measured in each frame, (T,) px^2."""
    found = np.zeros(positions.shape[0])
    for t in range(positions.shape[0]):
        count = max(int(measured[t].sum()), 1)
        for d in range(2):
            mean = 0.0
            for n in range(measured.shape[1]):
                mean += positions[t, n, d] / count if measured[t, n] else 0.0
            for n in range(measured.shape[1]):
                found[t] += (positions[t, n, d] - mean) ** 2 / (2 * count) if measured[t, n] else 0.0
    return found
