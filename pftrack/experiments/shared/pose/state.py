"""What is believed of a solid's points and of its pose in one frame, and what is known of the solid beforehand.

Below are the points, each with particles of its own or all of them together; above is the solid. The kinds of belief
differ in both: layers with an affine camera or a pinhole above, and the joint particles of the Rao-Blackwellised
filter. Each answers `Belief` by itself, so that drawings and methods ask no belief for its kind. `PoseState` is what
a tracker carries from frame to frame.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.geometry.rotation import rotation
from pftrack.core.model.series import SeriesValue
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import pinhole, product
from pftrack.core.numerics.random import Gaussian
from pftrack.experiments.shared.pose.layered import Layered, Rival
from pftrack.filters.affine import AffineBelief
from pftrack.filters.rao_blackwell import RaoBlackwell


class Widths(NamedTuple):
    """Half widths of the central parts of a distribution, in its standard deviations.

    Attributes:
        half: Of the central 50 %.
        most: Of the central 95 %.
    """

    half: float
    most: float


GAUSSIAN = Widths(0.674490, 1.959964)
STUDENT_4 = Widths(0.523752, 1.963243)
STUDENT_8 = Widths(0.611749, 1.997058)
"""Student's t with four and eight degrees of freedom: most is nearer, and now and then something is far off."""


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A rigid object with F points, and the camera before which it is.

    Attributes:
        points_mm: (F, 3) in its own frame.
        reference: (2, 4) the affine camera that sees it at theta = 0.
        focal_px: Focal length of the pinhole.
        principal_px: (2,) its principal point.
        translation_mm: (3,) where the origin of its frame was at the start, in the camera's frame.
        pinned_mm: (F, 3) the points moved to where they were seen at the start; None if shape and camera are known.
        depth_doubt: By which share its depth, along the line of sight of the start, may be wrong (standard deviation).
        misfit_share: Which share of the variance with which its points do not fit it concerns its pose.
        reach_rad: How far it turns from the start (standard deviation), if it is held; a pinhole's layer uses it.
        widths: How the errors of its pose are distributed, as far as the band is calibrated.
    """

    points_mm: Floats
    reference: Floats
    focal_px: float
    principal_px: Floats
    translation_mm: Floats
    pinned_mm: Floats | None = None
    depth_doubt: float = 0.0
    misfit_share: float = 1.0
    reach_rad: float = math.inf
    widths: Widths = GAUSSIAN

    @property
    def scale(self) -> float:
        """How large a mm of it is at the start, px."""
        (a, b), (c, d) = self.reference[:, :2]
        return float(np.sqrt(abs(a * d - b * c)))

    def camera_at(self, theta: Floats, place_mm: Floats) -> Floats:
        """Return the affine camera (2, 4) that sees it as the pinhole does near its origin.

        Args:
            theta: (3,) its angles, rad.
            place_mm: (3,) where its origin is in the camera's frame.
        """
        x, y, z = place_mm
        scale = self.focal_px / max(z, 1.0)
        return np.column_stack([scale * rotation(theta)[:2], self.principal_px + scale * np.array([x, y])])


UpperKind: TypeAlias = Literal["affine", "perspective"]


class Belief(ABC):
    """The posterior of F points and of the pose of the solid that they belong to, immutable.

    What is not abstract is that of particles each of which holds all points, before an affine camera.
    """

    __slots__ = ()

    @property
    @abstractmethod
    def pose(self) -> Gaussian:
        """Belief in the angles (theta_x, theta_y, theta_z), rad."""

    @property
    @abstractmethod
    def log_evidence(self) -> float:
        """Log p(z_t | z_{1:t-1}) up to a constant, the points taken together."""

    @property
    @abstractmethod
    def positions(self) -> Floats:
        """(F, N, 2) px, of the particles, a view."""

    @property
    @abstractmethod
    def log_weights(self) -> Floats:
        """(F, N) of the points' own particles, or (N,) of joint ones."""

    @property
    @abstractmethod
    def means(self) -> Floats:
        """(F, 2) px."""

    @property
    @abstractmethod
    def covariances(self) -> Floats:
        """(F, 2, 2) px^2."""

    @abstractmethod
    def camera(self, solid: Solid) -> Floats:
        """Return the affine camera (2, 4) that is believed to see the solid now."""

    @property
    @abstractmethod
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""

    @property
    def upper_counts(self) -> Ints:
        """(F,) how many of each point's particles, the first ones, came from the solid's prediction."""
        return np.full(*self.positions.shape[:2])

    @property
    def hidden(self) -> Floats:
        """(F,) how likely each point is hidden, so that its particles say nothing of it."""
        return np.zeros(len(self.positions))

    @property
    def all_visible(self) -> bool:
        """Whether it is clear that no point is hidden."""
        return True

    @property
    def follows_solid(self) -> Bools | None:
        """(F,) whether a point trusts the solid's prediction more than its own past; None where there is no choice."""
        return None

    @property
    def place_mm(self) -> Floats | None:
        """(3,) where the origin of the solid's frame is in the camera's frame; None for a camera without distance."""
        return None

    def own_series(self) -> Mapping[str, SeriesValue]:
        """Return what this kind of belief has beyond what all have, by the name of its series."""
        return {}


