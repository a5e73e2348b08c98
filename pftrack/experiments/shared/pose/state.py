"""The state of trackers that estimate the pose of a solid by its points: `PoseState`, what is believed in a frame."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats
from pftrack.core.geometry.rotation import rotation
from pftrack.core.numerics.matrices import pinhole, product
from pftrack.core.numerics.random import Gaussian
from pftrack.experiments.shared.pose.beliefs import GAUSSIAN, Belief, Solid, Widths
from pftrack.experiments.shared.pose.calibrated import Calibration


@dataclass(frozen=True, slots=True, eq=False)
class PoseState:
    """The posterior of one frame, immutable.

    Attributes:
        solid: What is known of the object.
        belief: In its points and its pose.
        pose: Belief in the angles (theta_x, theta_y, theta_z), rad; wider than the belief's own if its band is
            calibrated, and while the object is looked for.
        recognised: (F,) which features the observation confirmed in this frame.
        switched: Whether a feature went over from trusting one prediction more to trusting the other.
        memory: What else a family of trackers carries along.
        calibration: What a calibrated band remembers.
        repeatable: Whether every step of a filter from a file came to the same when it was computed again.
    """

    solid: Solid
    belief: Belief
    pose: Gaussian
    recognised: Bools
    switched: bool = False
    memory: Any = None
    calibration: Calibration | None = None
    repeatable: bool = True

    @property
    def estimate(self) -> Floats:
        """(3,) mean of the angles, rad."""
        return self.pose.mean

    @property
    def sigma(self) -> Floats:
        """(3,) standard deviations of the angles, rad."""
        return self.pose.standard_deviations

    @property
    def widths(self) -> Widths:
        """Half widths of the central 50 and 95 % of each angle, in standard deviations."""
        return GAUSSIAN if self.calibration is None else self.solid.widths

    @property
    def log_evidence(self) -> float:
        """Log p(z_t | z_{1:t-1}) up to a constant, the features taken together."""
        return self.belief.log_evidence

    @property
    def feature_means(self) -> Floats:
        """(F, 2) px."""
        return self.belief.means

    @property
    def feature_covariances(self) -> Floats:
        """(F, 2, 2) px^2."""
        return self.belief.covariances

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        return self.belief.nbytes + getattr(self.memory, "nbytes", 0)

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return the particles of the features by name."""
        belief = self.belief
        return {"positions": belief.positions, "log_weights": belief.log_weights, "upper_counts": belief.upper_counts}

    @property
    def translation_mm(self) -> Floats:
        """(3,) where the origin of the solid's frame is now, in the camera's frame.

        An affine camera knows of no distance; it is then the one at which a mm is as large as at the start.
        """
        place = self.belief.place_mm
        if place is not None:
            return place
        focal, depth = self.solid.focal_px, self.solid.focal_px / self.solid.scale
        camera = self.belief.camera(self.solid)
        return np.append((camera[:, 3] - self.solid.principal_px) * depth / focal, depth)

    def project(self, points_mm: Floats, theta: Floats | None = None) -> Floats:
        """Return where points (n, 3) of the solid are seen, (n, 2) px.

        An affine camera is bent back to what a solid of this pose looks like, x = A_0 R(theta) X + its own last column.

        Args:
            points_mm: In the solid's frame.
            theta: Angles (3,) of the solid, rad, if not those that are believed.
        """
        turned = product(points_mm, rotation(self.pose.mean if theta is None else theta).T)
        place = self.belief.place_mm
        if place is None:
            return product(turned, self.solid.reference[:, :3].T) + self.belief.camera(self.solid)[:, 3]
        return pinhole(turned + place, float(self.solid.focal_px)) + self.solid.principal_px
