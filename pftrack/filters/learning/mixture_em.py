"""Online expectation maximisation of a mixing ratio: the trust in each feature's two predictions.

Particles of a feature are drawn from a mixture, pi = alpha p_a + (1 - alpha) p_x, of the upper layer's prediction p_a
and the feature's own p_x (`filters.adaptive`). The survivors of the observation show which prediction was right. Alpha
maximises the likelihood of the survivors under pi, discounted by a factor lambda a frame, which minimises the
Kullback-Leibler divergence of the posterior from pi (Bando 2007, ch. 4 section 2 and Appendix C). One step per frame:

- *E step*: responsibility of p_a for a survivor, r = alpha p_a / (alpha p_a + (1 - alpha) p_x);
- *statistics*: s_t = (1 - eta_t) s_{t-1} + eta_t mean(r), eta_t = 1 / (1 + lambda / eta_{t-1}), eta_1 = 1 (eq. A.30);
- *M step*: alpha = s_t, kept away from 0 and 1, since a component without particles could never come back.

With lambda = 0.5 the memory is about two frames: strong forgetting, though Bando calls it "very large".

The choice of p_x decides what is learned. Bando's kernel mixture around the propagated survivors (`kernel`) is exact;
an observation without information then leaves alpha unchanged on average. As a Gaussian with the same moments
(`gaussian`) a cloud that has spread out while its feature was hidden explains the survivors worse than the tight upper
prediction does, and alpha rises, as Bando shows (fig. 4.7).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials, logarithms
from pftrack.core.numerics.matrices import contiguous_copy, total

STEEPEST = 500.0
"""Log ratios of densities are clipped to this size."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How to adapt the ratio.

    Attributes:
        forgetting: lambda, 0..1.
        clip: alpha stays within [clip, 1 - clip], 0..0.5.
        lower_density: The form of p_x.
    """

    forgetting: float = 0.5
    clip: float = 0.1
    lower_density: Literal["gaussian", "kernel"] = "gaussian"


@dataclass(frozen=True, slots=True)
class Mixture:
    """The learned state of F features, immutable.

    Attributes:
        ratios: alpha, (F,), the share of particles to be drawn from the upper prediction in the next frame.
        responsibilities: s, (F,) discounted mean responsibility of the upper prediction.
        eta: Weight of the last frame; 0 before the first.
    """

    ratios: Floats
    responsibilities: Floats
    eta: float


def begin(count: int, ratio: float = 0.5) -> Mixture:
    """Begin with the same ratio for all of `count` features."""
    return Mixture(np.full(count, ratio), np.full(count, ratio), 0.0)


def adapt(
    mixture: Mixture,
    survivors: Floats,
    upper: tuple[Floats, Floats],
    lower: Floats,
    noise_sd_px: float,
    settings: Settings,
) -> Mixture:
    """Take one frame in.

    Args:
        mixture: State with the ratios by which this frame's particles were drawn.
        survivors: (F, 2, N) px, the positions that survived this frame's observation, equally weighted.
        upper: Means (F, 2) px and variances (F, 2) px^2 of p_a in this frame.
        lower: (F, 2, M) px, the last frame's survivors propagated without noise.
        noise_sd_px: b_f, the process noise that they would receive.
        settings: How to adapt.
    """
    shares = responsibilities(
        survivors,
        mixture.ratios,
        contiguous_copy(upper[0]),
        contiguous_copy(upper[1]),
        lower,
        float(noise_sd_px),
        kernel=settings.lower_density == "kernel",
    )
    eta = 1.0 / (1.0 + settings.forgetting / mixture.eta) if mixture.eta > 0.0 else 1.0
    learned = mixture.responsibilities + eta * (shares - mixture.responsibilities)
    return Mixture(learned.clip(settings.clip, 1.0 - settings.clip), learned, eta)


@compiled
def responsibilities(
    survivors: Floats,
    ratios: Floats,
    upper_means: Floats,
    upper_variances: Floats,
    lower: Floats,
    noise_sd_px: float,
    kernel: bool,
) -> Floats:
    """Return the mean responsibility (F,) of the upper prediction for each feature's survivors; see `adapt`."""
    count, _, size = survivors.shape
    shares = np.empty(count)
    for n in range(count):
        ratio = ratios[n]
        if ratio <= 0.0 or ratio >= 1.0:
            shares[n] = ratio
            continue
        points = survivors[n]
        spread = np.zeros((2, 2))
        spread[0, 0], spread[1, 1] = upper_variances[n, 0], upper_variances[n, 1]
        above = gaussian_log_density(points, upper_means[n], spread)
        if kernel:
            below = kernel_log_density(points, lower[n], noise_sd_px)
        else:
            mean, covariance = _match(lower[n])
            covariance[0, 0] += noise_sd_px**2
            covariance[1, 1] += noise_sd_px**2
            below = gaussian_log_density(points, mean, covariance)
        for i in range(size):
            below[i] = min(max(below[i] - above[i], -STEEPEST), STEEPEST)
        odds = exponentials(below)
        share = 0.0
        for i in range(size):
            share += 1.0 / (1.0 + (1.0 - ratio) / ratio * odds[i])
        shares[n] = share / size
    return shares


@compiled
def gaussian_log_density(points: Floats, mean: Floats, covariance: Floats) -> Floats:
    """Return log N(x | mean, covariance), (N,), of points (2, N) in the plane."""
    first, both, second = covariance[0, 0], covariance[0, 1], covariance[1, 1]
    determinant = first * second - both * both
    constant = -np.log(2.0 * np.pi) - 0.5 * np.log(determinant)
    densities = np.empty(points.shape[1])
    for i in range(points.shape[1]):
        x, y = points[0, i] - mean[0], points[1, i] - mean[1]
        densities[i] = constant - 0.5 * (second * x * x - 2.0 * both * x * y + first * y * y) / determinant
    return densities


@compiled
def kernel_log_density(points: Floats, centres: Floats, sd: float) -> Floats:
    """Return log (1/M) sum_j N(x | c_j, sd^2 I), (N,), of points (2, N), given centres (2, M)."""
    count, size = points.shape[1], centres.shape[1]
    tops, sums = np.empty(count), np.empty(count)
    exponents = np.empty(size)
    for i in range(count):
        for j in range(size):
            x, y = points[0, i] - centres[0, j], points[1, i] - centres[1, j]
            exponents[j] = -0.5 * (x * x + y * y) / (sd * sd)
        tops[i] = exponents[0]
        for j in range(size):
            tops[i] = max(tops[i], exponents[j])
        for j in range(size):
            exponents[j] -= tops[i]
        sums[i] = total(exponentials(exponents))
    densities = logarithms(sums)
    for i in range(count):
        densities[i] += tops[i] - np.log(2.0 * np.pi * sd * sd * size)
    return densities


@compiled
def _match(points: Floats) -> tuple[Floats, Floats]:
    """Return the mean (2,) and covariance (2, 2) of points (2, M)."""
    size = points.shape[1]
    mean, covariance = np.zeros(2), np.zeros((2, 2))
    for j in range(size):
        mean[0] += points[0, j] / size
        mean[1] += points[1, j] / size
    for j in range(size):
        x, y = points[0, j] - mean[0], points[1, j] - mean[1]
        covariance[0, 0] += x * x / size
        covariance[0, 1] += x * y / size
        covariance[1, 1] += y * y / size
    covariance[1, 0] = covariance[0, 1]
    return mean, covariance
