"""Lesson 3 in closed form: mean and variance of what is left of a normal prior after one measurement.

A measured position leaves a normal posterior. A measured distance leaves one to either side of the camera, both cut off
there. Places and distances are in m.
"""

import math

import numpy as np
from scipy.special import log_ndtr


def after_position(prior_mean: float, prior_sd: float, noise_sd: float, measured: float) -> tuple[float, float]:
    """Return mean and variance after a position was measured."""
    _, mean, variance = _product(prior_mean, prior_sd, noise_sd, measured)
    return mean, variance


def after_distance(
    prior_mean: float, prior_sd: float, noise_sd: float, measured: float, camera: float
) -> tuple[float, float]:
    """Return mean and variance after the distance to a camera was measured."""
    sides = [_one_side(prior_mean, prior_sd, noise_sd, measured, camera, side) for side in (-1.0, 1.0)]
    log_areas, means, variances = np.array(sides).T
    shares = np.exp(log_areas - log_areas.max())
    shares /= shares.sum()
    mean = float(shares @ means)
    return mean, float(shares @ (variances + np.square(means - mean)))


def _product(prior_mean: float, prior_sd: float, noise_sd: float, centre: float) -> tuple[float, float, float]:
    """Multiply the prior by N(x; centre, noise^2): logarithm of the product's area, its mean and its variance."""
    prior, noise = prior_sd**2, noise_sd**2
    both = prior + noise
    mean = (prior_mean * noise + centre * prior) / both
    return -0.5 * ((centre - prior_mean) ** 2 / both + math.log(both)), mean, prior * noise / both


def _one_side(
    prior_mean: float, prior_sd: float, noise_sd: float, measured: float, camera: float, side: float
) -> tuple[float, float, float]:
    """Return the same of the part right (1) or left (-1) of the camera: a normal density that is cut off there."""
    log_area, mean, variance = _product(prior_mean, prior_sd, noise_sd, camera + side * measured)
    sd, away = math.sqrt(variance), side * (mean - camera)
    cut = -away / sd
    log_kept = float(log_ndtr(-cut))
    ratio = math.exp(-0.5 * cut * cut - log_kept) / math.sqrt(2.0 * math.pi)
    return log_area + log_kept, camera + side * (away + sd * ratio), variance * (1.0 + cut * ratio - ratio * ratio)
