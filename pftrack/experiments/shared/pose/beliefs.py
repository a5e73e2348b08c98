"""Beliefs in where the points of a solid are, and how the solid stands; and what is known of the solid beforehand.

Below are the points, each with particles of its own or all of them together; above is the solid. The members differ in
both: layers with an affine camera above, layers with a pinhole above, and the joint particles of the Rao-Blackwellised
filter. Each answers `Belief` by itself, so that states, drawings and methods ask no belief for its kind.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Generic, Literal, NamedTuple, Protocol, TypeAlias, TypeVar

import numpy as np

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.geometry.rotation import rotation
from pftrack.core.model.series import SeriesValue
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import product
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


UpperKind: TypeAlias = Literal["affine", "perspective"]

S = TypeVar("S")


class Belief(Protocol):
    """The posterior of F points and of the pose of the solid that they belong to, immutable."""

    @property
    def pose(self) -> Gaussian:
        """Belief in the angles (theta_x, theta_y, theta_z), rad."""

    @property
    def log_evidence(self) -> float:
        """Log p(z_t | z_{1:t-1}) up to a constant, the points taken together."""

    @property
    def positions(self) -> Floats:
        """(F, N, 2) px, of the particles, a view."""

    @property
    def log_weights(self) -> Floats:
        """(F, N) of the points' own particles, or (N,) of joint ones."""

    @property
    def upper_counts(self) -> Ints:
        """(F,) how many of each point's particles, the first ones, came from the solid's prediction."""

    @property
    def means(self) -> Floats:
        """(F, 2) px."""

    @property
    def covariances(self) -> Floats:
        """(F, 2, 2) px^2."""

    @property
    def hidden(self) -> Floats:
        """(F,) how likely each point is hidden, so that its particles say nothing of it."""

    @property
    def all_visible(self) -> bool:
        """Whether it is clear that no point is hidden."""

    @property
    def follows_solid(self) -> Bools | None:
        """(F,) whether a point trusts the solid's prediction more than its own past; None where there is no choice."""

    @property
    def place_mm(self) -> Floats | None:
        """(3,) where the origin of the solid's frame is in the camera's frame; None for a camera without distance."""

    def camera(self, solid: Solid) -> Floats:
        """Return the affine camera (2, 4) that is believed to see the solid now."""

    def own_series(self) -> Mapping[str, SeriesValue]:
        """Return what this kind of belief has beyond what all have, by the name of its series."""

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""


@dataclass(frozen=True, slots=True, eq=False)
class Layers(ABC, Generic[S]):
    """Points with particles of their own below a solid: what both kinds of upper layer have in common.

    Attributes:
        layers: Both layers.
        rival: A second filter of the same, which judges otherwise whether points are hidden; None if none may be.
    """

    kind: ClassVar[UpperKind]

    layers: Layered[S]
    rival: Rival[S] | None = None

    @property
    def pose(self) -> Gaussian:
        """Belief in the angles, rad."""
        return self.layers.pose

    @property
    def log_evidence(self) -> float:
        """The sum over the points."""
        return float(self.layers.features.log_evidences.sum())

    @property
    def positions(self) -> Floats:
        """(F, N, 2) px, a view."""
        return self.layers.features.positions

    @property
    def log_weights(self) -> Floats:
        """(F, N), normalised for each point."""
        return self.layers.features.log_weights

    @property
    def upper_counts(self) -> Ints:
        """(F,) particles from the solid's prediction."""
        return self.layers.features.upper_counts

    @property
    def means(self) -> Floats:
        """(F, 2) px."""
        return self.layers.features.means

    @property
    def covariances(self) -> Floats:
        """(F, 2, 2) px^2."""
        return self.layers.features.covariances

    @property
    def hidden(self) -> Floats:
        """(F,) how likely each point is hidden."""
        return self.layers.hidden

    @property
    def all_visible(self) -> bool:
        """Whether the filter that takes all points for visible is clearly better, or there is no other."""
        return self.rival is None or self.rival.all_visible

    @property
    def ratios(self) -> Floats:
        """(F,) alpha, the share of the solid's prediction as learned up to this frame."""
        return self.layers.mixture.ratios

    @property
    def follows_solid(self) -> Bools:
        """(F,) whether alpha is above a half."""
        follows: Bools = self.ratios > 0.5
        return follows

    @property
    @abstractmethod
    def place_mm(self) -> Floats | None:
        """(3,) where the origin of the solid's frame is in the camera's frame; None if the upper layer cannot tell."""

    @abstractmethod
    def camera(self, solid: Solid) -> Floats:
        """Return the affine camera (2, 4) that the upper layer believes in."""

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
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        filters = 1 if self.rival is None else 2
        return filters * (8192 + 6 * self.positions.size * 8 + self._upper_nbytes)

    @property
    def _upper_nbytes(self) -> int:
        """What the upper layer takes beside a few numbers, bytes."""
        return 0


