"""Particles of a solid's whole pose: what a filter in a file believes of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.rotation import rotation
from pftrack.core.model.series import SeriesValue
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.gaussian import Gaussian
from pftrack.core.numerics.matrices import contiguous_copy
from pftrack.experiments.shared.pose.solid import Solid
from pftrack.filters.particles import ParticleSet

__all__ = ["PoseParticles", "project_all"]


def project_all(poses: NDArray[np.float64], solid: Solid) -> NDArray[np.float64]:
    """Return where a pinhole sees the points of a solid in each of N poses, (F, N, 2) px.

    Args:
        poses: (N, 6) angles, rad, and where the origin of the solid's frame is in the camera's frame, mm.
        solid: With F points.
    """
    seen = _project_all(contiguous_copy(poses), contiguous_copy(solid.points_mm), float(solid.focal_px))
    return np.asarray(seen + solid.principal_px)


@compiled
def _project_all(poses: NDArray[np.float64], points_mm: NDArray[np.float64], focal_px: float) -> NDArray[np.float64]:
    features, count = points_mm.shape[0], poses.shape[0]
    seen = np.empty((features, count, 2))
    for n in range(count):
        turn = rotation(poses[n, :3])
        for f in range(features):
            x, y, z = poses[n, 3], poses[n, 4], poses[n, 5]
            for k in range(3):
                x += turn[0, k] * points_mm[f, k]
                y += turn[1, k] * points_mm[f, k]
                z += turn[2, k] * points_mm[f, k]
            scale = focal_px / max(z, 1.0)  # behind the camera nothing is seen; such a pose explains nothing
            seen[f, n, 0] = scale * x
            seen[f, n, 1] = scale * y
    return seen


@dataclass(frozen=True, slots=True, eq=False)
class PoseParticles:
    """The posterior of a solid's pose by particles, and of its points by where these see them; see `Belief`.

    Attributes:
        particles: (N, 6) angles, rad, and place in the camera's frame, mm.
        positions: (F, N, 2) px, where each sees the points.
        log_evidence: Log p(z_t | z_{1:t-1}) up to a constant.
        moments: Mean (6,) and covariance (6, 6) of the particles.
    """

    particles: ParticleSet
    positions: NDArray[np.float64]
    log_evidence: float
    moments: tuple[NDArray[np.float64], NDArray[np.float64]]

    @classmethod
    def of(cls, particles: ParticleSet, solid: Solid, log_evidence: float) -> Self:
        """Return the belief that particles are before a solid's camera."""
        return cls(particles, project_all(particles.states, solid), log_evidence, particles.moments)

    @property
    def pose(self) -> Gaussian:
        """Belief in the angles, rad."""
        mean, covariance = self.moments
        return Gaussian(mean[:3], covariance[:3, :3])

    @property
    def log_weights(self) -> NDArray[np.float64]:
        """(N,), of all points at once."""
        return self.particles.log_weights

    @property
    def upper_counts(self) -> NDArray[np.int64]:
        """(F,) all of them: each particle's own pose predicts its points."""
        return np.full(len(self.positions), len(self.particles))

    @property
    def means(self) -> NDArray[np.float64]:
        """(F, 2) px."""
        weights = exponentials(self.log_weights)
        return np.asarray((self.positions * weights[:, None]).sum(axis=1))

    @property
    def covariances(self) -> NDArray[np.float64]:
        """(F, 2, 2) px^2."""
        off = self.positions - self.means[:, None]
        weights = exponentials(self.log_weights)
        return np.asarray((off[:, :, :, None] * off[:, :, None, :] * weights[:, None, None]).sum(axis=1))

    @property
    def hidden(self) -> NDArray[np.float64]:
        """(F,) none: each particle explains all points, as its file has it."""
        return np.zeros(len(self.positions))

    @property
    def all_visible(self) -> bool:
        """Nothing tells that a point is hidden."""
        return True

    @property
    def follows_solid(self) -> None:
        """There is one prediction only."""
        return

    @property
    def place_mm(self) -> NDArray[np.float64]:
        """(3,) mean of the places."""
        return self.moments[0][3:]

    def camera(self, solid: Solid) -> NDArray[np.float64]:
        """Return the affine camera that sees the solid as the pinhole does near its origin."""
        turn, (x, y, z) = rotation(self.moments[0][:3]), self.place_mm
        scale = solid.focal_px / max(z, 1.0)
        return np.column_stack([scale * turn[:2], solid.principal_px + scale * np.array([x, y])])

    def own_series(self) -> Mapping[str, SeriesValue]:
        """Return what all clouds of particles report."""
        return {"unique_ancestors": float(self.particles.unique_ancestors)}

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        return self.particles.nbytes + self.positions.nbytes + 1024
