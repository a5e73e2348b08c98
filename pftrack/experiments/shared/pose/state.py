"""The belief in a solid's points and pose in one frame, and prior knowledge of the solid.

The lower layer holds the points, with separate or joint particles; the upper layer is the solid. The methods differ in
both: layers with an affine camera or a pinhole above, the joint particles of the Rao-Blackwellised filter, and
particles of the whole pose. `Belief` is their common interface for drawings and other methods. `PoseState` is a
tracker's state from frame to frame, and `PoseModel` exposes the likelihood of poses by points, in total and for each
point.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.geometry import rotation
from pftrack.core.model.likelihood import Cloud, Component, Contributions, Part
from pftrack.core.model.model import Model, Values
from pftrack.core.model.source import Frame
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import contiguous_copy, pinhole, product
from pftrack.core.numerics.random import Gaussian
from pftrack.experiments.shared.pose.layered import FeatureLikelihood, Layered, Rival
from pftrack.filters.affine import AffineBelief
from pftrack.filters.particles import ParticleSet
from pftrack.filters.rao_blackwell import RaoBlackwell


class Widths(NamedTuple):
    """Half widths of the central parts of a distribution, in its standard deviations.

    Attributes:
        half: Half width of the central 50 %.
        most: Half width of the central 95 %.
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
        depth_doubt: Relative error of its depth, along the line of sight of the start (standard deviation).
        misfit_share: Share of the points' misfit variance that affects its pose.
        reach_rad: Turn from the start (standard deviation), if it is held; a pinhole's layer uses it.
        widths: Distribution of the errors of its pose, as far as the band is calibrated.
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
        """Size of a mm of it at the start, px."""
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


def project_all(poses: Floats, solid: Solid) -> Floats:
    """Return where a pinhole sees the points of a solid in each of N poses, (F, N, 2) px.

    Args:
        poses: (N, 6) angles, rad, and where the origin of the solid's frame is in the camera's frame, mm.
        solid: With F points.
    """
    seen = _project_all(contiguous_copy(poses), contiguous_copy(solid.points_mm), float(solid.focal_px))
    return np.asarray(seen + solid.principal_px)


@compiled
def _project_all(poses: Floats, points_mm: Floats, focal_px: float) -> Floats:
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
class Belief:
    """The posterior of F points and of the pose of the solid that they belong to, immutable.

    Attributes:
        kept: The method's own state: layers, joint particles of all points, or particles of the pose.
        pose: Belief in the angles (theta_x, theta_y, theta_z), rad.
        log_evidence: Log p(z_t | z_{1:t-1}) up to a constant, the points taken together.
        positions: (F, N, 2) px, of the particles, a view.
        log_weights: (F, N) of the points' own particles, normalised for each point, or (N,) of joint ones.
        means: (F, 2) px.
        covariances: (F, 2, 2) px^2.
        affine: (2, 4) the believed affine camera; None before a pinhole.
        place_mm: (3,) where the origin of the solid's frame is in the camera's frame; None for a camera without
            distance.
        rival: A second filter of layers, which judges otherwise whether points are hidden; None if none may be.
    """

    kept: Layered[Any] | RaoBlackwell | ParticleSet
    pose: Gaussian
    log_evidence: float
    positions: Floats
    log_weights: Floats
    means: Floats
    covariances: Floats
    affine: Floats | None = None
    place_mm: Floats | None = None
    rival: Rival[Any] | None = None

    @classmethod
    def of_layers(cls, layers: Layered[Any], rival: Rival[Any] | None = None) -> Self:
        """Return the belief of points with separate particles below a solid, for either camera."""
        features, upper = layers.features, layers.upper
        affine = upper.camera if isinstance(upper, AffineBelief) else None
        return cls(
            layers,
            layers.pose,
            float(features.log_evidences.sum()),
            features.positions,
            features.log_weights,
            features.means,
            features.covariances,
            affine,
            None if affine is not None else upper.mean[3:6],
            rival,
        )

    @classmethod
    def of_joint(cls, particles: RaoBlackwell) -> Self:
        """Return the belief of particles of all points at once, each with a Kalman filter of an affine camera."""
        entries, weights = particles.cameras[:, :4], exponentials(particles.log_weights)
        return cls(
            particles,
            particles.pose,
            particles.log_evidence,
            particles.positions,
            particles.log_weights,
            particles.feature_means,
            particles.feature_covariances,
            affine=product(entries.reshape(-1, len(weights)), weights).reshape(entries.shape[:2]),
        )

    @classmethod
    def of_poses(cls, particles: ParticleSet, solid: Solid, log_evidence: float) -> Self:
        """Return the belief of particles (N, 6) of the pose of a solid: angles, rad, and place, mm."""
        positions, weights = project_all(particles.states, solid), exponentials(particles.log_weights)
        means = (positions * weights[:, None]).sum(axis=1)
        off = positions - means[:, None]
        return cls(
            particles,
            Gaussian(particles.moments[0][:3], particles.moments[1][:3, :3]),
            log_evidence,
            positions,
            particles.log_weights,
            means,
            (off[:, :, :, None] * off[:, :, None, :] * weights[:, None, None]).sum(axis=1),
            place_mm=particles.mean[3:],
        )

    def camera(self, solid: Solid) -> Floats:
        """Return the affine camera (2, 4) that sees the solid now, or that sees it as the pinhole does."""
        return np.asarray(self.affine) if self.place_mm is None else solid.camera_at(self.pose.mean, self.place_mm)

    @property
    def upper_counts(self) -> Ints:
        """(F,) number of each point's particles from the solid's prediction; they are the first ones."""
        layers = self.kept
        return layers.features.upper_counts if isinstance(layers, Layered) else np.full(*self.positions.shape[:2])

    @property
    def hidden(self) -> Floats:
        """(F,) probability that each point is hidden, so its particles carry no information."""
        return self.kept.hidden if isinstance(self.kept, Layered) else np.zeros(len(self.positions))

    @property
    def alpha(self) -> Floats | None:
        """(F,) the share of the solid's prediction as learned up to this frame; None without a choice."""
        return self.kept.mixture.ratios if isinstance(self.kept, Layered) else None


