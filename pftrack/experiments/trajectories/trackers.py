"""The trackers of trajectories, by name: one step for all of them, which differ in the law of the noise.

Tracks are independent: each is filtered separately, with random numbers drawn by its own number. So a method accepts
any set of tracks, a track may occur several times with different seeds, and filtering does not depend on how much of
the past is kept for smoothing. All methods use the same form of belief. A filter in a file follows the selected track,
and the Kalman filter all others.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal, Self, TypeAlias

import numpy as np
from typing_extensions import override

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.likelihood import Cloud as LaidOpen
from pftrack.core.model.likelihood import Component
from pftrack.core.model.model import FilterModel, State
from pftrack.core.model.parameters import revise
from pftrack.core.model.series import Interval, Series, SeriesValue
from pftrack.core.model.source import Frame, History, Measurements, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.elementary import exponential
from pftrack.core.numerics.random import Gaussian, Generator, Purpose, Stream
from pftrack.experiments.declared import read_reported
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.filtered import Update, measure_innovation
from pftrack.experiments.trajectories.model import (
    BLOCK,
    KEPT_FRAMES,
    MEASUREMENT,
    Belief,
    LinearTrack,
    Observation,
    P,
    Track,
    TrajectoriesState,
    cauchy,
    innovate,
    normal,
)
from pftrack.experiments.trajectories.scene import TrajectoriesTarget
from pftrack.filters.particles import ParticleSet
from pftrack.filters.trajectories import cloud, gaussian
from pftrack.filters.trajectories.cloud import Cloud
from pftrack.filters.trajectories.gaussian import Gaussians, logs_mode
from pftrack.filters.trajectories.whole import beginnings

Taken: TypeAlias = tuple[Floats, Floats, Floats, Floats]
"""Positions (A, K, 2) of this frame and those before it given all, the newest as it is filtered (K, 2), its standard
deviations (K, 2), and log densities (K,)."""


@dataclass(frozen=True, slots=True, eq=False)
class Draw:
    """Key of the random numbers of a frame.

    Attributes:
        numbers: (K,) of the tracks.
        seeds: One for all, or (K,) one for each.
        frame: Index of the frame.
        purpose: Their purpose.
    """

    numbers: Ints
    seeds: int | Ints
    frame: int
    purpose: Purpose

    @classmethod
    def of(cls, rng: Stream, count: int) -> Self:
        """Return what the numbers of a step are drawn by, for all of its tracks."""
        return cls(np.arange(count), rng.seed, rng.frame, rng.purpose)


Method: TypeAlias = Callable[[Belief, Floats, P, Draw], tuple[Belief, Taken]]


def without(belief: Belief, ended: Bools) -> Belief:
    """Believe nothing any more of some tracks (K,): each begins again with its next measurement."""
    if not ended.any():
        return belief
    return cloud.without(belief, ended) if isinstance(belief, Cloud) else gaussian.without(belief, ended)


def select(belief: Belief, tracks: Ints) -> Belief:
    """Return the belief of some of the tracks, given by their numbers (M,), in that order; any may be there again."""
    return cloud.select(belief, tracks) if isinstance(belief, Cloud) else gaussian.select(belief, tracks)


def gaussian_method(belief: Belief, observed: Floats, parameters: P, _draw: Draw) -> tuple[Belief, Taken]:
    """Take a frame by the Kalman filter and smooth by its exact smoother."""
    if isinstance(belief, Cloud):
        means, covariances = belief.moments()
        belief = Gaussians(means[None], covariances[None], np.zeros((1, len(means))))
    count = len(observed)
    belief, densities = gaussian.step(
        belief,
        observed,
        np.full(count, float(parameters.noise_variance_px2)),
        np.full(count, float(parameters.drive_variance_px2)),
        lag=parameters.lag_frames,
        start_sd=parameters.start_spread_px,
    )
    past, _ = gaussian.smooth(belief)
    sds = np.repeat(np.sqrt(belief.covariances[0, :, :1]), 2, axis=1)
    return belief, (past, belief.means[0, :, :, 0], sds, densities)


def cloud_method(learned: bool, belief: Belief, observed: Floats, parameters: P, draw: Draw) -> tuple[Belief, Taken]:
    """Take a frame by particles with Cauchy noise, whose scale and that of the motion are learned or not."""
    count = len(observed)
    if isinstance(belief, Gaussians):
        followed = np.isfinite(belief.means[0, :, 0, 0])
        fresh = gaussian.begin(belief.means[0], belief.covariances[0], observed, parameters.start_spread_px)
        beginning = (*fresh, followed.astype(np.int64))
        belief = cloud.nothing(count)
    else:
        beginning = beginnings(belief, observed, parameters.start_spread_px)
    belief, moments = cloud.step(
        belief,
        observed,
        cloud.Law(
            np.full(count, float(parameters.noise_variance_px2)),
            np.full(count, float(parameters.drive_variance_px2)),
            learned=learned,
            drift=float(parameters.law_drift),
        ),
        beginning,
        count=parameters.sample_count,
        lag=parameters.lag_frames,
        by_mode=parameters.point_estimate == "mode",
        numbers=draw.numbers,
        stream=(draw.seeds, draw.frame, draw.purpose.value),
    )
    return belief, (moments.past, moments.estimates, moments.sds, moments.densities)


TAIL = 0.05
"""Share of a posterior outside an interval on either side."""

_ALL = tuple(read_reported(Path(__file__).parent).values())
COMMON, LAWS, SIZES = _ALL[:5], _ALL[5:9], _ALL[9:]
"""Series of every tracker; of one that learns the scales of noise and motion; of those with particles."""


def start(method: Method, target: Target, frame: Frame, parameters: P, rng: Stream) -> TrajectoriesState:
    """Begin with the first frame: each track that is measured in it with two positions about its measurement."""
    if not isinstance(target, TrajectoriesTarget):
        raise TypeError(f"a tracker of trajectories follows many points, got a {type(target).__name__}")
    seen = Observation.first(target, frame, parameters)
    count = len(seen.points)
    none = np.zeros((0, count, 2))
    state = TrajectoriesState(
        belief=gaussian.nothing(count),
        raw=none,
        filtered=none,
        smoothed=none,
        sds=np.full((count, 2), np.nan),
        densities=np.zeros(count),
        first=np.full((count, 2), np.nan),
        born=np.zeros(count, np.int64),
        selected=0,
        reach=0,
        outlier_px=parameters.outlier_px,
        paper=target.paper,
        origin=target.origin,
        corners=seen.corners,
    )
    return _take(method, state, seen.points, frame.index, parameters, rng)


def step(method: Method, state: TrajectoriesState, frame: Frame, parameters: P, rng: Stream) -> TrajectoriesState:
    """Take a further frame."""
    seen = Observation.following(state.corners, frame, parameters)
    state = _begin_again(state, seen.again)
    state = replace(state, belief=without(state.belief, seen.gone), corners=seen.corners)
    return _take(method, state, seen.points, frame.index, parameters, rng)


def _take(
    method: Method, state: TrajectoriesState, observed: Floats, index: int, parameters: P, rng: Stream
) -> TrajectoriesState:
    before, selected = state.belief, parameters.selected_track % max(len(observed), 1)
    belief, (past, filtered, sds, densities) = method(before, observed, parameters, Draw.of(rng, len(observed)))
    innovation, earlier = None, None
    if len(observed) and isinstance(before, Gaussians) and isinstance(belief, Gaussians):
        noise, drive = float(parameters.noise_variance_px2), float(parameters.drive_variance_px2)
        innovation = innovate(before, selected, observed[selected], noise, drive)
    elif len(observed) and isinstance(before, Cloud) and state.selected == selected:
        first, last = before.offsets[selected, :2]
        earlier = before.nodes[first:last].copy()
    reach = min(parameters.lag_frames, len(past) - 1, len(state.raw))
    state = _settle(state)
    smoothed = _append(state.smoothed, filtered)
    # A track that another method has followed is known again only since that.
    now, known = past[: reach + 1], slice(0, reach + 1)
    smoothed[known] = np.where(np.isnan(now), smoothed[known], now)
    new = np.isnan(state.first[:, 0]) & np.isfinite(observed).all(axis=1)
    return replace(
        state,
        belief=belief,
        raw=_append(state.raw, observed),
        filtered=_append(state.filtered, filtered),
        smoothed=smoothed,
        sds=sds,
        densities=densities,
        first=np.where(new[:, None], observed, state.first),
        born=np.where(new, index, state.born),
        selected=selected,
        reach=reach,
        outlier_px=float(parameters.outlier_px),
        earlier=earlier,
        innovation=None if innovation is None else innovation.normalised,
    )


def _begin_again(state: TrajectoriesState, again: Bools) -> TrajectoriesState:
    """Forget the past of the tracks (K,) whose corners have given their places to others."""
    if not again.any():
        return state
    rows = {name: getattr(state, name).copy() for name in ("raw", "filtered", "smoothed")}
    for values in rows.values():
        values[:, again] = np.nan
    first = np.where(again[:, None], np.nan, state.first)
    return replace(state, belief=without(state.belief, again), first=first, **rows)


def _append(rows: Floats, row: Floats) -> Floats:
    return np.concatenate([row[None], rows])


def _settle(state: TrajectoriesState) -> TrajectoriesState:
    """Put the oldest frames away where there are enough of them."""
    if len(state.raw) < KEPT_FRAMES + BLOCK:
        return state
    recent = {name: getattr(state, name)[:KEPT_FRAMES] for name in ("raw", "filtered", "smoothed")}
    oldest = np.stack([state.raw, state.filtered, state.smoothed], axis=2)[KEPT_FRAMES:]
    block = np.ascontiguousarray(oldest[::-1], dtype=np.float32)
    return replace(state, settled=(*state.settled, block), **recent)


def measure(state: TrajectoriesState) -> Mapping[str, SeriesValue]:
    """Return the values of the series."""
    seen = np.isfinite(state.raw[0, :, 0])
    off = state.raw[0] - state.filtered[0]
    distances = np.hypot(off[:, 0], off[:, 1])
    values: dict[str, SeriesValue] = {
        "tracks": float(np.isfinite(state.filtered[0, :, 0]).sum()),
        "seen_share": float(seen.mean()) if len(seen) else 0.0,
        "outlier_share": float((distances[seen] > state.outlier_px).mean()) if seen.any() else 0.0,
    }
    if len(seen):
        values["track_log_evidence"] = float(state.densities[state.selected])
        values["outlying"] = float(distances[state.selected])
    values |= measure_innovation(state.innovation)
    if isinstance(state.belief, Cloud) and len(seen):
        values |= _of_cloud(state.belief, state.selected, state.reach)
    return values


def _of_cloud(belief: Cloud, selected: int, reach: int) -> Mapping[str, SeriesValue]:
    here, shares = belief.age(selected, 0)
    if not len(here):
        return {}
    roots = belief.age(selected, min(reach, belief.offsets.shape[1] - 2))[0]
    first, last = belief.offsets[selected, :2]
    values: dict[str, SeriesValue] = {
        "particles": float(belief.counts[first:last].sum()),
        "distinct": float(len(here)),
        "roots": float(len(roots)),
    }
    laws = belief.laws(selected)
    if laws is not None:
        for name, logs in zip(("noise", "drive"), laws[0].T, strict=True):
            values[f"{name}_sd_px"] = _interval(logs, shares)
            values[f"{name}_mode_px"] = float(exponential(0.5 * logs_mode(logs, shares)))
    return values


def _interval(logs: Floats, shares: Floats) -> Interval:
    """Return between which standard deviations nine tenths of the posterior of a log variance lie."""
    order = np.argsort(logs, kind="stable")
    reached = np.cumsum(shares[order])
    low, high = np.searchsorted(reached, (TAIL, 1.0 - TAIL))
    ends = logs[order][[low, min(high, len(order) - 1)]]
    return Interval(*(float(value) for value in exponential(0.5 * ends)))


def ensemble(
    method: Method,
    state: TrajectoriesState,
    frames: Iterable[Frame],
    history: History[P],
    seeds: Sequence[int],
) -> Iterator[Floats]:
    """Yield the estimates (N, 2) of each frame after a state, px, with each of N seeds.

    The estimate is where the selected track is filtered. So no other track need be followed, and no past be kept for
    the smoother; and what is measured in a picture is the same for all seeds. With sixty tracks and twenty-five past
    frames this leaves a hundredth of the work, with the same numbers.

    Args:
        method: Method of the tracker.
        state: State of the frame before the first.
        frames: To come, one after the other.
        history: The parameters of all frames.
        seeds: (N,) of the random numbers of each run.
    """
    count = state.raw.shape[1]
    tracks = np.unique([parameters.selected_track % max(count, 1) for _, parameters in history.segments])
    # Track by track all seeds.
    numbers, several = np.repeat(tracks, len(seeds)), np.tile(np.asarray(seeds, np.int64), len(tracks))
    belief, corners, places = select(state.belief, numbers), state.corners, numbers
    if corners is not None and not any(getattr(each, "new_corners", False) for _, each in history.segments):
        # No corner takes the place of another, so what becomes of the others does not matter either.
        corners, places = corners.select(tracks), np.repeat(np.arange(len(tracks)), len(seeds))
    short = History(tuple((first, revise(each, {"lag_frames": 0})) for first, each in history.segments))
    for frame in frames:
        parameters = short.at(frame.index)
        seen = Observation.following(corners, frame, parameters)
        corners = seen.corners
        belief = without(belief, (seen.again | seen.gone)[places])
        draw = Draw(numbers, several, frame.index, Purpose.TRACK)
        belief, (_, filtered, _, _) = method(belief, seen.points[places], parameters, draw)
        selected = np.flatnonzero(tracks == parameters.selected_track % count)[0]
        yield filtered[selected * len(seeds) :][: len(seeds)]


def _tracker(
    name: str,
    method: Method,
    model: Track,
    sampling: Literal["exact", "prior", "other"],
    *series: Series,
) -> Tracker:
    return Tracker(
        name,
        partial(start, method),
        partial(step, method),
        ensemble=partial(ensemble, method),
        series=(*COMMON, *series),
        measure=measure,
        model=model,
        sampling=sampling,
    )


TRACKERS: dict[str, Tracker] = {
    tracker.id: tracker
    for tracker in (
        _tracker(
            "nlng",
            partial(cloud_method, True),
            Track(cauchy, learned=True),
            "other",  # it averages over the noises that it tries, so none is left to be fitted
            *SIZES,
            *LAWS,
        ),
        _tracker("lng", partial(cloud_method, False), Track(cauchy), "prior", *SIZES),
        _tracker("lg", gaussian_method, LinearTrack(normal), "exact", *reports.NIS),
    )
}
"""The trackers of trajectories, by name, in the order in which they are shown."""

COMPONENTS = (Component("x", "px"), Component("y", "px"), Component("x before", "px"), Component("y before", "px"))


class Motion(FilterModel):
    """The second-order motion of the selected track, with Cauchy noise, as a filter in a file takes its place.

    The Kalman filter follows all other tracks; `known` has taken the frame for all of them.
    """

    title = MEASUREMENT
    weighs = False
    observed = (
        "frame.measurements.points_px (1, 2) is the measurement of the selected track, not finite where it is missing"
    )
    example = "pftrack.experiments.trajectories.example_filter"
    reads = "lng"

    @override
    def components(self, parameters: P) -> tuple[Component, ...]:
        return COMPONENTS

    @override
    def count(self, parameters: P) -> int:
        return parameters.sample_count

    @override
    def start(self, target: Target, frame: Frame, parameters: P, rng: Stream) -> TrajectoriesState:
        begun = start(gaussian_method, target, frame, parameters, rng)
        return replace(begun, own=ParticleSet.uniform(_drawn(begun, 0, parameters, rng)), own_track=begun.selected)

    @override
    def prepare(self, state: TrajectoriesState, frame: Frame, parameters: P) -> TrajectoriesState:
        """Take the frame for all tracks; what is known of the selected one is replaced when its particles have it."""
        return step(gaussian_method, state, frame, parameters, Stream(0, frame.index, Purpose.TRACK))

    @override
    def particles(self, state: TrajectoriesState, parameters: P, rng: Generator) -> ParticleSet:
        """Return the particles of the frame before, drawn from the Kalman filter's belief if missing."""
        if state.own is not None and state.own_track == state.selected:
            return state.own
        return ParticleSet.uniform(_drawn(state, 1, parameters, rng))

    @override
    def propagate(self, states: Floats, frame: Frame, parameters: P, rng: Generator, known: State) -> Floats:
        """Return the second-order motion that all methods of trajectories take for true."""
        now, before = states[:, :2], states[:, 2:]
        drive = np.sqrt(parameters.drive_variance_px2)
        return np.concatenate([2.0 * now - before + drive * rng.standard_normal(now.shape), now], axis=1)

    @override
    def log_likelihood(self, states: Floats, frame: Frame, parameters: P, known: TrajectoriesState) -> Floats:
        """Return the Cauchy density of the selected track's measurement, 0 without one."""
        measured = known.raw[0, known.selected]
        if not np.isfinite(measured).all():
            return np.zeros(len(states))
        return cauchy(states[:, :2] - measured, float(parameters.noise_variance_px2))

    @override
    def believe(self, known: TrajectoriesState, update: Update, frame: Frame, parameters: P) -> TrajectoriesState:
        track, posterior = known.selected, update.posterior
        rows = {name: getattr(known, name).copy() for name in ("filtered", "smoothed", "sds", "densities")}
        rows["filtered"][0, track] = posterior.mean[:2]
        rows["smoothed"][:, track] = rows["filtered"][:, track]  # particles without their past are not smoothed
        rows["sds"][track] = posterior.standard_deviations[:2]
        rows["densities"][track] = update.log_evidence
        return replace(
            known, **rows, own=update.particles, own_track=track, innovation=None, repeatable=update.repeatable
        )

    @override
    def see(self, frame: Frame, known: TrajectoriesState) -> Frame:
        """Return the frame with the measurement of the selected track alone, (1, 2)."""
        measured = known.raw[0, known.selected][None]
        return replace(frame, measurements=Measurements(measured, np.ones(1)))

    @property
    @override
    def series(self) -> tuple[Series, ...]:
        return (*COMMON, *reports.CLOUD)

    @override
    def measure(self, state: TrajectoriesState) -> Mapping[str, SeriesValue]:
        own = {} if state.own is None else reports.cloud(state.own, resampled=True)
        return {**measure(state), **own}

    @override
    def centre(self, state: TrajectoriesState) -> Floats:
        """Return the filtered place of the selected track, in this frame and the one before, (4,)."""
        now = state.filtered[0, state.selected]
        return np.concatenate([now, state.filtered[min(1, len(state.filtered) - 1), state.selected]])

    @override
    def cloud(self, state: TrajectoriesState) -> LaidOpen | None:
        own = state.own
        return None if own is None else LaidOpen(own.states, own.log_weights, own.ancestors)


def _drawn(state: TrajectoriesState, age: int, parameters: P, rng: Generator) -> Floats:
    """Return states (N, 4) of the selected track some frames ago, of a track that had not begun about where it is."""
    belief, track = state.belief, state.selected
    shape = parameters.sample_count, 2
    if isinstance(belief, Gaussians) and age < len(belief.means) and np.isfinite(belief.means[age, track]).all():
        mean, (own, both, before) = belief.means[age, track], belief.covariances[age, track]
        covariance = np.array([[own, both], [both, before]]) + 1e-9 * np.eye(2)
        x, y = (Gaussian(axis, covariance).sample(rng, parameters.sample_count) for axis in mean)
        return np.stack([x[:, 0], y[:, 0], x[:, 1], y[:, 1]], axis=1)
    place = state.raw[0, track] if np.isfinite(state.raw[0, track]).all() else np.array(state.paper) / 2.0
    positions = place + parameters.start_spread_px * rng.standard_normal(shape)
    return np.concatenate([positions, positions], axis=1)


MODEL = Motion()
