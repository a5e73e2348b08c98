"""The trackers of trajectories, by name: one step for all of them, which differ in the law of the noise."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.filters.trajectories import cloud, gaussian
from pftrack.filters.trajectories.cloud import Cloud
from pftrack.filters.trajectories.gaussian import Gaussians
from pftrack.filters.trajectories.modes import logs_mode
from pftrack.filters.trajectories.whole import beginnings
from pftrack.model.frame import Frame, Target
from pftrack.model.series import Interval, Series, SeriesValue
from pftrack.model.tracker import Tracker
from pftrack.numerics.elementary import exponential
from pftrack.numerics.random import Stream
from pftrack.sources.trajectories.target import TrajectoriesTarget
from pftrack.trackers.trajectories.corner_parameters import CornerParameters
from pftrack.trackers.trajectories.corners import Corners, begin, follow
from pftrack.trackers.trajectories.parameters import TrajectoriesTrackerParameters
from pftrack.trackers.trajectories.state import BLOCK, KEPT_FRAMES, Belief, TrajectoriesState

__all__ = ["COMMON", "TRACKERS", "gaussian_method", "measure", "start", "step"]

P: TypeAlias = TrajectoriesTrackerParameters

Method: TypeAlias = Callable[[Belief, NDArray[np.float64], P, Stream], tuple[Belief, "Taken"]]

Taken: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Positions (A, K, 2) of this frame and those before it given all, the newest as it is filtered (K, 2), its standard
deviations (K, 2), and log densities (K,)."""

TAIL = 0.05
"""Of a posterior, left out on either side of an interval."""

COMMON = (
    Series("tracks", "tracks followed"),
    Series("seen_share", "measured"),
    Series("outlier_share", "outliers"),
    Series("track_log_evidence", "log evidence of the selected track"),
    Series("outlying", "outlier of the selected track", "px"),
)
LAWS = (
    Series("noise_sd_px", "scale σ of the noise", "px", "interval"),
    Series("drive_sd_px", "freedom τ of the motion", "px", "interval"),
    Series("noise_mode_px", "most probable σ", "px"),
    Series("drive_mode_px", "most probable τ", "px"),
)
SIZES = (
    Series("particles", "particles", role="particles"),
    Series("distinct", "different particles", role="distinct"),
    Series("roots", "different particles at the lag"),
)


def start(method: Method, target: Target, frame: Frame, parameters: P, rng: Stream) -> TrajectoriesState:
    """Begin with the first frame: each track that is measured in it with two positions about its measurement."""
    if not isinstance(target, TrajectoriesTarget):
        raise TypeError(f"a tracker of trajectories follows many points, got a {type(target).__name__}")
    corners, observed = _begin(target, frame, parameters)
    count = len(observed)
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
        corners=corners,
    )
    return _take(method, state, observed, frame.index, parameters, rng)


def step(method: Method, state: TrajectoriesState, frame: Frame, parameters: P, rng: Stream) -> TrajectoriesState:
    """Take a further frame."""
    if state.corners is None:
        return _take(method, state, _measure(frame), frame.index, parameters, rng)
    image, matching = _picture(frame, parameters)
    corners, observed = follow(state.corners, image, matching, frame.index)
    state = _begin_again(state, corners.born == frame.index)
    state = replace(state, belief=_without(state.belief, corners.gone), corners=corners)
    return _take(method, state, observed, frame.index, parameters, rng)


def _take(
    method: Method, state: TrajectoriesState, observed: NDArray[np.float64], index: int, parameters: P, rng: Stream
) -> TrajectoriesState:
    belief, (past, filtered, sds, densities) = method(state.belief, observed, parameters, rng)
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
        selected=parameters.selected_track % max(len(observed), 1),
        reach=reach,
        outlier_px=float(parameters.outlier_px),
    )


def _begin(target: TrajectoriesTarget, frame: Frame, parameters: P) -> tuple[Corners | None, NDArray[np.float64]]:
    """Return the corners of a picture, and where they are; or the measurements, where there is no picture."""
    if frame.image_rgb is None:
        return None, _measure(frame)
    return begin(*_picture(frame, parameters), target.start_px)


