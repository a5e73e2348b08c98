"""Particles of a solid's whole pose or of its points: what poses are worth by the points, and by which of them."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from typing_extensions import override

from pftrack.core.arrays import Floats
from pftrack.core.geometry.rotation import rotation
from pftrack.core.model.likelihood import Cloud, Component, Contributions, Part
from pftrack.core.model.model import Model, Values
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.source import Frame
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import contiguous_copy
from pftrack.core.numerics.random import Gaussian
from pftrack.experiments.shared.pose.layered import FeatureLikelihood
from pftrack.experiments.shared.pose.state import Belief, JointParticles, Layers, PoseState, Solid
from pftrack.filters.particles import ParticleSet


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


@dataclass(frozen=True, eq=False)
class PoseParticles(Belief):
    """The posterior of a solid's pose by particles, and of its points by where these see them.

    Attributes:
        particles: (N, 6) angles, rad, and place in the camera's frame, mm.
        solid: What they are poses of.
        evidence: Log p(z_t | z_{1:t-1}) up to a constant.
    """

    particles: ParticleSet
    solid: Solid
    evidence: float

    @property
    @override
    def log_evidence(self) -> float:
        return self.evidence

    @cached_property
    @override
    def positions(self) -> Floats:
        """(F, N, 2) px, where each particle sees the points."""
        return project_all(self.particles.states, self.solid)

    @property
    @override
    def pose(self) -> Gaussian:
        mean, covariance = self.particles.moments
        return Gaussian(mean[:3], covariance[:3, :3])

    @property
    @override
    def log_weights(self) -> Floats:
        return self.particles.log_weights

    @property
    @override
    def means(self) -> Floats:
        weights = exponentials(self.log_weights)
        return np.asarray((self.positions * weights[:, None]).sum(axis=1))

    @property
    @override
    def covariances(self) -> Floats:
        off = self.positions - self.means[:, None]
        weights = exponentials(self.log_weights)
        return np.asarray((off[:, :, :, None] * off[:, :, None, :] * weights[:, None, None]).sum(axis=1))

    @property
    @override
    def place_mm(self) -> Floats:
        """(3,) mean of the places."""
        return self.particles.mean[3:]

    @override
    def camera(self, solid: Solid) -> Floats:
        """Return the affine camera that sees the solid as the pinhole does near its origin."""
        return solid.camera_at(self.particles.mean[:3], self.place_mm)

    @override
    def own_series(self) -> Mapping[str, SeriesValue]:
        """Return what all clouds of particles report."""
        return {"unique_ancestors": float(self.particles.unique_ancestors)}

    @property
    @override
    def nbytes(self) -> int:
        return self.particles.nbytes + self.positions.nbytes + 1024


SAMPLERS = ("the solid's pose", "the feature's own past")
"""What draws the particles of a point: those of the first have no parents."""

OWN = tuple(Component(name, "px") for name in ("x", "y", "x in the last frame", "y in the last frame"))


def _joint(names: tuple[str, ...], belief: JointParticles) -> Cloud:
    particles = belief.particles
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


def _apart(names: tuple[str, ...], belief: Layers) -> Cloud:
    features, said = belief.layers.features, belief.layers.log_likelihoods
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


class PoseModel(Model):
    """The likelihood of poses: the points of each, as a pinhole sees them, weighed together.

    Trackers weigh the particles of each point by itself, so theirs have other weights than whole poses. A family says
    in `weigh` how points are weighed.
    """

    weighs = False
    axes = None
    most_places = 1200

    def __init__(self, title: str, names: tuple[str, ...]) -> None:
        """Name what is compared, and the F points."""
        self.title = title
        self.names = names

    def weigh(self, known: PoseState, frame: Frame, parameters: Values) -> FeatureLikelihood:
        """Return the likelihood of points at positions (F, N, 2) px."""
        raise NotImplementedError

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
        """Return the particles of the filter that is believed.

        Joint particles (N, 2 F) px, each in the middle of its points; or those of each point's own filter (F N, 4) px,
        point by point.
        """
        if isinstance(state.belief, JointParticles):
            return _joint(self.names, state.belief)
        return _apart(self.names, state.belief) if isinstance(state.belief, Layers) else None

    @override
    def update_parts(self, before: PoseState, state: PoseState, frame: Frame, parameters: Values) -> tuple[Part, ...]:
        """Return which point pulls which way: its residual, alpha, and its share in the estimate.

        The residual is where a point is believed to be, less where the estimated pose has it. Its share is that of its
        information, (1 - probability that it is hidden) / variance, in that of all points.
        """
        belief = state.belief
        placed, means = state.project(state.solid.points_mm), state.feature_means
        off = means - placed
        variances = np.trace(state.feature_covariances, axis1=1, axis2=2) / 2.0
        information = (1.0 - belief.hidden) / np.maximum(variances, 1e-12)
        shares = information / max(float(information.sum()), 1e-12)
        alpha = belief.ratios if isinstance(belief, Layers) else np.full(len(self.names), np.nan)
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
