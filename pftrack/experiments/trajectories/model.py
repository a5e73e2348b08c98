"""The model of trajectories: parameters, state, measurements, and the law of their noise.

Points are measured as they are given with the frame, or by following corners through its picture. Each track is
filtered independently, so inspection concerns the selected track. Its likelihood is the law of the noise around its
measurement: for corners in pictures that is the match, and template and place are shown side by side.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.likelihood import Cloud as LaidOpen
from pftrack.core.model.likelihood import Component, Contributions, Part, Patches, Residual
from pftrack.core.model.model import LinearChain, LinearStep, Model, NoiseScale, Values
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.source import Frame
from pftrack.core.numerics.elementary import exponential, logarithm
from pftrack.core.numerics.matrices import product
from pftrack.experiments.shared.filtered import innovation_parts
from pftrack.experiments.trajectories.corners import CornerParameters, Corners, begin, follow
from pftrack.experiments.trajectories.scene import Origin, SelectionParameters, TrajectoriesTarget
from pftrack.filters.dynamics import LinearDynamics
from pftrack.filters.kalman import Innovation, NormalisedInnovation
from pftrack.filters.particles import ParticleSet
from pftrack.filters.trajectories.cloud import MOST_PARTICLES, Cloud
from pftrack.filters.trajectories.gaussian import Gaussians
from pftrack.vision.likelihoods.template import luma
from pftrack.vision.matching import cut

MEASUREMENT = "measurement of the selected track"

MOTION, PARTICLES, SCORING = "Model", "Particles", "Scoring"
CLOUDS = ("lng", "nlng")

LONGEST_LAG = 50


class _Model(Parameters, group=MOTION):
    """How points move and are measured."""

    noise_variance_px2: float = parameter(
        3, "Measurement noise σ²", unit="px²", within=(0.01, 100, 0.5), useful=(0.1, 30), role="noise"
    )
    """Square of the scale of a measurement's noise; NLNG begins there and finds its own."""
    drive_variance_px2: float = parameter(
        1, "Freedom of motion τ²", unit="px²", within=(0.0001, 100, 0.1), useful=(0.01, 10), role="noise"
    )
    """Variance of the change of velocity in a frame; small is smooth. NLNG begins there."""
    lag_frames: int = parameter(25, "Smoothing lag", unit="frames", within=(0, LONGEST_LAG, 1), role="smoothing")
    """Number of later frames that a smoothed position uses."""
    start_spread_px: float = parameter(
        1, "Initial spread", unit="px", within=(0.1, 50, 0.5), useful=(0.5, 10), live=False
    )
    """Standard deviation of the two positions with which a track begins."""


class _Particles(Parameters, group=PARTICLES, trackers=CLOUDS):
    """Particles, and how noises drift."""

    sample_count: int = parameter(2000, "Particles", within=(10, MOST_PARTICLES, 10), role="particles", sets=50)
    """Number of particles of each track."""
    point_estimate: Literal["mode", "mean"] = parameter("mode", "Estimate")
    """The fullest place of a histogram in bins of 1 px, or the mean of the particles."""
    law_drift: float = parameter(0, "Drift of σ² and τ²", within=(0, 0.5, 0.01), trackers=("nlng",))
    """Change of their logarithms per frame; at 0 they settle once for all."""


class _Scoring(Parameters, group=SCORING):
    """When a measurement is an outlier, and a point lost."""

    outlier_px: float = parameter(5, "Outlier from", unit="px", within=(0.5, 100, 0.5), useful=(0.5, 20))
    """A measurement further from the estimate than this counts as an outlier."""
    lost_px: float = parameter(10, "Lost from", unit="px", within=(0.5, 200, 0.5), useful=(0.5, 40))
    """A track further from its true position than this counts as lost."""
    lost_frames_share: float = parameter(0.02, "Frames that may be lost", within=(0, 1, 0.01), role="loss_share")
    """A run is a success if the selected track is lost in no more of its frames."""


class TrajectoriesTrackerParameters(_Scoring, _Particles, _Model, SelectionParameters):
    """Everything that trackers of trajectories read."""


Belief: TypeAlias = Gaussians | Cloud

KEPT_FRAMES = 64
"""Least stored length of each trajectory, for smoothing and drawing."""

BLOCK = 32
"""Number of frames stored at once in an array that all later states share."""