def _picture(frame: Frame, parameters: object) -> tuple[NDArray[np.uint8], CornerParameters]:
    if frame.image_rgb is None or not isinstance(parameters, CornerParameters):
        raise ValueError("corners are followed in pictures, with parameters of matching; got a frame or values without")
    return frame.image_rgb, parameters


def _begin_again(state: TrajectoriesState, again: NDArray[np.bool_]) -> TrajectoriesState:
    """Forget the past of the tracks (K,) whose corners have given their places to others."""
    if not again.any():
        return state
    rows = {name: getattr(state, name).copy() for name in ("raw", "filtered", "smoothed")}
    for values in rows.values():
        values[:, again] = np.nan
    first = np.where(again[:, None], np.nan, state.first)
    return replace(state, belief=_without(state.belief, again), first=first, **rows)


def _without(belief: Belief, ended: NDArray[np.bool_]) -> Belief:
    """Believe nothing any more of some tracks (K,): each begins again with its next measurement."""
    if not ended.any():
        return belief
    return cloud.without(belief, ended) if isinstance(belief, Cloud) else gaussian.without(belief, ended)


def _measure(frame: Frame) -> NDArray[np.float64]:
    """Return the measurements (K, 2) of a frame, both NaN where either is missing."""
    if frame.measurements is None:
        raise ValueError("a tracker of trajectories needs measured points, got a frame without them")
    points = frame.measurements.points_px
    return np.where(np.isfinite(points).all(axis=1, keepdims=True), points, np.nan)


def _append(rows: NDArray[np.float64], row: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([row[None], rows])


def _settle(state: TrajectoriesState) -> TrajectoriesState:
    """Put the oldest frames away where there are enough of them."""
    if len(state.raw) < KEPT_FRAMES + BLOCK:
        return state
    recent = {name: getattr(state, name)[:KEPT_FRAMES] for name in ("raw", "filtered", "smoothed")}
    oldest = np.stack([state.raw, state.filtered, state.smoothed], axis=2)[KEPT_FRAMES:]
    block = np.ascontiguousarray(oldest[::-1], dtype=np.float32)
    return replace(state, settled=(*state.settled, block), **recent)


def gaussian_method(belief: Belief, observed: NDArray[np.float64], parameters: P, _rng: Stream) -> tuple[Belief, Taken]:
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


def cloud_method(
    learned: bool, belief: Belief, observed: NDArray[np.float64], parameters: P, rng: Stream
) -> tuple[Belief, Taken]:
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
        numbers=np.arange(count),
        stream=(rng.seed, rng.frame, rng.purpose.value),
    )
    return belief, (moments.past, moments.estimates, moments.sds, moments.densities)


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


def _interval(logs: NDArray[np.float64], shares: NDArray[np.float64]) -> Interval:
    """Return between which standard deviations nine tenths of the posterior of a log variance lie."""
    order = np.argsort(logs, kind="stable")
    reached = np.cumsum(shares[order])
    low, high = np.searchsorted(reached, (TAIL, 1.0 - TAIL))
    ends = logs[order][[low, min(high, len(order) - 1)]]
    return Interval(*(float(value) for value in exponential(0.5 * ends)))


def _tracker(name: str, title: str, description: str, method: Method, *series: Series) -> Tracker:
    return Tracker(
        name,
        title,
        description,
        partial(start, method),
        partial(step, method),
        series=(*COMMON, *series),
        measure=measure,
        reads=(),
        # That of the self-organising one averages over the noises that it tries, so none is left to be fitted.
        evidence="normalised" if LAWS[0] not in series else "",
    )


TRACKERS: dict[str, Tracker] = {
    tracker.id: tracker
    for tracker in (
        _tracker(
            "nlng",
            "Self-organising (NLNG)",
            "Particles with Cauchy noise, each with a σ² and a τ² of its own, so that both are found while tracking.",
            partial(cloud_method, True),
            *SIZES,
            *LAWS,
        ),
        _tracker(
            "lng",
            "Cauchy noise (LNG)",
            "Particles under noise with heavy tails: a measurement far off is let go.",
            partial(cloud_method, False),
            *SIZES,
        ),
        _tracker(
            "lg",
            "Gaussian noise (LG)",
            "The Kalman filter and its exact smoother: every measurement draws, the more the further off it is.",
            gaussian_method,
        ),
    )
}
"""The trackers of trajectories, by name, in the order in which they are shown."""
