"""An upper layer on the affine camera: its eight entries by a Kalman filter, the pose from them by another filter.

The state is the 2 x 4 camera P of `pftrack.core.numerics.matrices` and its predecessor,
P_t = 2 P_{t-1} - P_{t-2} + noise. A feature at X_n is seen at P (X_n; 1), which is linear in the entries, so the filter
is exact for this model (Bando 2007, ch. 4 section 3.1). The rows of P do not interact: there is one filter of eight
components for x and one for y.

The layer fails when information is counted twice: the measured positions are means of particles that may have been
drawn from this layer's own prediction. If all of them always are, and the picture carries little information, the layer
becomes overconfident. For this reason its share is adapted (`learning.mixture_em`).

The pose follows from the entries. A rigid object that turns by R(theta) in front of the camera P_0 = (A_0, .) is seen
by a camera whose first three columns are A = A_0 R(theta), six numbers that determine three angles (Bando 2007,
Appendix D, eq. A.31, without the last column, which only holds the object's position). The six entries and their
covariance are the measurement of that filter. The angles walk at random, since second-order dynamics diverge while the
entries are poor.

- `extended_step`: the extended Kalman filter, linearised at the predicted angles (Appendix D.2);
- `particle`: particles of the angles (Appendix D.1).
"""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from pftrack.core.arrays import Floats, check, check_count
from pftrack.core.geometry import derivatives, rotation
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import cholesky, contiguous_copy, multiply, product
from pftrack.core.numerics.random import Gaussian, Generator
from pftrack.filters.adaptive import Projection
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.filters.resampling import systematic
from pftrack.filters.sequential import condition, decorrelate, predict_second_order

ENTRY_NOISE = (0.02, 0.02, 0.02, 1.0)
"""Process noise of the entries of a row: px/mm for the first three, px for the last (Bando 2007, ch. 4 section 3.1)."""
THETA_SD_RAD = float(np.deg2rad(3.0))
THETA_COUNT = 500


@dataclass(frozen=True, slots=True)
class AffineBelief:
    """The posterior of the camera's entries, and of the pose.

    Attributes:
        mean: (2, 8) by row of the camera (x, y): its four entries, then the same a frame ago; px/mm and px.
        covariance: (2, 8, 8) of each row; the rows are independent.
        theta: Belief in the angles (3,), rad.
        theta_particles: (N, 3) rad, equally weighted, if the pose is estimated by particles.
    """

    mean: Floats
    covariance: Floats
    theta: Gaussian
    theta_particles: Floats | None = None

    @property
    def camera(self) -> Floats:
        """(2, 4) mean of the camera."""
        camera: Floats = self.mean[:, :4]
        return camera


@dataclass(frozen=True, eq=False)
class AffineLayer:
    """Points of an object seen by an affine camera.

    Attributes:
        points_mm: (F, 3) in the object's frame.
        reference: (2, 4) the camera at theta = 0, P_0.
        noise_sd: (4,) process noise of the entries of each row, per frame.
        theta_sd_rad: Process noise of the angles, per frame.
        estimator: How the pose is estimated from the entries.
        theta_count: Number of particles, if it is estimated by particles.
        walk: (3, 3) covariance of the angles' step in place of `theta_sd_rad`, rad^2, where they turn together.
    """

    points_mm: Floats
    reference: Floats
    noise_sd: Floats = field(default_factory=lambda: np.array(ENTRY_NOISE))
    theta_sd_rad: float = THETA_SD_RAD
    estimator: Literal["extended", "particle"] = "extended"
    theta_count: int = THETA_COUNT
    walk: Floats | None = None

    def __post_init__(self) -> None:
        """Store arrays in the one form that compiled code expects.

        Raises:
            TypeError: An argument is not an array of real numbers.
            ValueError: An array has another shape, or is not finite.
        """
        check(points_mm=(self.points_mm, "F 3"), reference=(self.reference, "2 4"), noise_sd=(self.noise_sd, "4"))
        if self.walk is not None:
            check(walk=(self.walk, "3 3"))
        object.__setattr__(self, "points_mm", contiguous_copy(self.points_mm))

    def begin(self) -> AffineBelief:
        """Begin at the reference camera, at rest, as certain as one frame's process noise."""
        variances = np.tile(self.noise_sd**2, 2)
        theta = Gaussian(np.zeros(3), self.theta_sd_rad**2 * np.eye(3))
        return AffineBelief(np.tile(self.reference, 2), np.stack([np.diag(variances)] * 2), theta)

    def predict(self, belief: AffineBelief) -> AffineBelief:
        """Return the belief a frame later (Bando 2007, ch. 4, eq. 4.5)."""
        mean, covariance = predict(belief.mean, belief.covariance, self.noise_sd)
        return replace(belief, mean=mean, covariance=covariance)

    def project(self, belief: AffineBelief) -> Projection:
        """Return where the features should be seen (Bando 2007, ch. 4, eq. 4.8)."""
        return Projection(*project(belief.mean, belief.covariance, self.points_mm))

    def update(
        self,
        belief: AffineBelief,
        positions: Floats,
        variances: Floats,
        rng: Generator,
    ) -> AffineBelief:
        """Condition the camera on positions (F, 2) px with variances (F, 2) px^2, and the pose on the camera.

        Raises:
            TypeError: An argument is not an array of real numbers.
            ValueError: An array has another shape, or is not finite.
        """
        check(points_mm=(self.points_mm, "F 3"), positions=(positions, "F 2"), variances=(variances, "F 2"))
        mean, covariance = observe(belief.mean, belief.covariance, self.points_mm, positions, variances)
        measured, noise = entries(mean, covariance)
        slopes = np.ascontiguousarray(self.reference[:, :3])
        if self.estimator == "extended":
            theta = extended_step(belief.theta, measured, noise, slopes, self.theta_sd_rad, self.walk)
            return AffineBelief(mean, covariance, theta)
        particles = belief.theta_particles
        if particles is None:
            particles = belief.theta.sample(rng, self.theta_count)
        theta, particles = particle(
            particles, measured, noise, slopes, self.theta_sd_rad, rng, self.theta_count, self.walk
        )
        return AffineBelief(mean, covariance, theta, particles)

    def pose(self, belief: AffineBelief) -> Gaussian:
        """Return the belief in the angles, rad."""
        return belief.theta


