"""The trackers of a shape, by name: one step for all of them, which differ in the method."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.rotation import angles
from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.matrices import contiguous_copy
from pftrack.core.numerics.random import Stream
from pftrack.experiments.structure.trackers import observed as frames
from pftrack.experiments.structure.trackers.methods import Belief, Grown, Plain, Prior, Windowed, grow, plain, windowed
from pftrack.experiments.structure.trackers.parameters import StructureTrackerParameters
from pftrack.experiments.structure.trackers.placing import flat, place, place_again
from pftrack.experiments.structure.trackers.state import StructureState
from pftrack.sources.tracks.target import BodyTarget
from pftrack.vision.geometry.gaze import gaze
from pftrack.vision.structure.growing import Growing
from pftrack.vision.structure.outliers import find_right
from pftrack.vision.structure.tracks import check_view

__all__ = ["TRACKERS"]

Method: TypeAlias = Callable[[Belief, frames.Observed, Prior, StructureTrackerParameters], Belief]
View: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64]]

ANGLES = ("yaw", "pitch", "roll")
COMMON = (
    Series("depth_strength", "depth over its noise"),
    Series("depth_odds", "odds of the depth's sign"),
    Series("measured", "points measured", role="flag", shape="vector"),
    *(Series(f"{angle}_deg", angle, "°") for angle in ANGLES),
)
FREE_ENERGY = Series("free_energy", "free energy")
SWITCH = (
    Series("own_probability", "own shape predicts better"),
    Series("own_weight", "weight of the own shape"),
)


def start(
    method: Method, target: Target, frame: Frame, parameters: StructureTrackerParameters, _rng: Stream
) -> StructureState:
    """Begin with the first view: a shape without depth, or the mean of other bodies where one is known."""
    if not isinstance(target, BodyTarget):
        raise TypeError(f"a tracker of shapes follows a body, got a {type(target).__name__}")
    shape = target.shape
    prior = Prior(shape.mean, shape.prior_sd, target.focal_px)
    positions, variances = _measure(frame, target.principal_px, parameters)
    seen = frames.take(frames.begin(len(shape.names)), positions, variances)
    rows, precisions = check_view(positions, variances, len(shape.names))
    focal = prior.focal_px * parameters.lens_factor
    guess = flat(seen.filled[-1], rows, precisions, focal)
    state = StructureState(shape, prior, target.principal_px, seen, Plain(), guess, focal)
    return _take(method, state, parameters)


def step(
    method: Method, state: StructureState, frame: Frame, parameters: StructureTrackerParameters, _rng: Stream
) -> StructureState:
    """Take a further view."""
    positions, variances = _measure(frame, state.principal_px, parameters)
    seen = frames.take(state.seen, positions, variances)
    return _take(method, replace(state, seen=seen), parameters)


def _take(method: Method, state: StructureState, parameters: StructureTrackerParameters) -> StructureState:
    focal = float(state.prior.focal_px * parameters.lens_factor)
    prior = replace(state.prior, focal_px=focal)
    robust = parameters.wrong_odds > 0.0
    seen = doubt(state.seen, state.belief, focal, parameters.wrong_odds) if robust else state.seen
    belief = method(state.belief, seen, prior, parameters)
    state = replace(state, seen=seen)
    view = check_view(seen.positions[-1], seen.variances[-1], len(state.body.names))
    if belief.found is None:
        shape = place_again(state.placed, *view, focal)
    else:
        shape = place(state.placed, belief.found, *view, focal)
    evidence = belief.log_evidence if isinstance(belief, Grown) else 0.0
    return replace(state, belief=belief, placed=shape, focal_px=focal, log_evidence=evidence)


def doubt(seen: frames.Observed, belief: Belief, focal_px: float, wrong: float) -> frames.Observed:
    """Return what was seen, with the last frame's variances over how likely each measurement is right.

    Args:
        seen: The frames so far.
        belief: In the shape before it; nothing is doubted if nothing is known of it yet.
        focal_px: Of the camera.
        wrong: Share of the measurements that are wrong.
    """
    if belief.found is None:
        return seen
    shape, covariances = contiguous_copy(belief.found.points), contiguous_copy(belief.found.covariances)
    rows, precisions = check_view(seen.positions[-1], seen.told[-1], len(shape))
    right = find_right(focal_px, contiguous_copy(belief.found.camera), shape, covariances, rows, precisions, wrong)
    variances = seen.variances.copy()
    variances[-1] = seen.told[-1] / right[:, None]
    return replace(seen, variances=variances)


def _measure(frame: Frame, principal_px: NDArray[np.float64], parameters: StructureTrackerParameters) -> View:
    """Return positions (n, 2) from the principal point and variances (n, 2), infinite where a point is missing."""
    if frame.measurements is None:
        raise ValueError("a tracker of shapes needs measured points, got a frame without them")
    positions = frame.measurements.points_px - principal_px
    sd = np.broadcast_to(frame.measurements.sd_px.reshape(len(positions), -1), positions.shape)
    missing = ~(np.isfinite(positions) & np.isfinite(sd)).all(axis=1, keepdims=True)
    variances = np.where(missing, np.inf, np.square(np.maximum(sd, parameters.trust_px)))
    return np.where(missing, 0.0, positions), variances


def measure(state: StructureState) -> Mapping[str, SeriesValue]:
    """Return the values of the series."""
    belief, turn = state.belief, np.ascontiguousarray(state.placed.camera[:, :3])
    values: dict[str, SeriesValue] = {
        "depth_strength": belief.strength,
        "depth_odds": state.placed.depth_odds,
        "measured": tuple(np.isfinite(state.seen.variances[-1]).all(axis=1).astype(np.float64).tolist()),
    }
    pose = np.rad2deg(gaze(angles(turn)))
    values |= {f"{angle}_deg": float(value) for angle, value in zip(ANGLES, pose, strict=True)}
    if isinstance(belief, Windowed) and math.isfinite(belief.free_energy):
        values["free_energy"] = belief.free_energy
    if isinstance(belief, Grown) and isinstance(belief.state, Growing):
        values["own_probability"] = belief.state.probability
        values["own_weight"] = belief.state.weight
    return values


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
    )


TRACKERS: dict[str, Tracker] = {
    tracker.id: tracker
    for tracker in (
        _tracker(
            "growing",
            "Growing shape",
            "Keeps the covariance of all points together, from the mean of other bodies or from the first frames.",
            grow,
            *SWITCH,
        ),
        _tracker(
            "informed",
            "Variational, by information",
            "Factors a window by variational Bayes; each point is forgotten as far as it is seen.",
            partial(windowed, "by-information"),
            FREE_ENERGY,
        ),
        _tracker(
            "online",
            "Variational",
            "Factors a window by variational Bayes and averages over time; all points are forgotten alike.",
            partial(windowed, "common"),
            FREE_ENERGY,
        ),
        _tracker(
            "svd",
            "Singular values",
            "Factors all frames so far by singular values; every position counts alike, hidden or not.",
            plain,
        ),
    )
}
"""The trackers of a shape, by name, in the order in which they are shown."""
