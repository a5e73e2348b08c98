"""An upper layer on the pinhole camera: pose and translation by an extended Kalman filter.

The state is q = (theta_x, theta_y, theta_z, t_x, t_y, t_z) and its predecessor, with second-order dynamics. Feature n
lies at R(theta) X_n + t in the camera's frame and is seen through the pinhole there. Unlike the affine camera this
model handles perspective and an approaching object correctly, but is not linear; it is linearised at the predicted
state (Bando 2007, Appendix E, whose eq. A.39 is this linearisation, corrected: docs/methods/adaptive.md).
"""

import math
from dataclasses import dataclass, field

import numpy as np

from pftrack.core.arrays import Floats, check
from pftrack.core.geometry import derivatives, rotation, turn
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import contiguous_copy, multiply, pinhole, pinhole_jacobian
from pftrack.core.numerics.random import Gaussian, Generator
from pftrack.filters.adaptive import Projection
from pftrack.filters.sequential import condition, predict_second_order

POSE_NOISE = (*(float(np.deg2rad(1.0)),) * 3, 1.0, 1.0, 1.0)
"""Process noise of the angles, rad, and of the translation, mm."""


@dataclass(frozen=True, eq=False)
class PerspectiveLayer:
    """Points of an object seen by a pinhole camera; the belief is a Gaussian over (q_t, q_{t-1}), (12,).

    Attributes:
        points_mm: (F, 3) in the object's frame.
        focal_px: Focal length.
        start: (6,) q at the beginning, rad and mm.
        principal_px: (2,) principal point.
        noise_sd: (6,) process noise, rad and mm per frame.
        reach_rad: Turn of the object from the start (standard deviation), if it is held. It hardly affects a pose that
            is well observed; a poorly observed pose returns instead of turning further and further.
    """

    points_mm: Floats
    focal_px: float
    start: Floats
    principal_px: Floats = field(default_factory=lambda: np.zeros(2))
    noise_sd: Floats = field(default_factory=lambda: np.array(POSE_NOISE))
    reach_rad: float = math.inf

    def __post_init__(self) -> None:
        """Store arrays in the one form that compiled code expects.

        Raises:
            TypeError: An argument is not an array of real numbers.
            ValueError: An array has another shape, or is not finite.
        """
        check(points_mm=(self.points_mm, "F 3"), principal_px=(self.principal_px, "2"))
        check(start=(self.start, "6"), noise_sd=(self.noise_sd, "6"))
        object.__setattr__(self, "points_mm", contiguous_copy(self.points_mm))
        object.__setattr__(self, "principal_px", contiguous_copy(self.principal_px))
        object.__setattr__(self, "focal_px", float(self.focal_px))
        object.__setattr__(self, "reach_rad", float(self.reach_rad))

    def begin(self) -> Gaussian:
        """Begin at the start, at rest, as certain as one frame's process noise."""
        variances = self.noise_sd**2
        return Gaussian(np.concatenate([self.start, self.start]), np.diag(np.concatenate([variances, variances])))

    def predict(self, belief: Gaussian) -> Gaussian:
        """Return the belief a frame later."""
        return Gaussian(*predict_second_order(belief.mean, belief.covariance, self.noise_sd))

    def project(self, belief: Gaussian) -> Projection:
        """Return where the features should be seen: h_n(q) with covariance H_n V H_n^T, axis by axis."""
        means, covariances = project(belief.mean, belief.covariance, self.points_mm, self.focal_px, self.principal_px)
        return Projection(means, covariances)

    def update(self, belief: Gaussian, positions: Floats, variances: Floats, rng: Generator) -> Gaussian:
        """Condition on positions (F, 2) px with variances (F, 2) px^2.

        Raises:
            TypeError: An argument is not an array of real numbers.
            ValueError: An array has another shape, or is not finite.
        """
        del rng
        check(points_mm=(self.points_mm, "F 3"), positions=(positions, "F 2"), variances=(variances, "F 2"))
        solid, seen = (self.points_mm, self.focal_px, self.principal_px), (positions, variances)
        return Gaussian(*_observe(belief.mean, belief.covariance, solid, seen, self.reach_rad**2))

    def pose(self, belief: Gaussian) -> Gaussian:
        """Return the belief in the angles, rad."""
        return Gaussian(belief.mean[:3], belief.covariance[:3, :3])


