"""The trackers of trajectories, by name: one step for all of them, which differ in the law of the noise."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.likelihood import ObservationLikelihood
from pftrack.core.model.linear import LinearModel
from pftrack.core.model.series import Interval, Series, SeriesValue
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.elementary import exponential
from pftrack.core.numerics.random import Stream
from pftrack.experiments.shared.innovation import NIS, measure_innovation
from pftrack.experiments.trajectories.scene.target import TrajectoriesTarget
from pftrack.experiments.trajectories.trackers.ensemble import ensemble
from pftrack.experiments.trajectories.trackers.inspection import (
    cauchy,
    innovate,
    normal,
    particles_of,
    track_likelihood,
    update_parts,
)
from pftrack.experiments.trajectories.trackers.linear import LINEAR_MODEL
from pftrack.experiments.trajectories.trackers.methods import Draw, Method, cloud_method, gaussian_method, without
from pftrack.experiments.trajectories.trackers.observing import Observation
from pftrack.experiments.trajectories.trackers.parameters import TrajectoriesTrackerParameters
from pftrack.experiments.trajectories.trackers.state import BLOCK, KEPT_FRAMES, TrajectoriesState
from pftrack.filters.trajectories import gaussian
from pftrack.filters.trajectories.cloud import Cloud
from pftrack.filters.trajectories.gaussian import Gaussians
from pftrack.filters.trajectories.modes import logs_mode

__all__ = ["COMMON", "TRACKERS", "measure", "start", "step"]

P: TypeAlias = TrajectoriesTrackerParameters

MEASUREMENT = "measurement of the selected track"

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
    method: Method, state: TrajectoriesState, observed: NDArray[np.float64], index: int, parameters: P, rng: Stream
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


def _begin_again(state: TrajectoriesState, again: NDArray[np.bool_]) -> TrajectoriesState:
    """Forget the past of the tracks (K,) whose corners have given their places to others."""
    if not again.any():
        return state
    rows = {name: getattr(state, name).copy() for name in ("raw", "filtered", "smoothed")}
    for values in rows.values():
        values[:, again] = np.nan
    first = np.where(again[:, None], np.nan, state.first)
    return replace(state, belief=without(state.belief, again), first=first, **rows)


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


def _measure_kalman(state: TrajectoriesState) -> Mapping[str, SeriesValue]:
    return {**measure(state), **measure_innovation(state.innovation)}


def _tracker(
    name: str,
    title: str,
    description: str,
    method: Method,
    likelihood: ObservationLikelihood,
    *series: Series,
    linear: LinearModel | None = None,
) -> Tracker:
    return Tracker(
        name,
        title,
        description,
        partial(start, method),
        partial(step, method),
        ensemble=partial(ensemble, method),
        series=(*COMMON, *series),
        measure=_measure_kalman if method is gaussian_method else measure,
        reads=(),
        likelihood=likelihood,
        cloud=None if method is gaussian_method else particles_of,
        update_parts=update_parts,
        # That of the self-organising one averages over the noises that it tries, so none is left to be fitted.
        evidence="normalised" if LAWS[0] not in series else "",
        linear=linear,
    )


TRACKERS: dict[str, Tracker] = {
    tracker.id: tracker
    for tracker in (
        _tracker(
            "nlng",
            "Self-organising (NLNG)",
            "Particles with Cauchy noise, each with a σ² and a τ² of its own, so that both are found while tracking.",
            partial(cloud_method, True),
            track_likelihood(MEASUREMENT, cauchy, learned=True),
            *SIZES,
            *LAWS,
        ),
        _tracker(
            "lng",
            "Cauchy noise (LNG)",
            "Particles under noise with heavy tails: a measurement far off is let go.",
            partial(cloud_method, False),
            track_likelihood(MEASUREMENT, cauchy),
            *SIZES,
        ),
        _tracker(
            "lg",
            "Gaussian noise (LG)",
            "The Kalman filter and its exact smoother: every measurement draws, the more the further off it is.",
            gaussian_method,
            track_likelihood(MEASUREMENT, normal),
            *NIS,
            linear=LINEAR_MODEL,
        ),
    )
}
"""The trackers of trajectories, by name, in the order in which they are shown."""