@dataclass(frozen=True, slots=True, eq=False)
class Layers(Belief):
    """Points with particles of their own below a solid, which an affine camera or a pinhole sees.

    Attributes:
        layers: Both layers.
        rival: A second filter of the same, which judges otherwise whether points are hidden; None if none may be.
    """

    layers: Layered[Any]
    rival: Rival[Any] | None = None

    @property
    def kind(self) -> UpperKind:
        """Which camera sees the solid."""
        return "affine" if isinstance(self.layers.upper, AffineBelief) else "perspective"

    @property
    @override
    def pose(self) -> Gaussian:
        return self.layers.pose

    @property
    @override
    def log_evidence(self) -> float:
        """The sum over the points."""
        return float(self.layers.features.log_evidences.sum())

    @property
    @override
    def positions(self) -> Floats:
        return self.layers.features.positions

    @property
    @override
    def log_weights(self) -> Floats:
        """(F, N), normalised for each point."""
        return self.layers.features.log_weights

    @property
    @override
    def upper_counts(self) -> Ints:
        return self.layers.features.upper_counts

    @property
    @override
    def means(self) -> Floats:
        return self.layers.features.means

    @property
    @override
    def covariances(self) -> Floats:
        return self.layers.features.covariances

    @property
    @override
    def hidden(self) -> Floats:
        return self.layers.hidden

    @property
    @override
    def all_visible(self) -> bool:
        """Whether the filter that takes all points for visible is clearly better, or there is no other."""
        return self.rival is None or self.rival.all_visible

    @property
    def ratios(self) -> Floats:
        """(F,) alpha, the share of the solid's prediction as learned up to this frame."""
        return self.layers.mixture.ratios

    @property
    @override
    def follows_solid(self) -> Bools:
        """(F,) whether alpha is above a half."""
        return np.asarray(self.ratios > 0.5)

    @property
    @override
    def place_mm(self) -> Floats | None:
        upper = self.layers.upper
        return None if isinstance(upper, AffineBelief) else np.asarray(upper.mean[3:6])

    @override
    def camera(self, solid: Solid) -> Floats:
        """Return the affine camera that is estimated, or the one that sees the solid as the pinhole does."""
        upper = self.layers.upper
        if isinstance(upper, AffineBelief):
            return upper.camera
        return solid.camera_at(upper.mean[:3], upper.mean[3:6])

    @override
    def own_series(self) -> Mapping[str, SeriesValue]:
        """Return alpha, the particles by prediction in this frame, and how many of them survived."""
        features = self.layers.features
        upper = float(features.upper_counts.sum())
        return {
            "alpha": tuple(self.ratios.tolist()),
            "samples": (features.log_weights.size - upper, upper),
            "unique_ancestors": float(sum(len(np.unique(survivors)) for survivors in features.survivors)),
        }

    @property
    @override
    def nbytes(self) -> int:
        angles = getattr(self.layers.upper, "theta_particles", None)
        own = 8192 + 6 * self.positions.size * 8 + (0 if angles is None else angles.nbytes)
        return own if self.rival is None else 2 * own


@dataclass(frozen=True, slots=True, eq=False)
class JointParticles(Belief):
    """Particles of all points at once, each with a Kalman filter of an affine camera.

    Attributes:
        particles: The Rao-Blackwellised filter's posterior.
    """

    particles: RaoBlackwell

    @property
    @override
    def pose(self) -> Gaussian:
        return self.particles.pose

    @property
    @override
    def log_evidence(self) -> float:
        return self.particles.log_evidence

    @property
    @override
    def positions(self) -> Floats:
        return self.particles.positions

    @property
    @override
    def log_weights(self) -> Floats:
        return self.particles.log_weights

    @property
    @override
    def means(self) -> Floats:
        return self.particles.feature_means

    @property
    @override
    def covariances(self) -> Floats:
        return self.particles.feature_covariances

    @override
    def camera(self, solid: Solid) -> Floats:
        """Return the weighted mean of the particles' cameras."""
        entries = self.particles.cameras[:, :4]
        weights = exponentials(self.log_weights)
        return product(entries.reshape(-1, len(weights)), weights).reshape(entries.shape[:2])

    @property
    @override
    def nbytes(self) -> int:
        return 8192 + 6 * self.positions.size * 8 + self.particles.cameras.nbytes


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
        excess_px2: What a calibrated band remembers: the variance of the points' positions beyond their particles',
            mean over the last frames; None where the band is the filter's own.
        repeatable: Whether every step of a filter from a file came to the same when it was computed again.
    """

    solid: Solid
    belief: Belief
    pose: Gaussian
    recognised: Bools
    switched: bool = False
    memory: Any = None
    excess_px2: float | None = None
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
        return GAUSSIAN if self.excess_px2 is None else self.solid.widths

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