@dataclass(frozen=True, slots=True, eq=False)
class AffineLayers(Layers[AffineBelief]):
    """Points below a solid that an affine camera sees."""

    kind = "affine"

    @property
    def place_mm(self) -> None:
        """An affine camera knows of no distance."""
        return

    def camera(self, solid: Solid) -> Floats:
        """Return the camera that is estimated, whatever solid it sees."""
        del solid
        return self.layers.upper.camera

    @property
    def _upper_nbytes(self) -> int:
        """Particles of the pose, if there are any, bytes."""
        angles = self.layers.upper.theta_particles
        return 0 if angles is None else angles.nbytes


@dataclass(frozen=True, slots=True, eq=False)
class PerspectiveLayers(Layers[Gaussian]):
    """Points below a solid that a pinhole sees."""

    kind = "perspective"

    @property
    def place_mm(self) -> Floats:
        """(3,) the translation that is estimated."""
        place: Floats = self.layers.upper.mean[3:6]
        return place

    def camera(self, solid: Solid) -> Floats:
        """Return the affine camera that sees the solid as the pinhole does near its origin."""
        turn, (x, y, z) = rotation(self.layers.upper.mean[:3]), self.place_mm
        scale = solid.focal_px / max(z, 1.0)
        return np.column_stack([scale * turn[:2], solid.principal_px + scale * np.array([x, y])])


@dataclass(frozen=True, slots=True, eq=False)
class JointParticles:
    """Particles of all points at once, each with a Kalman filter of an affine camera.

    Attributes:
        particles: The Rao-Blackwellised filter's posterior.
    """

    particles: RaoBlackwell

    @property
    def pose(self) -> Gaussian:
        """Belief in the angles, rad."""
        return self.particles.pose

    @property
    def log_evidence(self) -> float:
        """Of all points at once."""
        return self.particles.log_evidence

    @property
    def positions(self) -> Floats:
        """(F, N, 2) px, a view."""
        return self.particles.positions

    @property
    def log_weights(self) -> Floats:
        """(N,), of all points at once."""
        return self.particles.log_weights

    @property
    def upper_counts(self) -> Ints:
        """(F,) all of them: each particle's own camera predicts its points."""
        return np.full(len(self.particles.feature_means), len(self.particles.log_weights))

    @property
    def means(self) -> Floats:
        """(F, 2) px."""
        return self.particles.feature_means

    @property
    def covariances(self) -> Floats:
        """(F, 2, 2) px^2."""
        return self.particles.feature_covariances

    @property
    def hidden(self) -> Floats:
        """(F,) none: joint particles take every point for seen."""
        return np.zeros(len(self.particles.feature_means))

    @property
    def all_visible(self) -> bool:
        """Joint particles take every point for seen."""
        return True

    @property
    def follows_solid(self) -> None:
        """There is one prediction only."""
        return

    @property
    def place_mm(self) -> None:
        """An affine camera knows of no distance."""
        return

    def camera(self, solid: Solid) -> Floats:
        """Return the weighted mean of the particles' cameras."""
        del solid
        entries = self.particles.cameras[:, :4]
        weights = exponentials(self.log_weights)
        return product(entries.reshape(-1, len(weights)), weights).reshape(entries.shape[:2])

    def own_series(self) -> Mapping[str, SeriesValue]:
        """Return nothing: it has no other prediction to mix with, and draws no parents for each point."""
        return {}

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        return 8192 + 6 * self.positions.size * 8 + self.particles.cameras.nbytes
