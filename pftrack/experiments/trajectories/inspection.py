"""What there is to look into of trajectories: what the selected track was measured to be, and its particles.

Points are measured as they are given with the frame, or by following corners through its picture. Each track is
filtered by itself, so what can be asked is asked of the track that is selected. Its likelihood is the law of the noise
around its measurement: for corners in pictures that is where block matching has found it, and template and place are
shown beside each other.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.likelihood import (
    Cloud,
    Component,
    Contributions,
    Part,
    Patches,
    Residual,
)
from pftrack.core.model.model import Model, Values
from pftrack.core.model.source import Frame
from pftrack.core.numerics.elementary import exponential, logarithm
from pftrack.core.numerics.matrices import product
from pftrack.experiments.shared.filtered import innovation_parts
from pftrack.experiments.trajectories.corners import CornerParameters, Corners, begin, follow
from pftrack.experiments.trajectories.scene import TrajectoriesTarget
from pftrack.experiments.trajectories.trackers import TrajectoriesState, TrajectoriesTrackerParameters
from pftrack.filters.kalman import Innovation, NormalisedInnovation
from pftrack.filters.trajectories.cloud import Cloud as Belief
from pftrack.filters.trajectories.gaussian import Gaussians
from pftrack.vision.likelihoods.template import luma
from pftrack.vision.matching import cut


@dataclass(frozen=True, eq=False)
class Observation:
    """What is seen of K tracks in a frame; it depends on no random numbers of a tracker.

    Attributes:
        corners: That are looked for in pictures; None where measurements are given.
        points: (K, 2) px, both NaN where a track has no measurement.
        again: (K,) whose corners have just given their places to others, so that another track begins there.
        gone: (K,) of which nobody knows any more where they would be.
    """

    corners: Corners | None
    points: Floats
    again: Bools
    gone: Bools

    @classmethod
    def first(cls, target: TrajectoriesTarget, frame: Frame, parameters: object) -> Self:
        """Observe the first frame: its measurements, or the corners of its picture."""
        if frame.image_rgb is None:
            corners, points = None, _measure(frame)
        else:
            corners, points = begin(*_picture(frame, parameters), target.start_px)
        none = np.zeros(len(points), np.bool_)
        return cls(corners, points, none, none)

    @classmethod
    def following(cls, corners: Corners | None, frame: Frame, parameters: object) -> Self:
        """Observe a further frame, given the corners of the one before."""
        if corners is None:
            points = _measure(frame)
            none = np.zeros(len(points), np.bool_)
            return cls(None, points, none, none)
        image, matching = _picture(frame, parameters)
        found, points = follow(corners, image, matching, frame.index)
        return cls(found, points, found.born == frame.index, found.gone)


def _picture(frame: Frame, parameters: object) -> tuple[NDArray[np.uint8], CornerParameters]:
    if frame.image_rgb is None or not isinstance(parameters, CornerParameters):
        raise ValueError("corners are followed in pictures, with parameters of matching; got a frame or values without")
    return frame.image_rgb, parameters


def _measure(frame: Frame) -> Floats:
    """Return the measurements (K, 2) of a frame, both NaN where either is missing."""
    if frame.measurements is None:
        raise ValueError("a tracker of trajectories needs measured points, got a frame without them")
    points = frame.measurements.points_px
    return np.where(np.isfinite(points).all(axis=1, keepdims=True), points, np.nan)


P: TypeAlias = TrajectoriesTrackerParameters
Law: TypeAlias = Callable[[Floats, Floats | float], Floats]
"""(distances (N, 2) px, sigma^2 (N,) or one for all, px^2) -> log densities (N,)."""

PLACE = (Component("x", "px"), Component("y", "px"))
LAWS = (Component("ln σ²"), Component("ln τ²"))
"""Of particles that have laws of their own."""

MOST_TRACKS = 12
"""Of a table: those whose measurements are the furthest off."""


@dataclass(frozen=True, eq=False)
class Measured:
    """What is measured of the selected track in a frame.

    Attributes:
        point: (2,) px, NaN where there is nothing.
        template: (b, b) grey levels that were looked for; None where measurements are given.
    """

    point: Floats
    template: NDArray[np.uint8] | None = None


def cauchy(off: Floats, variance: Floats | float) -> Floats:
    """Return the log density of a Cauchy law on each axis; see `Law`."""
    squares = np.square(off) / np.reshape(variance, (-1, 1))
    constant = 2.0 * logarithm(np.pi * np.sqrt(np.asarray(variance, np.float64)))
    return np.asarray(-logarithm(1.0 + squares).sum(axis=1) - constant)


def normal(off: Floats, variance: Floats | float) -> Floats:
    """Return the log density of a normal law on both axes; see `Law`."""
    squares = (np.square(off) / np.reshape(variance, (-1, 1))).sum(axis=1)
    return np.asarray(-0.5 * squares - logarithm(2.0 * np.pi * np.asarray(variance, np.float64)))


def innovate(before: Gaussians, track: int, measured: Floats, noise: float, drive: float) -> Innovation | None:
    """Return the innovation of a track's measurement (2,), px; None where it has none, or only begins.

    Args:
        before: What was believed in the frame before.
        track: Its number.
        measured: (2,) px.
        noise: sigma^2, px^2.
        drive: tau^2, px^2.
    """
    means, (own, cross, past) = before.means[0, track], before.covariances[0, track]
    if not (np.isfinite(means).all() and np.isfinite(measured).all()):
        return None
    first = 4.0 * own - 4.0 * cross + past + drive
    spread = first + noise
    values = measured - (2.0 * means[:, 0] - means[:, 1])
    squared = float((values[0] * values[0] + values[1] * values[1]) / spread)
    return Innovation(values, spread * np.eye(2), first / spread * np.eye(2), NormalisedInnovation(squared, 2))


class Track(Model):
    """The law of the noise around the measurement of the selected track; each track is filtered by itself."""

    evidence = "normalised"
    weighs = False  # particles are laid open as they were drawn, each as often as it weighed

    def __init__(self, title: str, law: Law, *, learned: bool = False) -> None:
        """Choose the law.

        Args:
            title: What it compares, a few words.
            law: Of the noise.
            learned: Whether a state has a sigma^2 of its own, beside its place.
        """
        self.title, self.law, self.learned = title, law, learned

    @override
    def components(self, parameters: Values) -> tuple[Component, ...]:
        return (*PLACE, *LAWS) if self.learned else PLACE

    @override
    def prepare(self, state: TrajectoriesState, frame: Frame, parameters: P) -> Measured:
        """Return what is measured of the selected track in a frame; in frame 0 that of the state itself."""
        track = parameters.selected_track % max(state.raw.shape[1], 1)
        if frame.index == 0:
            return Measured(state.raw[0, track], None if state.corners is None else state.corners.templates[track])
        # One corner is looked for in a moment, all of them are not.
        corner = None if state.corners is None else state.corners.select(np.array([track]))
        points = Observation.following(corner, frame, parameters).points
        return Measured(points[track if corner is None else 0], None if corner is None else corner.templates[0])

    @override
    def log_likelihood(self, states: Floats, frame: Frame, parameters: P, known: Measured) -> Floats:
        if not np.isfinite(known.point).all():
            return np.zeros(len(states))
        variance = exponential(states[:, 2]) if self.learned else float(parameters.noise_variance_px2)
        return self.law(states[:, :2] - known.point, variance)

    @override
    def centre(self, state: TrajectoriesState) -> Floats:
        """Return the filtered place of the selected track, with the mean laws of particles that have some."""
        laws = state.belief.laws(state.selected) if isinstance(state.belief, Belief) else None
        place = state.filtered[0, state.selected]
        return place.copy() if laws is None else np.concatenate([place, product(laws[1], laws[0])])

    @override
    def parts(self, one: Floats, frame: Frame, parameters: P, known: Measured) -> tuple[Part, ...]:
        scale = float(exponential(0.5 * one[2])) if self.learned else float(np.sqrt(parameters.noise_variance_px2))
        pairs = zip("xy", known.point.tolist(), one.tolist(), strict=False)
        compared = tuple(Residual(name, found, expected, scale, "px") for name, found, expected in pairs)
        return (*_patches(known, one, frame), *compared)

    @override
    def cloud(self, state: TrajectoriesState) -> Cloud | None:
        """Return the particles of the selected track after they were drawn, each once, laid open; None without."""
        belief, track = state.belief, state.selected
        if not isinstance(belief, Belief) or not state.raw.shape[1]:
            return None
        states, shares = belief.age(track, 0)
        if not len(states):
            return None
        laws = belief.laws(track)
        if laws is not None:
            states = np.hstack([states, laws[0]])
        return Cloud(states, logarithm(shares), _parents(belief, track, state.earlier))

    @override
    def update_parts(
        self, before: TrajectoriesState, state: TrajectoriesState, frame: Frame, parameters: P
    ) -> tuple[Part, ...]:
        """Return which measurements are the furthest off, and the innovation of the selected one where it is known."""
        off = state.raw[0] - state.filtered[0]
        distances = np.hypot(off[:, 0], off[:, 1])
        seen = np.flatnonzero(np.isfinite(distances))
        chosen = seen[np.argsort(-distances[seen], kind="stable")][:MOST_TRACKS]
        rows = np.column_stack([off[chosen], distances[chosen], state.densities[chosen]])
        arrows = np.hstack([state.filtered[0, chosen], state.raw[0, chosen]])
        table = Contributions(
            "measurements furthest off",
            ("off x (px)", "off y (px)", "distance (px)", "log density"),
            tuple(f"track {number}" for number in chosen),
            tuple(map(tuple, rows.tolist())),
            tuple(map(tuple, arrows.tolist())),
        )
        told: tuple[Part, ...] = (table,) if len(chosen) else ()
        if frame.index == 0 or not (isinstance(before.belief, Gaussians) and isinstance(state.belief, Gaussians)):
            return told
        measured = state.raw[0, state.selected]
        noise, drive = float(parameters.noise_variance_px2), float(parameters.drive_variance_px2)
        innovation = innovate(before.belief, state.selected, measured, noise, drive)
        return told if innovation is None else (*innovation_parts(PLACE, measured, innovation), *told)


def _patches(known: Measured, one: Floats, frame: Frame) -> tuple[Part, ...]:
    """Return the template that was looked for beside what is at a place."""
    if known.template is None or frame.image_rgb is None or not np.isfinite(one[:2]).all():
        return ()
    (there,) = cut(luma(frame.image_rgb), np.rint(one[None, :2]).astype(np.int64), len(known.template))
    return (Patches("template", _in_colour(known.template), _in_colour(there)),)


def _in_colour(grey: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.repeat(grey[:, :, None], 3, axis=2)


def _parents(belief: Belief, track: int, earlier: NDArray[np.float32] | None) -> Ints | None:
    """Return which particle of the frame before each comes from.

    A tree keeps those that have descendants, in the order in which they were; so each is found again by its place.
    """
    first, last, end = belief.offsets[track, :3]
    if earlier is None or not len(earlier):
        return None
    kept, there = (_as_numbers(nodes) for nodes in (belief.nodes[last:end], earlier))
    order = np.argsort(there, kind="stable")
    found = order[np.minimum(np.searchsorted(there[order], kept), len(order) - 1)]
    if not np.array_equal(there[found], kept):
        return None
    return np.asarray(found[belief.parents[first:last]], np.int64)


def _as_numbers(nodes: NDArray[np.float32]) -> NDArray[Any]:
    """Return places (n, 2) as one number each, equal just where the places are."""
    return np.ascontiguousarray(nodes).view(np.uint64).ravel()