@dataclass(frozen=True, slots=True, eq=False)
class PoseState:
    """The posterior of one frame, immutable.

    Attributes:
        solid: The prior model of the object.
        belief: In its points and its pose.
        pose: Belief in the angles (theta_x, theta_y, theta_z), rad; wider than the belief's own if its band is
            calibrated, and while the object is searched.
        recognised: (F,) which features the observation confirmed in this frame.
        switched: Whether a feature went over from trusting one prediction more to trusting the other.
        memory: Further state of a family of trackers.
        excess_px2: Memory of a calibrated band: the variance of the points' positions beyond their particles', mean
            over the last frames; None where the band is the filter's own.
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

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return the particles of the features by name."""
        belief = self.belief
        return {"positions": belief.positions, "log_weights": belief.log_weights, "upper_counts": belief.upper_counts}

    @property
    def translation_mm(self) -> Floats:
        """(3,) where the origin of the solid's frame is now, in the camera's frame.

        An affine camera has no distance; the result is then the distance at which a mm is as large as at the start.
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


SAMPLERS = ("the solid's pose", "the feature's own past")
"""Sources of a point's particles; those of the first have no parents."""

OWN = tuple(Component(name, "px") for name in ("x", "y", "x in the last frame", "y in the last frame"))


def _joint(names: tuple[str, ...], particles: RaoBlackwell) -> Cloud:
    positions = particles.positions
    states = positions.transpose(1, 0, 2).reshape(positions.shape[1], -1)
    components = tuple(Component(f"{name}, {axis}", "px") for name in names for axis in "xy")
    middle = np.asarray(positions.mean(axis=0))
    return Cloud(
        states,
        particles.log_weights,
        particles.ancestors,
        resampled=particles.resampled,
        components=components,
        places=middle,
        log_likelihoods=particles.log_likelihoods,
    )


def _apart(names: tuple[str, ...], layers: Layered[Any]) -> Cloud:
    features, said = layers.features, layers.log_likelihoods
    count = features.log_weights.shape[1]
    drawn = np.stack([features.upper_counts, count - features.upper_counts], axis=1)
    states = features.particles.reshape(-1, 4)
    return Cloud(
        states,
        features.log_weights.ravel(),
        features.parents.ravel(),
        tuple(drawn.ravel().tolist()),
        SAMPLERS,
        components=OWN,
        places=states[:, :2],
        filters=names,
        log_likelihoods=None if said is None else said.ravel(),
    )


COMPONENTS = (
    Component("theta x", "rad"),
    Component("theta y", "rad"),
    Component("theta z", "rad"),
    Component("x", "mm"),
    Component("y", "mm"),
    Component("z", "mm"),
)
"""How the prism is turned, and where it is in the camera's frame."""