@dataclass(frozen=True, eq=False)
class TrajectoriesState:
    """The belief after a frame, immutable; the estimate is the position of the selected track.

    Attributes:
        belief: The method's own.
        raw: (W, K, 2) measurements of this frame and those before, the newest first, px; NaN where there is none.
        filtered: (W, K, 2) positions given the frames up to each, px.
        smoothed: (W, K, 2) positions given up to the lag's number of frames more, px.
        sds: (K, 2) standard deviations of the newest positions, px.
        densities: (K,) log p(y_t | Y_{t-1}) of this frame.
        first: (K, 2) first measurement of each track, px; NaN before it.
        born: (K,) frame of that.
        selected: Number of the selected track.
        reach: Age, in frames, of the oldest position smoothed in this frame.
        outlier_px: Distance from the estimate from which on a measurement counts as an outlier.
        paper: Width and height of the paper without pictures, px.
        settled: Measured, filtered and smoothed positions (32, K, 3, 2) of the frames before, the oldest first, px.
        origin: Original form of the tracks in a file; None for others.
        corners: The corners, if measurements come from pictures.
        own: Particles of the selected track, by a filter from a file; None for others.
        own_track: Their track.
        earlier: Places of the selected track's particles in the frame before, (n, 2) px, each once; None without.
        innovation: Innovation of the selected track, for the Kalman filter with a measurement.
        repeatable: Whether every step of a filter from a file came to the same when it was computed again.
    """

    belief: Belief
    raw: Floats
    filtered: Floats
    smoothed: Floats
    sds: Floats
    densities: Floats
    first: Floats
    born: Ints
    selected: int
    reach: int
    outlier_px: float
    paper: tuple[int, int]
    settled: tuple[NDArray[np.float32], ...] = ()
    origin: Origin | None = None
    corners: Corners | None = None
    own: ParticleSet | None = None
    own_track: int = -1
    earlier: NDArray[np.float32] | None = None
    innovation: NormalisedInnovation | None = None
    repeatable: bool = True

    @property
    def estimate(self) -> Floats:
        """(2,) filtered position of the selected track."""
        return np.asarray(self.filtered[0, self.selected])

    @property
    def sigma(self) -> Floats:
        """(2,) standard deviations of the same."""
        return np.asarray(self.sds[self.selected])

    @property
    def particles(self) -> tuple[Floats, Floats] | None:
        """Positions (n, 2) of the selected track's particles, px, and their weights (n,); None without particles."""
        if self.own is not None:
            return self.own.states[:, :2], self.own.weights
        return self.belief.age(self.selected, 0) if isinstance(self.belief, Cloud) else None

    @property
    def log_evidence(self) -> float:
        """Values of all tracks together."""
        return float(self.densities.sum())

    @property
    def outliers(self) -> Bools:
        """(W, K) which measurements are far from where the track is now thought to have been."""
        return _apart(self.raw, self.smoothed) > self.outlier_px

    @property
    def history(self) -> tuple[Floats, Bools]:
        """Measured, filtered and smoothed positions of all frames (T, K, 3, 2), px, and which are outliers (T, K)."""
        window = np.stack([self.raw, self.filtered, self.smoothed], axis=2)[::-1]
        rows = np.concatenate([*self.settled, window])
        # The stored past of a replaced corner does not belong to the new one.
        rows[np.arange(len(rows))[:, None] < self.born] = np.nan
        return rows, _apart(rows[:, :, 0], rows[:, :, 2]) > self.outlier_px

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return the positions, and the particles of the selected track where there are some, for a file."""
        arrays = {"filtered": self.filtered[0], "smoothed": self.smoothed, "raw": self.raw[0]}
        if self.particles is None:
            return arrays
        states, weights = self.particles
        return {**arrays, "states": states, "weights": weights}


def _apart(one: Floats, other: Floats) -> Floats:
    """Return the distances (...) of positions (..., 2); NaN where one is not known."""
    off = one - other
    return np.asarray(np.hypot(off[..., 0], off[..., 1]))


P: TypeAlias = TrajectoriesTrackerParameters


@dataclass(frozen=True, eq=False)
class Observation:
    """The measurements of K tracks in a frame; they do not depend on a tracker's random numbers.

    Attributes:
        corners: Corners searched in pictures; None where measurements are given.
        points: (K, 2) px, both NaN where a track has no measurement.
        again: (K,) whether a corner was just replaced, so another track begins there.
        gone: (K,) whether the place is unknown.
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


Law: TypeAlias = Callable[[Floats, Floats | float], Floats]
"""(distances (N, 2) px, sigma^2 (N,) or one for all, px^2) -> log densities (N,)."""

PLACE = (Component("x", "px"), Component("y", "px"))
LAW_COMPONENTS = (Component("ln σ²"), Component("ln τ²"))
"""Draws of particles with their own laws."""

MOST_TRACKS = 12
"""Tracks of a table with the largest innovations."""


