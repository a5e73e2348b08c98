"""The state of trackers that estimate the pose of a solid by its points.

Below are the points, each with particles of its own (or all of them together, in the Rao-Blackwellised filter); above
is the solid with its pose. `Solid` is what is known of it beforehand, `PoseState` what is believed in a frame.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.elementary import exponentials
from pftrack.filters.affine import AffineBelief
from pftrack.filters.rao_blackwell import RaoBlackwell
from pftrack.gaussian import Gaussian
from pftrack.geometry.camera import NEAREST_MM, pinhole
from pftrack.geometry.rotation import rotation
from pftrack.trackers.pose.layered import Layered

__all__ = ["PoseState", "Solid"]

CLEAR_RADII = 1.5
"""How far behind a solid's origin its picture is drawn, in radii of its points: a head is larger than its features."""

MOST_RAISED = 0.9
"""Nothing is drawn nearer to the camera than a tenth of its focal length, nor behind it."""


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A rigid object with F points, and the camera before which it is.

    Attributes:
        points_mm: (F, 3) in its own frame.
        reference: (2, 4) the affine camera that sees it at theta = 0.
        focal_px: Focal length of the pinhole.
        principal_px: (2,) its principal point.
        translation_mm: (3,) where the origin of its frame was at the start, in the camera's frame.
    """

    points_mm: NDArray[np.float64]
    reference: NDArray[np.float64]
    focal_px: float
    principal_px: NDArray[np.float64]
    translation_mm: NDArray[np.float64]

    @property
    def scale(self) -> float:
        """How large a mm of it is at the start, px."""
        return float(np.sqrt(abs(np.linalg.det(self.reference[:, :2]))))


@dataclass(frozen=True, slots=True, eq=False)
class PoseState:
    """The posterior of one frame, immutable.

    Attributes:
        solid: What is known of the object.
        belief: Both layers.
        pose: Belief in the angles (theta_x, theta_y, theta_z), rad.
        recognised: (F,) which features the observation confirmed in this frame.
        switched: Whether a feature went over from trusting one prediction more to trusting the other.
        memory: What else a family of trackers carries along.
    """

    solid: Solid
    belief: Layered[Any] | RaoBlackwell
    pose: Gaussian
    recognised: NDArray[np.bool_]
    switched: bool = False
    memory: Any = None

    @property
    def estimate(self) -> NDArray[np.float64]:
        """(3,) mean of the angles, rad."""
        return self.pose.mean

    @property
    def sigma(self) -> NDArray[np.float64]:
        """(3,) standard deviations of the angles, rad."""
        return self.pose.standard_deviations

    @property
    def reference_mean(self) -> None:
        """The exact posterior is never known."""
        return

    @property
    def log_evidence(self) -> float:
        """Log p(z_t | z_{1:t-1}) up to a constant, the features taken together."""
        if isinstance(self.belief, RaoBlackwell):
            return self.belief.log_evidence
        return float(self.belief.features.log_evidences.sum())

    @property
    def resampled(self) -> bool:
        """Whether parents were drawn anew: of features, in every frame."""
        return not isinstance(self.belief, RaoBlackwell)

    @property
    def searching(self) -> bool:
        """Whether what else is carried along says that the object is lost."""
        return bool(getattr(self.memory, "lost", False))

    @property
    def prediction_count(self) -> int:
        """How many particles there are: all of them come from one prediction or the other."""
        return self.log_weights.size

    @property
    def observation_count(self) -> int:
        """None comes from the observation."""
        return 0

    @property
    def effective_sample_size(self) -> float:
        """1 / sum w^2, summed over the features that have particles of their own."""
        weights = np.exp(self.log_weights)
        return float((1.0 / np.square(weights).sum(axis=-1)).sum())

    @property
    def unique_ancestors(self) -> int:
        """How many particles survived, over all features; of joint particles, how many have any weight."""
        if isinstance(self.belief, RaoBlackwell):
            return int(np.count_nonzero(self.log_weights > -700.0))
        return sum(len(np.unique(survivors)) for survivors in self.belief.features.survivors)

    @property
    def log_weights(self) -> NDArray[np.float64]:
        """(F, N) of the features' particles, or (N,) of joint ones."""
        return self.belief.log_weights if isinstance(self.belief, RaoBlackwell) else self.belief.features.log_weights

    @property
    def positions(self) -> NDArray[np.float64]:
        """(F, N, 2) px, of the particles, a view."""
        return self.belief.positions if isinstance(self.belief, RaoBlackwell) else self.belief.features.positions

    @property
    def upper_counts(self) -> NDArray[np.int64]:
        """(F,) how many of each feature's particles, the first ones, came from the upper prediction."""
        if isinstance(self.belief, RaoBlackwell):
            return np.full(len(self.solid.points_mm), len(self.belief.log_weights))
        return self.belief.features.upper_counts

    @property
    def feature_means(self) -> NDArray[np.float64]:
        """(F, 2) px."""
        return self.belief.feature_means if isinstance(self.belief, RaoBlackwell) else self.belief.features.means

    @property
    def feature_covariances(self) -> NDArray[np.float64]:
        """(F, 2, 2) px^2."""
        if isinstance(self.belief, RaoBlackwell):
            return self.belief.feature_covariances
        return self.belief.features.covariances

    @property
    def ratios(self) -> NDArray[np.float64]:
        """(F,) alpha, the share of the upper prediction as learned up to this frame; NaN for joint particles."""
        if isinstance(self.belief, RaoBlackwell):
            return np.full(len(self.solid.points_mm), np.nan)
        return self.belief.mixture.ratios

    @property
    def camera(self) -> NDArray[np.float64]:
        """(2, 4) the affine camera that is believed to see the solid now."""
        if isinstance(self.belief, RaoBlackwell):
            weights = exponentials(self.belief.log_weights)
            camera: NDArray[np.float64] = self.belief.cameras[:, :4] @ weights
            return camera
        upper = self.belief.upper
        if isinstance(upper, AffineBelief):
            return upper.camera
        turn, (x, y, z) = rotation(upper.mean[:3]), upper.mean[3:6]
        scale = self.solid.focal_px / max(z, 1.0)
        return np.column_stack([scale * turn[:2], self.solid.principal_px + scale * np.array([x, y])])

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        size = 8192 + 6 * self.positions.size * 8
        if isinstance(self.belief, RaoBlackwell):
            size += self.belief.cameras.nbytes
        elif isinstance(self.belief.upper, AffineBelief) and self.belief.upper.theta_particles is not None:
            size += self.belief.upper.theta_particles.nbytes
        return size + getattr(self.memory, "nbytes", 0)

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return the particles of the features by name."""
        return {"positions": self.positions, "log_weights": self.log_weights, "upper_counts": self.upper_counts}

    @property
    def translation_mm(self) -> NDArray[np.float64]:
        """(3,) where the origin of the solid's frame is now, in the camera's frame.

        An affine camera knows of no distance; it is then the one at which a mm is as large as at the start.
        """
        place = self._place
        if place is not None:
            return place
        focal, depth = self.solid.focal_px, self.solid.focal_px / self.solid.scale
        return np.append((self.camera[:, 3] - self.solid.principal_px) * depth / focal, depth)

    def height(self, depth_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how high above the picture a drawing shows what is at a depth in the camera's frame, px.

        A drawing has the picture stand behind the solid, clear of it, and the camera a focal length before the picture:
        so a px in the plane of the picture is so many mm there, and everything else has its true proportions.
        """
        radius = float(np.linalg.norm(self.solid.points_mm, axis=1).max())
        plane_mm = max(float(self.translation_mm[2]), NEAREST_MM) + CLEAR_RADII * radius
        focal = self.solid.focal_px
        return np.minimum(focal * (1.0 - depth_mm / plane_mm), MOST_RAISED * focal)

    def seen(self, points_mm: NDArray[np.float64], theta: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Return where points (n, 3) of the solid are seen, (n, 2) px.

        An affine camera is bent back to what a solid of this pose looks like, x = A_0 R(theta) X + its own last column.

        Args:
            points_mm: In the solid's frame.
            theta: Angles (3,) of the solid, rad, if not those that are believed.
        """
        turned = points_mm @ rotation(self.pose.mean if theta is None else theta).T
        place = self._place
        if place is None:
            return turned @ self.solid.reference[:, :3].T + self.camera[:, 3]
        return pinhole(turned + place, self.solid.focal_px) + self.solid.principal_px

    def drawn(self, points_mm: NDArray[np.float64], theta: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Return where points (n, 3) of the solid are seen, and how high above the picture they stand, (n, 3) px."""
        turn = rotation(self.pose.mean if theta is None else theta)
        depths = points_mm @ turn[2] + self.translation_mm[2]
        return np.column_stack([self.seen(points_mm, theta), self.height(depths)])

    @property
    def _place(self) -> NDArray[np.float64] | None:
        """(3,) translation that the upper layer believes in, mm; None for an affine camera."""
        upper = None if isinstance(self.belief, RaoBlackwell) else self.belief.upper
        if upper is None or isinstance(upper, AffineBelief):
            return None
        place: NDArray[np.float64] = upper.mean[3:6]
        return place
