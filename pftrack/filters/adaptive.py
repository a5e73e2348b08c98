"""Features tracked by small particle filters that draw from two predictions at once.

Each feature has its own N particles, positions (x, y) in this frame and in the last. A share alpha of them is drawn
from the upper layer's prediction of that feature, the others from the feature's own past by a second-order model. The
filter therefore survives both a wrong model of the object and a hidden feature. The mixture of the two is the prior as
well as the sampling distribution, and therefore the weight of a particle is its likelihood alone (Bando 2007, ch. 4,
eqs. 4.1-4.3, 4.6-4.10).

The two numbers of particles are fixed, not drawn: round(alpha N) and the rest. `learning.mixture_em` adapts alpha; at 1
the filter follows only the upper prediction, at 0 only the lower one.

All features are handled together. The caller computes the likelihood for all particles at once: `draw`, then the
likelihood of `positions`, then `weigh`.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from pftrack.core.arrays import Floats, Ints, check, check_count
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.random import Gaussian, Generator
from pftrack.filters.particles import moments, normalise
from pftrack.filters.resampling import systematic_parents

# An upper layer is a model of the whole object that predicts where each of its features should be seen.
#
# Features are tracked in two layers. The lower one is the image positions of the features, a small particle filter
# each; the upper one, the state of the object that carries them. The upper layer predicts every feature: a Gaussian per
# axis over its position in this frame and in the last (Bando 2007, ch. 4, eq. 4.8). The lower layer measures positions:
# the means of the particles, with their variances.
#
# The members are `affine` (entries of an affine camera by a Kalman filter, from which the pose is estimated) and
# `perspective` (pose and translation by an extended Kalman filter on a pinhole).

S = TypeVar("S")


@dataclass(frozen=True, slots=True)
class Projection:
    """Predicted positions of F features: independent Gaussians per feature and axis, over this frame and the last.

    Attributes:
        means: (F, 2, 2) px; by feature, axis (x, y) and age (this frame, the last).
        covariances: (F, 2, 2, 2) px^2; by feature and axis, over the two ages.
    """

    means: Floats
    covariances: Floats

    @property
    def positions(self) -> Floats:
        """(F, 2) px, where the features should be in this frame."""
        positions: Floats = self.means[:, :, 0]
        return positions

    @property
    def variances(self) -> Floats:
        """(F, 2) px^2 of the positions, per axis."""
        variances: Floats = self.covariances[:, :, 0, 0]
        return variances


class UpperLayer(Protocol[S]):
    """A model of the object; its belief S is a frozen value."""

    def begin(self) -> S:
        """Return the belief at the beginning."""

    def predict(self, belief: S) -> S:
        """Return the belief a frame later."""

    def project(self, belief: S) -> Projection:
        """Return where the features should be seen."""

    def update(self, belief: S, positions: Floats, variances: Floats, rng: Generator) -> S:
        """Condition on positions (F, 2) px with variances (F, 2) px^2, and estimate the pose."""

    def pose(self, belief: S) -> Gaussian:
        """Return the belief in the angles (theta_x, theta_y, theta_z), rad."""


class Draw(NamedTuple):
    """Particles of a new frame, not yet weighed.

    Attributes:
        coordinates: (F, 4, N) px; by feature: x and y in this frame, x and y in the last.
        upper_counts: (F,) number of each feature's particles that came from the upper prediction; they are the first
            ones.
        parents: (F, N) index of the particle of the last frame that each was drawn from, counted over all features,
            feature by feature; -1 for particles from the upper prediction, which have none.
    """

    coordinates: Floats
    upper_counts: Ints
    parents: Ints

    @property
    def positions(self) -> Floats:
        """(F, N, 2) px, a view."""
        return self.coordinates[:, :2].transpose(0, 2, 1)


@dataclass(frozen=True, slots=True)
class Features:
    """The posterior of F features, N particles each.

    Attributes:
        coordinates: (F, 4, N) px; by feature: x and y in this frame, x and y in the last.
        upper_counts: (F,) number of each feature's particles that came from the upper prediction; they are the first
            ones.
        parents: (F, N) index of the particle of the last frame that each was drawn from, counted as in `Draw`; -1 if
            none.
        log_weights: (F, N); the weights of a feature sum to one.
        survivors: (F, N) indices of particles drawn by weight; they are the parents of the next frame.
        means: (F, 2) px, weighted means of the positions.
        covariances: (F, 2, 2) px^2, weighted.
        log_evidences: (F,) log of the mean likelihood; -inf if no particle of the feature had any.
    """

    coordinates: Floats
    upper_counts: Ints
    parents: Ints
    log_weights: Floats
    survivors: Ints
    means: Floats
    covariances: Floats
    log_evidences: Floats

    @property
    def particles(self) -> Floats:
        """(F, N, 4) px, a view: x and y in this frame, x and y in the last."""
        return self.coordinates.transpose(0, 2, 1)

    @property
    def positions(self) -> Floats:
        """(F, N, 2) px, a view."""
        return self.coordinates[:, :2].transpose(0, 2, 1)

    @property
    def variances(self) -> Floats:
        """(F, 2) px^2, per axis."""
        variances: Floats = self.covariances.diagonal(axis1=1, axis2=2)
        return variances


def begin(positions: Floats, spread_px: float, count: int, rng: Generator, speed_px: float = 0.0) -> Features:
    """Begin with particles scattered around known positions, at rest or with scattered speeds.

    Args:
        positions: (F, 2) px.
        spread_px: Standard deviation of the scatter.
        count: N, particles per feature.
        rng: The frame's generator.
        speed_px: Standard deviation of the speeds, px per frame; at 0 nothing is drawn for them.

    Raises:
        TypeError: The positions are not an array of real numbers, or the count is not a whole number.
        ValueError: The positions are not (F, 2) and finite, or the count is below 1.
    """
    check_count("count", count)
    features = check(positions=(positions, "F 2"))["F"]
    scattered = positions[:, :, None] + spread_px * rng.standard_normal((features, 2, count))
    before = scattered - speed_px * rng.standard_normal(scattered.shape) if speed_px > 0.0 else scattered
    nobody = np.full((features, count), -1, np.int64)
    fresh = Draw(np.concatenate([scattered, before], axis=1), np.zeros(features, np.int64), nobody)
    return weigh(fresh, np.zeros((features, count)), rng)


def draw(
    features: Features, projection: Projection, ratios: Floats, noise_sd_px: float, count: int, rng: Generator
) -> Draw:
    """Draw the particles of the next frame from both predictions.

    Args:
        features: Posterior of the last frame.
        projection: The upper layer's prediction of this frame.
        ratios: (F,) alpha, the share to be drawn from it.
        noise_sd_px: b_f, process noise of the features' own dynamics (Bando 2007, ch. 4, eq. 4.6).
        count: N, particles per feature.
        rng: The frame's generator.

    Raises:
        TypeError: An argument is not an array of real numbers, or the count is not a whole number.
        ValueError: An array has another shape, a ratio is not between 0 and 1, or the count is below 1.
    """
    check_count("count", count)
    size = check(
        missing=True,
        coordinates=(features.coordinates, "F 4 N"),
        means=(projection.means, "F 2 2"),
        covariances=(projection.covariances, "F 2 2 2"),
        ratios=(ratios, "F"),
    )["F"]
    if not ((ratios >= 0.0) & (ratios <= 1.0)).all():
        raise ValueError(f"ratios must be between 0 and 1, got {ratios.min():g} to {ratios.max():g}")
    normals, uniforms = rng.standard_normal((size, 4, count)), rng.random((size, count))
    lower = features.coordinates, features.survivors
    return _draw(lower, (projection.means, projection.covariances), ratios, float(noise_sd_px), normals, uniforms)


def weigh(drawn: Draw, log_likelihoods: Floats, rng: Generator) -> Features:
    """Weigh particles by their likelihood alone, and draw the survivors systematically.

    Args:
        drawn: The particles.
        log_likelihoods: (F, N) up to a constant for each feature; NaN counts as impossible. A feature keeps its
            particles with equal weights if all are impossible.
        rng: The frame's generator.

    Raises:
        TypeError: The likelihoods are not an array of real numbers.
        ValueError: Their number differs from that of the particles.
    """
    check(missing=True, coordinates=(drawn.coordinates, "F 4 N"), log_likelihoods=(log_likelihoods, "F N"))
    offsets = rng.random(len(drawn.upper_counts))
    log_weights, survivors, means, covariances, log_evidences = _weigh(drawn.coordinates, log_likelihoods, offsets)
    return Features(*drawn, log_weights, survivors, means, covariances, log_evidences)


def orphan(features: Features) -> Features:
    """Return features whose particles have no parents, because another filter handled the last frame."""
    return replace(features, parents=np.full_like(features.parents, -1))


def hold(features: Features) -> Features:
    """Return features for a frame without a draw: each particle stays as it was in the last frame."""
    return replace(features, parents=np.arange(features.parents.size).reshape(features.parents.shape))


def surviving(features: Features) -> Floats:
    """Return the positions of the survivors, (F, 2, N) px."""
    return _surviving(features.coordinates, features.survivors)


def propagate(features: Features) -> Floats:
    """Return where the survivors move without noise, 2 x_t - x_{t-1}, (F, 2, N) px."""
    return _propagate(features.coordinates, features.survivors)


@compiled
def _draw(
    lower: tuple[Floats, Ints],
    upper: tuple[Floats, Floats],
    ratios: Floats,
    noise_sd: float,
    normals: Floats,
    uniforms: Floats,
) -> Draw:
    """Return the drawn particles, given coordinates and survivors of the last frame, and a `Projection`'s moments."""
    (coordinates, survivors), (means, covariances) = lower, upper
    features, _, count = normals.shape
    drawn = np.empty((features, 4, count))
    upper_counts, parents = np.empty(features, np.int64), np.full((features, count), -1, np.int64)
    for n in range(features):
        from_upper = int(np.rint(ratios[n] * count))
        upper_counts[n] = from_upper
        for axis in range(2):
            # The factor of the covariance of this frame's and the last frame's position.
            now = np.sqrt(max(covariances[n, axis, 0, 0], 0.0))
            shared = covariances[n, axis, 1, 0] / now if now > 0.0 else 0.0
            rest = np.sqrt(max(covariances[n, axis, 1, 1] - shared * shared, 0.0))
            for i in range(from_upper):
                first, second = normals[n, axis, i], normals[n, 2 + axis, i]
                drawn[n, axis, i] = means[n, axis, 0] + now * first
                drawn[n, 2 + axis, i] = means[n, axis, 1] + shared * first + rest * second
        for i in range(from_upper, count):
            parent = survivors[n, int(uniforms[n, i] * survivors.shape[1])]
            parents[n, i] = n * coordinates.shape[2] + parent
            for axis in range(2):
                newest, older = coordinates[n, axis, parent], coordinates[n, 2 + axis, parent]
                drawn[n, axis, i] = 2.0 * newest - older + noise_sd * normals[n, axis, i]
                drawn[n, 2 + axis, i] = newest
    return Draw(drawn, upper_counts, parents)