@compiled
def predict(mean: Floats, covariance: Floats, noise_sd: Floats) -> tuple[Floats, Floats]:
    """Return mean (2, 8) and covariance (2, 8, 8) a frame later, given the noise (4,) of the entries of a row.

    Raises:
        ValueError: An array has another size.
    """
    if mean.shape != (2, 8) or covariance.shape != (2, 8, 8) or noise_sd.shape[0] != 4:
        raise ValueError("expected a mean (2, 8), a covariance (2, 8, 8) and noises (4,), got other sizes")
    predicted, spread = np.empty((2, 8)), np.empty((2, 8, 8))
    for axis in range(2):
        row, known = predict_second_order(mean[axis], covariance[axis], noise_sd)
        for i in range(8):
            predicted[axis, i] = row[i]
            for j in range(8):
                spread[axis, i, j] = known[i, j]
    return predicted, spread


@compiled
def project(mean: Floats, covariance: Floats, points_mm: Floats) -> tuple[Floats, Floats]:
    """Return means and covariances of `Projection`, given the camera's, (2, 8) and (2, 8, 8), and points (F, 3).

    Raises:
        ValueError: An array has another size.
    """
    if mean.shape != (2, 8) or covariance.shape != (2, 8, 8) or points_mm.shape[1] != 3:
        raise ValueError("expected a mean (2, 8), a covariance (2, 8, 8) and points (F, 3), got other sizes")
    count = points_mm.shape[0]
    means, covariances = np.zeros((count, 2, 2)), np.zeros((count, 2, 2, 2))
    row = np.ones(4)
    for n in range(count):
        for i in range(3):
            row[i] = points_mm[n, i]
        for axis in range(2):
            for place in range(4):
                # Both means and all four covariances of the positions in this frame and in the last.
                age, other = place // 2, place % 2
                total = 0.0
                for i in range(4):
                    along = 0.0
                    for j in range(4):
                        along += covariance[axis, 4 * age + i, 4 * other + j] * row[j]
                    total += row[i] * along
                covariances[n, axis, age, other] = total
                if other == 0:
                    for i in range(4):
                        means[n, axis, age] += row[i] * mean[axis, 4 * age + i]
    return means, covariances


@compiled
def observe(
    mean: Floats,
    covariance: Floats,
    points_mm: Floats,
    positions: Floats,
    variances: Floats,
) -> tuple[Floats, Floats]:
    """Condition the camera on measured features (Bando 2007, ch. 4, eq. 4.4).

    Args:
        mean: (2, 8) of the prior.
        covariance: (2, 8, 8) of the prior.
        points_mm: (F, 3).
        positions: (F, 2) px.
        variances: (F, 2) px^2.

    Returns:
        Mean and covariance of the posterior.

    Raises:
        ValueError: An array has another size.
    """
    count = points_mm.shape[0]
    if positions.shape != (count, 2) or variances.shape != (count, 2):
        raise ValueError("expected positions (F, 2) and variances (F, 2) for points (F, 3), got other sizes")
    if mean.shape != (2, 8) or covariance.shape != (2, 8, 8) or points_mm.shape[1] != 3:
        raise ValueError("expected a mean (2, 8), a covariance (2, 8, 8) and points (F, 3), got other sizes")
    jacobian = np.zeros((count, 8))
    for n in range(count):
        for i in range(3):
            jacobian[n, i] = points_mm[n, i]
        jacobian[n, 3] = 1.0
    updated, spread = np.empty((2, 8)), np.empty((2, 8, 8))
    residuals, noise = np.empty(count), np.empty(count)
    for axis in range(2):
        for n in range(count):
            noise[n] = variances[n, axis]
            residuals[n] = positions[n, axis]
            for i in range(4):
                residuals[n] -= jacobian[n, i] * mean[axis, i]
        row, known, _ = condition(mean[axis], covariance[axis], residuals, jacobian, noise)
        for i in range(8):
            updated[axis, i] = row[i]
            for j in range(8):
                spread[axis, i, j] = known[i, j]
    return updated, spread


def entries(mean: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """Return the six entries of A by rows, (6,) px/mm, and their covariance (6, 6), from the two rows of a camera.

    Args:
        mean: (2, d) of the rows, d >= 3, which begin with those of A.
        covariance: (2, d, d) of each row; the rows are independent.

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: An array has another shape, or is not finite.
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
        walk: (3, 3) covariance of the step, used instead where angles turn together.

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: An array has another shape, or is not finite.
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
        TypeError: An argument is not an array of real numbers.
        ValueError: An array has another shape, or is not finite.
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
