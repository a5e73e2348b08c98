"""Pose from the entries of an affine camera.

A rigid object that turns by R(theta) in front of the camera P_0 = (A_0, .) is seen by a camera whose first three
columns are A = A_0 R(theta): six numbers that say three angles (Bando 2007, Appendix D, eq. A.31, without the last
column, which only says where the object is). The six entries and their covariance come from a Kalman filter and are the
measurement here. The angles walk at random, since second-order dynamics diverge while the entries are poor.

- `extended_step`: the extended Kalman filter, linearised at the predicted angles (Appendix D.2);
- `particle`: particles of the angles (Appendix D.1).
"""

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.geometry.rotation import derivatives, rotation
from pftrack.core.numerics.checks import check, check_count
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import cholesky, multiply, product
from pftrack.core.numerics.random import Gaussian, Generator
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.filters.resampling import systematic
from pftrack.filters.sequential import condition, decorrelate

THETA_SD_RAD = float(np.deg2rad(3.0))
THETA_COUNT = 500


def entries(mean: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """Return the six entries of A by rows, (6,) px/mm, and their covariance (6, 6), from the two rows of a camera.

    Args:
        mean: (2, d) of the rows, d >= 3, which begin with those of A.
        covariance: (2, d, d) of each row; the rows are independent.

    Raises:
        TypeError: One is not an array of real numbers.
        ValueError: One has another shape, or is not finite.
    """
    if check(mean=(mean, "2 d"), covariance=(covariance, "2 d d"))["d"] < 3:
        raise ValueError(f"mean must be (2, d) with d at least 3, got {mean.shape}")
    both = np.zeros((6, 6))
    both[:3, :3], both[3:, 3:] = covariance[0, :3, :3], covariance[1, :3, :3]
    return mean[:, :3].ravel(), both


def extended_step(
    theta: Gaussian,
    measured: Floats,
    noise: Floats,
    reference: Floats,
    theta_sd_rad: float,
    walk: Floats | None = None,
) -> Gaussian:
    """Return the posterior of the angles (3,), rad, a frame later.

    Args:
        theta: Posterior of the last frame.
        measured: (6,) entries of A by rows, px/mm.
        noise: (6, 6) their covariance.
        reference: A_0, (2, 3) px/mm.
        theta_sd_rad: Standard deviation of the step of each angle.
        walk: (3, 3) covariance of the step in place of that, where angles turn together.

    Raises:
        TypeError: One is not an array of real numbers.
        ValueError: One has another shape, or is not finite.
    """
    check(mean=(theta.mean, "3"), covariance=(theta.covariance, "3 3"))
    _check(measured, noise, reference, walk)
    before, sd = (theta.covariance, theta_sd_rad) if walk is None else (theta.covariance + walk, 0.0)
    mean, covariance = _extended_step(theta.mean, before, measured, noise, reference, sd)
    return Gaussian(mean, covariance)


def particle(
    particles: Floats,
    measured: Floats,
    noise: Floats,
    reference: Floats,
    theta_sd_rad: float,
    rng: Generator,
    count: int,
    walk: Floats | None = None,
) -> tuple[Gaussian, Floats]:
    """Return the posterior of the angles a frame later by particles, and `count` of these, resampled.

    Args:
        particles: (N, 3) of the last frame, equally weighted, rad.
        measured: (6,) entries of A by rows, px/mm.
        noise: (6, 6) their covariance.
        reference: A_0, (2, 3) px/mm.
        theta_sd_rad: Standard deviation of the step of each angle.
        rng: The frame's generator.
        count: Particles wanted.
        walk: (3, 3) covariance of the step in place of `theta_sd_rad`, where angles turn together.

    Raises:
        TypeError: One is not an array of real numbers.
        ValueError: One has another shape, or is not finite.
    """
    check_count("count", count)
    check(particles=(particles, "N 3"))
    _check(measured, noise, reference, walk)
    normals = rng.standard_normal(particles.shape)
    moved = particles + (theta_sd_rad * normals if walk is None else product(normals, cholesky(walk).T))
    log_weights, _ = normalise(_log_likelihood(moved, measured, noise, reference))
    posterior = ParticleSet(moved, log_weights, np.arange(len(moved)))
    return Gaussian(*posterior.moments), moved[systematic(rng, log_weights, count)]


def _check(
    measured: Floats,
    noise: Floats,
    reference: Floats,
    walk: Floats | None,
) -> None:
    check(measured=(measured, "6"), noise=(noise, "6 6"), reference=(reference, "2 3"))
    if walk is not None:
        check(walk=(walk, "3 3"))


@compiled
def _extended_step(
    mean: Floats,
    covariance: Floats,
    measured: Floats,
    noise: Floats,
    reference: Floats,
    theta_sd_rad: float,
) -> tuple[Floats, Floats]:
    residuals = _residuals(measured, reference, rotation(mean))
    slopes = derivatives(mean)
    jacobian = np.empty((6, 3))
    walked = covariance.copy()
    for axis in range(3):
        walked[axis, axis] += theta_sd_rad**2
        seen = multiply(reference, slopes[axis])
        for i in range(6):
            jacobian[i, axis] = seen[i // 3, i % 3]
    residuals, jacobian, variances = decorrelate(residuals, jacobian, noise)
    posterior, spread, _ = condition(mean, walked, residuals, jacobian, variances)
    return posterior, spread


@compiled
def _residuals(measured: Floats, reference: Floats, turn: Floats) -> Floats:
    """Return entries (6,) less those of A_0 R, given A_0 (2, 3) and R (3, 3)."""
    expected = multiply(reference, turn)
    residuals = np.empty(6)
    for i in range(6):
        residuals[i] = measured[i] - expected[i // 3, i % 3]
    return residuals


@compiled
def _log_likelihood(
    theta: Floats,
    measured: Floats,
    noise: Floats,
    reference: Floats,
) -> Floats:
    """Return log N(measured | A_0 R(theta), noise) of angles (N, 3) up to a constant, (N,)."""
    whitening = np.eye(6)
    _, whitening, variances = decorrelate(measured, whitening, noise)
    log_likelihoods = np.zeros(theta.shape[0])
    for n in range(theta.shape[0]):
        residuals = _residuals(measured, reference, rotation(theta[n]))
        for i in range(6):
            total = 0.0
            for j in range(i + 1):
                total += whitening[i, j] * residuals[j]
            log_likelihoods[n] -= 0.5 * total * total / variances[i]
    return log_likelihoods