LONGER = 5.0
"""Factor by which arrows are longer than what they show, which is a pixel or two."""


class PoseModel(Model, ABC):
    """The likelihood of poses: the points of each, as a pinhole sees them, weighed together.

    Trackers weigh the particles of each point by itself, so theirs have other weights than whole poses. A family
    defines in `weigh` how points are weighed.
    """

    weighs = False
    axes = None
    most_places = 1200

    def __init__(self, title: str, names: tuple[str, ...]) -> None:
        """Name what is compared, and the F points."""
        self.title = title
        self.names = names

    @abstractmethod
    def weigh(self, known: PoseState, frame: Frame, parameters: Values) -> FeatureLikelihood:
        """Return the likelihood of points at positions (F, N, 2) px."""

    @override
    def components(self, parameters: Values) -> tuple[Component, ...]:
        return COMPONENTS

    @override
    def log_likelihood(self, states: Floats, frame: Frame, parameters: Values, known: PoseState) -> Floats:
        return np.asarray(self.weigh(known, frame, parameters)(project_all(states, known.solid)).sum(axis=0))

    @override
    def centre(self, state: PoseState) -> Floats:
        """Return angles, rad, and place in the camera's frame, mm, (6,)."""
        return np.concatenate([state.pose.mean, state.translation_mm])

    @property
    @override
    def has_place(self) -> bool:
        return True

    @override
    def place(self, states: Floats, known: PoseState) -> Floats:
        """Return where a pinhole sees the origin of the solid's frame, (N, 2) px."""
        solid = known.solid
        return np.asarray(solid.focal_px * states[:, 3:5] / np.maximum(states[:, 5:], 1.0) + solid.principal_px)

    @override
    def put(self, one: Floats, places: Floats, known: PoseState) -> Floats:
        """Return poses as far away as the one, whose origins are seen at places, (M, 6)."""
        states = np.tile(one, (len(places), 1))
        states[:, 3:5] = (places - known.solid.principal_px) * one[5] / known.solid.focal_px
        return states

    @override
    def parts(self, one: Floats, frame: Frame, parameters: Values, known: PoseState) -> tuple[Part, ...]:
        """Return where each point of the pose is seen, and its log likelihood."""
        seen = project_all(one[None], known.solid)
        logs = self.weigh(known, frame, parameters)(seen)[:, 0]
        rows = np.column_stack([seen[:, 0], logs])
        told = tuple(tuple(row) for row in rows.tolist())
        return (Contributions("points of the pose", ("x (px)", "y (px)", "log likelihood"), self.names, told),)

    @override
    def cloud(self, state: PoseState) -> Cloud | None:
        """Return the particles of the filter in use.

        Joint particles (N, 2 F) px, each in the middle of its points; or those of each point's own filter (F N, 4) px,
        point by point.
        """
        kept = state.belief.kept
        if isinstance(kept, RaoBlackwell):
            return _joint(self.names, kept)
        return _apart(self.names, kept) if isinstance(kept, Layered) else None

    @override
    def update_parts(self, before: PoseState, state: PoseState, frame: Frame, parameters: Values) -> tuple[Part, ...]:
        """Return which point pulls which way: its residual, alpha, and its share in the estimate.

        The residual is a point's believed place, less its place by the estimated pose. Its share is that of its
        information, (1 - probability that it is hidden) / variance, in that of all points.
        """
        belief = state.belief
        placed, means = state.project(state.solid.points_mm), state.feature_means
        off = means - placed
        variances = np.trace(state.feature_covariances, axis1=1, axis2=2) / 2.0
        information = (1.0 - belief.hidden) / np.maximum(variances, 1e-12)
        shares = information / max(float(information.sum()), 1e-12)
        alpha = np.full(len(self.names), np.nan) if belief.alpha is None else belief.alpha
        rows = np.column_stack([off, np.sqrt(variances), belief.hidden, alpha, 100.0 * shares])
        arrows = np.column_stack([placed, placed + LONGER * off])
        return (
            Contributions(
                f"which point pulls which way (arrows {LONGER:g} times as long)",
                ("x (px)", "y (px)", "sd (px)", "hidden", "alpha", "share (%)"),
                self.names,
                tuple(map(tuple, rows.tolist())),
                tuple(map(tuple, arrows.tolist())),
            ),
        )