@dataclass(frozen=True, eq=False)
class Measured:
    """The measurement of the selected track in a frame.

    Attributes:
        point: (2,) px, NaN where there is nothing.
        template: (b, b) searched grey levels; None where measurements are given.
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
    """Return the innovation of a track's measurement (2,), px; None without a measurement, or in its first frame.

    Args:
        before: Belief of the frame before.
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

    title = MEASUREMENT
    evidence = "normalised"
    weighs = False  # particles are laid open as they were drawn, each as often as it weighed

    def __init__(self, law: Law, *, learned: bool = False) -> None:
        """Choose the law of the noise, and whether a state has its own sigma^2 in addition to its place."""
        self.law, self.learned = law, learned

    @override
    def components(self, parameters: Values) -> tuple[Component, ...]:
        return (*PLACE, *LAW_COMPONENTS) if self.learned else PLACE

    @override
    def prepare(self, state: TrajectoriesState, frame: Frame, parameters: P) -> Measured:
        """Return what is measured of the selected track in a frame; in frame 0 that of the state itself."""
        track = parameters.selected_track % max(state.raw.shape[1], 1)
        if frame.index == 0:
            return Measured(state.raw[0, track], None if state.corners is None else state.corners.templates[track])
        # Searching one corner is fast, searching all is not.
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
        laws = state.belief.laws(state.selected) if isinstance(state.belief, Cloud) else None
        place = state.filtered[0, state.selected]
        return place.copy() if laws is None else np.concatenate([place, product(laws[1], laws[0])])

    @override
    def parts(self, one: Floats, frame: Frame, parameters: P, known: Measured) -> tuple[Part, ...]:
        scale = float(exponential(0.5 * one[2])) if self.learned else float(np.sqrt(parameters.noise_variance_px2))
        pairs = zip("xy", known.point.tolist(), one.tolist(), strict=False)
        compared = tuple(Residual(name, found, expected, scale, "px") for name, found, expected in pairs)
        return (*_patches(known, one, frame), *compared)

    @override
    def cloud(self, state: TrajectoriesState) -> LaidOpen | None:
        """Return the particles of the selected track after they were drawn, each once, laid open; None without."""
        belief, track = state.belief, state.selected
        if not isinstance(belief, Cloud) or not state.raw.shape[1]:
            return None
        states, shares = belief.age(track, 0)
        if not len(states):
            return None
        laws = belief.laws(track)
        if laws is not None:
            states = np.hstack([states, laws[0]])
        return LaidOpen(states, logarithm(shares), _parents(belief, track, state.earlier))

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
    """Return the searched template and the content at a place, side by side."""
    if known.template is None or frame.image_rgb is None or not np.isfinite(one[:2]).all():
        return ()
    (there,) = cut(luma(frame.image_rgb), np.rint(one[None, :2]).astype(np.int64), len(known.template))
    return (Patches("template", _in_colour(known.template), _in_colour(there)),)


def _in_colour(grey: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.repeat(grey[:, :, None], 3, axis=2)


def _parents(belief: Cloud, track: int, earlier: NDArray[np.float32] | None) -> Ints | None:
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


class LinearTrack(Track):
    """The same with Gaussian noise, which can be followed exactly."""

    scales: ClassVar = {
        "drive_variance_px2": NoiseScale("process", is_variance=True),
        "noise_variance_px2": NoiseScale("observation", is_variance=True),
    }

    @override
    def chains(self, state: TrajectoriesState, frames: Sequence[Frame], parameters: P) -> tuple[LinearChain, ...]:
        points, broken = _observe(state, frames, parameters)
        return tuple(
            _chain(column, parameters)
            for track in range(points.shape[1])
            for piece in np.split(points[:, track], np.flatnonzero(broken[:, track]))
            for column in _begin(piece)
        )


# A track begins with its first measurement y as N((y, y), s^2 I), of the frame before, so its chain begins there. Where
# a corner has given its place to another one, a chain ends and a further one begins.

TRANSITION = np.array([[2.0, -1.0], [1.0, 0.0]])
"""Transition of an axis' (p_t, p_{t-1}): the velocity stays."""


def _observe(state: TrajectoriesState, frames: Sequence[Frame], parameters: P) -> tuple[Floats, Bools]:
    """Return what was measured (T, K, 2), px, and in which frames a track was forgotten before it (T, K)."""
    corners = state.corners
    observed, broken = [state.raw[0]], [np.zeros(len(state.raw[0]), dtype=bool)]
    for frame in frames[1:]:
        seen = Observation.following(corners, frame, parameters)
        corners = seen.corners
        observed.append(seen.points)
        broken.append(seen.gone | seen.again)
    return np.stack(observed), np.stack(broken)


def _begin(piece: Floats) -> Iterator[Floats]:
    """Yield either axis of a track's measurements (T, 2) from the first one on; nothing of one without any."""
    measured = np.flatnonzero(np.isfinite(piece).all(axis=1))
    if len(measured):
        yield from piece[measured[0] :].T


def _chain(measured: Floats, parameters: P) -> LinearChain:
    noise = np.array([[math.sqrt(parameters.drive_variance_px2)], [0.0]])
    motion, observation = LinearDynamics(TRANSITION, np.zeros(2), noise), np.array([[1.0, 0.0]])
    covariance = np.array([[float(parameters.noise_variance_px2)]])
    steps = [LinearStep(motion, value, observation, covariance) for value in measured[:, None]]
    return LinearChain.of(np.full(2, measured[0]), float(parameters.start_spread_px) ** 2 * np.eye(2), steps)
