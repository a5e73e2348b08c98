"""An upper layer on the affine camera: its eight entries by a Kalman filter, the pose from them by another filter.

The state is the 2 x 4 camera P of `pftrack.core.numerics.matrices` and its predecessor,
P_t = 2 P_{t-1} - P_{t-2} + noise. A feature at X_n is seen at P (X_n; 1), which is linear in the entries, so the filter
is exact for this model (Bando 2007, ch. 4 section 3.1). The rows of P do not interact: there is one filter of eight
components for x and one for y.

What makes it fail: the measured positions are means of particles that may themselves have been drawn from this layer's
prediction, so that information is counted twice. If all of them always are, and the picture says little, the layer
becomes sure of itself, which is why its share is adapted (`learning.mixture_em`).
"""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.checks import check
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import contiguous_copy
from pftrack.core.numerics.random import Gaussian, Generator
from pftrack.filters import affine_pose
from pftrack.filters.layers import Projection
from pftrack.filters.sequential import condition, predict_second_order

ENTRY_NOISE = (0.02, 0.02, 0.02, 1.0)
"""Process noise of the entries of a row: px/mm for the first three, px for the last (Bando 2007, ch. 4 section 3.1)."""


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
        theta_count: Particles of that, if by particles.
        walk: (3, 3) covariance of the angles' step in place of `theta_sd_rad`, rad^2, where they turn together.
    """

    points_mm: Floats
    reference: Floats
    noise_sd: Floats = field(default_factory=lambda: np.array(ENTRY_NOISE))
    theta_sd_rad: float = affine_pose.THETA_SD_RAD
    estimator: Literal["extended", "particle"] = "extended"
    theta_count: int = affine_pose.THETA_COUNT
    walk: Floats | None = None

    def __post_init__(self) -> None:
        """Keep what compiled code gets in the one form for which it is compiled.

        Raises:
            TypeError: One is not an array of real numbers.
            ValueError: One has another shape, or is not finite.
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
            TypeError: One is not an array of real numbers.
            ValueError: One has another shape, or is not finite.
        """
        check(points_mm=(self.points_mm, "F 3"), positions=(positions, "F 2"), variances=(variances, "F 2"))
        mean, covariance = observe(belief.mean, belief.covariance, self.points_mm, positions, variances)
        entries, noise = affine_pose.entries(mean, covariance)
        slopes = np.ascontiguousarray(self.reference[:, :3])
        if self.estimator == "extended":
            theta = affine_pose.extended_step(belief.theta, entries, noise, slopes, self.theta_sd_rad, self.walk)
            return AffineBelief(mean, covariance, theta)
        particles = belief.theta_particles
        if particles is None:
            particles = belief.theta.sample(rng, self.theta_count)
        theta, particles = affine_pose.particle(
            particles, entries, noise, slopes, self.theta_sd_rad, rng, self.theta_count, self.walk
        )
        return AffineBelief(mean, covariance, theta, particles)

    def pose(self, belief: AffineBelief) -> Gaussian:
        """Return the belief in the angles, rad."""
        return belief.theta


@compiled
def predict(mean: Floats, covariance: Floats, noise_sd: Floats) -> tuple[Floats, Floats]:
    """Return mean (2, 8) and covariance (2, 8, 8) a frame later, given the noise (4,) of the entries of a row.

    Raises:
        ValueError: One has another size.
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
        ValueError: One has another size.
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
                # Of this frame's and the last one's position: both means, and all four covariances.
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
        ValueError: One has another size.
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
