"""Likelihood of measured point positions: Gaussian, with each point's own noise.

A hidden point is measured, too, with a wild error; its noise is known to be large, so it has almost no effect (Bando
2007, ch. 4, eq. 4.7, with the noise of each point in place of one for all).

When something covers a feature, a likelihood of appearance alone prefers the most similar place on the cover. The
particles stay on the cover and pull the solid along. So a feature is either visible or hidden; if hidden, all its
particles are equally likely. A mixture of the two has three difficulties:

- Fifty particles on a feature, or two of them since the cloud is wide, are the same evidence that it is visible. So the
  best particle counts, not their sum.
- Light, blur and a turn change how all features look. So a feature is compared with the third best of all features,
  since a cover leaves that many visible.
- A head that moves unexpectedly leaves its features outside their clouds, where they look hidden as well. The features
that fit reveal it: they are far from their predictions, and then a bad fit is not evidence of a cover.
"""

import numpy as np

from pftrack.core.arrays import Floats, check
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponential, logarithm


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


LEFT = 3
"""Number of features that a cover leaves visible."""

SAME = 1.0
"""Features whose log likelihood is at most this much below that of the third best fit as well."""

LEAST = -50.0
"""Smallest log likelihood."""

HIDDEN = 3.0
"""Difference of log likelihood between the third best feature and a hidden one, where two poses are compared."""

NEAR = 0.5
"""A feature is where a pose has it if it is within this share of the slack."""


def mix_hidden(
    log_likelihoods: Floats,
    positions: Floats,
    expected: Floats,
    weight: float,
    surprise_px: float,
) -> tuple[Floats, Floats]:
    """Return log likelihoods of particles (F, N) whose features may be hidden, and how likely each is hidden (F,).

    With l the likelihoods of a feature's particles, L the greatest and m the mean of them, and M the third greatest L
    of all features, the feature is hidden with the odds o = h e^(-s^2 / 2) M / L, and the likelihoods are l + o m. The
    features that fit are s standard deviations from where they were expected, by their median.

    Args:
        log_likelihoods: (F, N) of visible features, up to a constant that all features share.
        positions: (F, N, 2) px of the particles.
        expected: (F, 2) px, where the solid has the features.
        weight: h, the odds that a feature is hidden which fits as well as the third best.
        surprise_px: Standard deviation of the distance of features from their predictions while the solid moves as
            expected.

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: The arrays differ in length.
    """
    _check(log_likelihoods, positions, expected)
    bounded = np.maximum(np.where(np.isnan(log_likelihoods), LEAST, log_likelihoods), LEAST)
    peaks = bounded.max(axis=1)
    usual = np.sort(peaks)[-min(LEFT, len(peaks))]
    seen = exponential(bounded - peaks[:, None])
    fits = peaks >= usual - SAME
    means, levels = _moments(np.ascontiguousarray(positions), seen)
    off_px2 = np.sort(np.square(means - expected).sum(axis=1)[fits])
    unsurprised = exponential(-0.5 * off_px2[len(off_px2) // 2] / surprise_px**2)
    odds = weight * unsurprised * exponential(usual - peaks)
    mixed = peaks[:, None] + logarithm(seen + (odds * levels)[:, None])
    return mixed, odds / (1.0 + odds)


def log_fits(
    log_likelihoods: Floats,
    positions: Floats,
    expected: Floats,
    slack_px: float,
) -> Floats:
    """Return how well features match where a pose places them, (F,), by the best of their particles.

    A particle counts the less the further it is from there, with the tails of a t distribution of two degrees of
    freedom, since a pose is never quite right.

    Args:
        log_likelihoods: (F, N) of visible features, up to a constant that all features share.
        positions: (F, N, 2) px of the particles.
        expected: (F, 2) px, where the pose has the features.
        slack_px: Scale of a feature's distance from there.

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: The arrays differ in length.
    """
    _check(log_likelihoods, positions, expected)
    bounded = np.maximum(np.where(np.isnan(log_likelihoods), LEAST, log_likelihoods), LEAST)
    off_px2 = np.square(positions - expected[:, None]).sum(axis=2)
    fits: Floats = (bounded - 2.0 * logarithm(1.0 + off_px2 / (2.0 * (NEAR * slack_px) ** 2))).max(axis=1)
    return fits


def compare(first: Floats, second: Floats) -> float:
    """Return the log odds of a pose against another, by the fits of the features to both (F,).

    Each feature is visible or hidden, and hidden it is as likely under both.
    """
    left = min(LEFT, len(first))
    usual = max(np.sort(first)[-left], np.sort(second)[-left])
    hidden = exponential(-HIDDEN)
    return float(
        np.sum(logarithm(exponential(first - usual) + hidden) - logarithm(exponential(second - usual) + hidden))
    )


def _check(log_likelihoods: Floats, positions: Floats, expected: Floats) -> None:
    check(
        missing=True,
        log_likelihoods=(log_likelihoods, "F N"),
        positions=(positions, "F N 2"),
        expected=(expected, "F 2"),
    )


@compiled
def _moments(positions: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Return the weighted means of particles (F, 2) px, and the means of their weights (F,)."""
    features, count = weights.shape
    means, levels = np.zeros((features, 2)), np.zeros(features)
    for i in range(features):
        for j in range(count):
            levels[i] += weights[i, j]
            means[i, 0] += weights[i, j] * positions[i, j, 0]
            means[i, 1] += weights[i, j] * positions[i, j, 1]
        means[i] /= levels[i]
        levels[i] /= count
    return means, levels
