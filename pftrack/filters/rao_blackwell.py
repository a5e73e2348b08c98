"""The Rao-Blackwellised particle filter of both layers: the exact model that the layered tracker approximates.

A particle is the positions of all F features at once, and given its past the affine camera is a Gaussian that a Kalman
filter computes exactly. So only the features are sampled, in 2 F dimensions (Bando 2007, ch. 4 section 3.3). The model
is that of `affine`, with features scattered around the camera's prediction, x_t = C a_t + s v. Observation matrix and
noise are the same for all particles, hence so are the gain and the covariances, and a particle carries only its mean of
the camera; the two axes share even the covariance.

Sixteen dimensions are many: of 25,000 particles the best one usually takes nearly all the weight.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pftrack.core.arrays import Floats, Ints, check, check_count
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import factorise, multiply, substitute
from pftrack.core.numerics.random import Gaussian, Generator
from pftrack.filters.affine import AffineLayer, extended_step
from pftrack.filters.particles import moments, normalise
from pftrack.filters.resampling import systematic
from pftrack.filters.sequential import predict_second_order

RESAMPLING_THRESHOLD = 0.5
SCATTER_PX = 1.0


@dataclass(frozen=True, slots=True)
class RaoBlackwell:
    """The posterior of a frame: N particles of all F features.

    Attributes:
        cameras: (2, 8, N) each particle's mean of the camera's rows, as in `AffineBelief`.
        covariance: (8, 8) of a row around that mean, for all particles and both rows.
        log_weights: (N,).
        coordinates: (2, F, N) px, x and y of the features.
        feature_means: (F, 2) px, weighted.
        feature_covariances: (F, 2, 2) px^2, weighted.
        pose: Belief in the angles (3,), rad.
        log_evidence: log p(z_t | z_{1:t-1}) up to the constant that the likelihood leaves out.
        ancestors: (N,) parent of each particle in the frame before; None at the beginning.
        log_likelihoods: (N,) of all features together, up to the same constant as the evidence; None at the beginning.
        resampled: Whether parents were drawn by weight.
    """

    cameras: Floats
    covariance: Floats
    log_weights: Floats
    coordinates: Floats
    feature_means: Floats
    feature_covariances: Floats
    pose: Gaussian
    log_evidence: float = 0.0
    ancestors: Ints | None = None
    log_likelihoods: Floats | None = None
    resampled: bool = False

    @property
    def positions(self) -> Floats:
        """(F, N, 2) px, a view."""
        return self.coordinates.transpose(1, 2, 0)

    @property
    def effective_sample_size(self) -> float:
        """1 / sum_n w_n^2, between 1 and N."""
        return float(1.0 / np.square(exponentials(self.log_weights)).sum())


def begin(layer: AffineLayer, count: int) -> RaoBlackwell:
    """Begin with `count` particles at the layer's initial belief.

    Raises:
        TypeError: The count is not a whole number.
        ValueError: It is below 1.
    """
    check_count("count", count)
    belief = layer.begin()
    cameras = np.repeat(belief.mean[:, :, None], count, axis=2)
    means = layer.project(belief).positions
    coordinates = np.repeat(means.T[:, :, None], count, axis=2)
    log_weights = np.full(count, -math.log(count))
    covariances = np.zeros((len(means), 2, 2))
    return RaoBlackwell(cameras, belief.covariance[0], log_weights, coordinates, means, covariances, layer.pose(belief))


def step(
    belief: RaoBlackwell,
    layer: AffineLayer,
    log_likelihood: Callable[[Floats], Floats],
    rng: Generator,
    *,
    count: int | None = None,
    scatter_px: float = SCATTER_PX,
    threshold: float = RESAMPLING_THRESHOLD,
) -> RaoBlackwell:
    """Advance by one observation.

    Args:
        belief: Posterior of the last frame, N particles.
        layer: Points and noise of the camera, and how its pose walks.
        log_likelihood: Function from positions (F, N, 2) px to log likelihoods (F, N), up to a constant for each
            feature.
        rng: The frame's generator.
        count: Particles wanted; the present number by default.
        scatter_px: s, standard deviation of the features around the camera's prediction.
        threshold: Resample if the effective sample size is below this share of N.

    Raises:
        TypeError: The likelihood does not return an array of real numbers.
        ValueError: It returns another number of values, or the sizes of belief and layer differ.
    """
    size = len(belief.log_weights)
    count = size if count is None else count
    check(
        missing=True,
        cameras=(belief.cameras, "2 8 N"),
        covariance=(belief.covariance, "8 8"),
        log_weights=(belief.log_weights, "N"),
    )
    resampled = count != size or belief.effective_sample_size < threshold * size
    if resampled:
        parents, prior = systematic(rng, belief.log_weights, count), np.full(count, -math.log(count))
    else:
        parents, prior = np.arange(count), belief.log_weights
    root, gain, covariance = _common(belief.covariance, layer.points_mm, layer.noise_sd, scatter_px)
    normals = rng.standard_normal((2, len(layer.points_mm), count))
    cameras, coordinates = _advance(belief.cameras, parents, layer.points_mm, root, gain, normals)
    values = log_likelihood(coordinates.transpose(1, 2, 0))
    check(missing=True, coordinates=(coordinates, "2 F N"), log_likelihood=(values, "F N"))
    scores = values.sum(axis=0)
    log_weights, log_evidence = normalise(prior + scores)
    entries, noise, means, covariances = _summary(cameras, coordinates, exponentials(log_weights))
    noise[:3, :3] += covariance[:3, :3]
    noise[3:, 3:] += covariance[:3, :3]
    slopes = np.ascontiguousarray(layer.reference[:, :3])
    pose = extended_step(belief.pose, entries, noise, slopes, layer.theta_sd_rad, layer.walk)
    return RaoBlackwell(
        cameras,
        covariance,
        log_weights,
        coordinates,
        means,
        covariances,
        pose,
        log_evidence,
        parents,
        scores,
        resampled,
    )


@compiled
def _common(
    covariance: Floats, points_mm: Floats, noise_sd: Floats, scatter_px: float
) -> tuple[Floats, Floats, Floats]:
    """Return what all particles and both axes share.

    Returns:
        The lower root L (F, F) of the covariance of the features, S = C V C^T + s^2 I; the gain times it, K L (8, F);
        and the covariance (8, 8) of a row when its features are known.
    """
    count = points_mm.shape[0]
    _, predicted = predict_second_order(np.zeros(8), covariance, noise_sd)
    observation = np.zeros((count, 8))
    for f in range(count):
        for i in range(3):
            observation[f, i] = points_mm[f, i]
        observation[f, 3] = 1.0
    cross = multiply(observation, predicted)
    seen = multiply(cross, observation.T.copy())
    for f in range(count):
        seen[f, f] += scatter_px**2
    root, _ = factorise(seen)
    gain = substitute(root, cross).T.copy()
    known = multiply(gain, gain.T.copy())
    for i in range(8):
        for j in range(8):
            known[i, j] = predicted[i, j] - known[i, j]
    return root, gain, known


@compiled
def _advance(
    cameras: Floats,
    parents: Ints,
    points_mm: Floats,
    root: Floats,
    gain: Floats,
    normals: Floats,
) -> tuple[Floats, Floats]:
    """Return the cameras (2, 8, N) and features (2, F, N) of the next frame, given normals (2, F, N)."""
    _, features, count = normals.shape
    moved = np.empty((2, 8, count))
    coordinates = np.empty((2, features, count))
    for axis in range(2):
        entries, seen = moved[axis], coordinates[axis]
        _predict(cameras[axis], parents, entries)
        for f in range(features):
            for n in range(count):
                seen[f, n] = entries[3, n]
            for i in range(3):
                _add(seen[f], points_mm[f, i], entries[i])
        for f in range(features):
            noise = normals[axis, f]
            for other in range(f, features):
                _add(seen[other], root[other, f], noise)
            for i in range(8):
                _add(entries[i], gain[i, f], noise)
    return moved, coordinates


@compiled
def _predict(cameras: Floats, parents: Ints, moved: Floats) -> None:
    """Write a_t = 2 a_{t-1} - a_{t-2} and a_{t-1}, (8, n), of parents (n,) among cameras (8, N)."""
    for i in range(4):
        newer, older = cameras[i], cameras[4 + i]
        newest, last = moved[i], moved[4 + i]
        for n in range(parents.shape[0]):
            last[n] = newer[parents[n]]
            newest[n] = 2.0 * last[n] - older[parents[n]]


@compiled
def _add(values: Floats, factor: float, others: Floats) -> None:
    """Add a multiple of others (n,) to values (n,), in place."""
    for n in range(values.shape[0]):
        values[n] += factor * others[n]


@compiled
def _summary(cameras: Floats, coordinates: Floats, weights: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return mean (6,) and covariance (6, 6) of the slopes, means (F, 2) and covariances (F, 2, 2) of the features."""
    _, features, count = coordinates.shape
    slopes = np.empty((6, count))
    for i in range(6):
        for n in range(count):
            slopes[i, n] = cameras[i // 3, i % 3, n]
    entries, spread = moments(slopes.T, weights)
    means, covariances = np.empty((features, 2)), np.empty((features, 2, 2))
    place = np.empty((2, count))
    for f in range(features):
        for axis in range(2):
            for n in range(count):
                place[axis, n] = coordinates[axis, f, n]
        mean, covariance = moments(place.T, weights)
        for axis in range(2):
            means[f, axis] = mean[axis]
            for other in range(2):
                covariances[f, axis, other] = covariance[axis, other]
    return entries, spread, means, covariances