@compiled
def _weigh(
    coordinates: Floats, log_likelihoods: Floats, offsets: Floats
) -> tuple[Floats, Ints, Floats, Floats, Floats]:
    features, _, count = coordinates.shape
    log_weights, survivors = np.empty((features, count)), np.empty((features, count), np.int64)
    means, covariances = np.empty((features, 2)), np.empty((features, 2, 2))
    log_evidences = np.empty(features)
    for n in range(features):
        normalised, log_sum = normalise(log_likelihoods[n])
        log_evidences[n] = log_sum - np.log(count)
        weights = exponentials(normalised)
        mean, covariance = moments(coordinates[n, :2].T, weights)
        parents = systematic_parents(weights, offsets[n], count)
        for i in range(count):
            log_weights[n, i] = normalised[i]
            survivors[n, i] = parents[i]
        for axis in range(2):
            means[n, axis] = mean[axis]
            for other in range(2):
                covariances[n, axis, other] = covariance[axis, other]
    return log_weights, survivors, means, covariances, log_evidences


@compiled
def _surviving(coordinates: Floats, survivors: Ints) -> Floats:
    features, count = survivors.shape
    kept = np.empty((features, 2, count))
    for n in range(features):
        for axis in range(2):
            for i in range(count):
                kept[n, axis, i] = coordinates[n, axis, survivors[n, i]]
    return kept


@compiled
def _propagate(coordinates: Floats, survivors: Ints) -> Floats:
    features, count = survivors.shape
    moved = np.empty((features, 2, count))
    for n in range(features):
        for axis in range(2):
            for i in range(count):
                parent = survivors[n, i]
                moved[n, axis, i] = 2.0 * coordinates[n, axis, parent] - coordinates[n, 2 + axis, parent]
    return moved