@compiled
def features(state: Floats, points_mm: Floats, focal_px: float) -> tuple[Floats, Floats]:
    """Return where points (F, 3) are seen, (F, 2) px from the principal point, and the derivatives (F, 2, 6) by q.

    Raises:
        ValueError: An array has another size.
    """
    if state.shape[0] != 6 or points_mm.shape[1] != 3:
        raise ValueError("expected a state (6,) and points (F, 3), got other sizes")
    count = points_mm.shape[0]
    theta = state[:3]
    seen = turn(points_mm, rotation(theta))
    for n in range(count):
        for i in range(3):
            seen[n, i] += state[3 + i]
    slopes = pinhole_jacobian(seen, focal_px)
    turns = derivatives(theta)
    jacobian = np.empty((count, 2, 6))
    for axis in range(3):
        moved = turn(points_mm, turns[axis])
        for n in range(count):
            for i in range(2):
                jacobian[n, i, axis] = slopes[n, i, i] * moved[n, i] + slopes[n, i, 2] * moved[n, 2]
                jacobian[n, i, 3 + axis] = slopes[n, i, axis]
    return pinhole(seen, focal_px), jacobian


@compiled
def project(
    mean: Floats, covariance: Floats, points_mm: Floats, focal_px: float, principal_px: Floats
) -> tuple[Floats, Floats]:
    """Return the Gaussians of `Projection`, given mean (12,) and covariance (12, 12) of (q_t, q_{t-1}).

    Raises:
        ValueError: An array has another size.
    """
    if mean.shape[0] != 12 or covariance.shape != (12, 12) or principal_px.shape[0] != 2:
        raise ValueError("expected a mean (12,), a covariance (12, 12) and a principal point (2,), got other sizes")
    count = points_mm.shape[0]
    means, covariances = np.empty((count, 2, 2)), np.empty((count, 2, 2, 2))
    jacobian = np.zeros((count, 2, 2, 12))
    for age in range(2):
        pixels, slopes = features(mean[6 * age : 6 * age + 6], points_mm, focal_px)
        for n in range(count):
            for axis in range(2):
                means[n, axis, age] = pixels[n, axis] + principal_px[axis]
                for i in range(6):
                    jacobian[n, axis, age, 6 * age + i] = slopes[n, axis, i]
    for n in range(count):
        for axis in range(2):
            both = jacobian[n, axis]
            spread = multiply(multiply(both, covariance), both.T.copy())
            for age in range(2):
                for other in range(2):
                    covariances[n, axis, age, other] = spread[age, other]
    return means, covariances


@compiled
def _observe(
    mean: Floats, covariance: Floats, solid: tuple[Floats, float, Floats], seen: tuple[Floats, Floats], held: float
) -> tuple[Floats, Floats]:
    """Return the posterior's mean and covariance.

    Args:
        mean: (12,) of the prior.
        covariance: (12, 12) of the prior.
        solid: Points (F, 3) mm, focal length and principal point (2,), px.
        seen: Positions (F, 2) px and their variances (F, 2) px^2.
        held: Variance of the angles about 0; infinite if the object is not held.
    """
    (points_mm, focal_px, principal_px), (positions, variances) = solid, seen
    count = points_mm.shape[0]
    pixels, slopes = features(mean[:6], points_mm, focal_px)
    jacobian = np.zeros((2 * count, 12))
    residuals, noise = np.empty(2 * count), np.empty(2 * count)
    for n in range(count):
        for axis in range(2):
            row = 2 * n + axis
            residuals[row] = positions[n, axis] - pixels[n, axis] - principal_px[axis]
            noise[row] = variances[n, axis]
            for i in range(6):
                jacobian[row, i] = slopes[n, axis, i]
    posterior, spread, _ = condition(mean, covariance, residuals, jacobian, noise)
    if np.isfinite(held):
        posterior, spread, _ = condition(posterior, spread, -posterior[:3], np.eye(3, 12), np.full(3, held))
    return posterior, spread
