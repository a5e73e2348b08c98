"""How far tracks are from the truth, and how far they seem to move: of one frame, and of a whole run."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.frame import Frame
from pftrack.core.model.series import Reduction, Series, SeriesValue
from pftrack.experiments.trajectories.scene.target import TrajectoriesTarget
from pftrack.experiments.trajectories.trackers.state import TrajectoriesState

__all__ = ["SERIES", "measure", "report", "true_positions"]

SERIES = (
    Series("raw_rms_px", "error of the measurements", "px", reductions=(Reduction("raw_rms", "raw error", "mean"),)),
    Series(
        "filtered_rms_px",
        "error of the filtered positions",
        "px",
        reductions=(Reduction("filtered_rms", "filtered error", "mean"),),
    ),
    Series(
        "smoothed_rms_px",
        "error of the smoothed positions",
        "px",
        reductions=(Reduction("smoothed_rms", "smoothed error", "mean"),),
    ),
    Series(
        "mismatch_share",
        "measured far from the truth",
        reductions=(Reduction("mismatched", "measured far from the truth", "mean"),),
    ),
    Series(
        "smoothed_mismatch_share",
        "smoothed far from the truth",
        reductions=(Reduction("smoothed_mismatched", "smoothed far from the truth", "mean"),),
    ),
    Series("raw_motion_px", "false motion of the measurements", "px"),
    Series("false_motion_px", "false motion of the smoothed positions", "px"),
    Series("resting", "tracks at rest"),
    Series("smoothed_frame", "frame that was smoothed last"),
)


def true_positions(target: object, state: TrajectoriesState, index: int) -> NDArray[np.float64] | None:
    """Return where the tracked points truly are in a frame (K, 2), px; None where nothing is known of it."""
    if not isinstance(target, TrajectoriesTarget) or target.motion is None:
        return None
    points = state.first
    if target.start_px is not None:
        points = np.where((state.born == 0)[:, None], target.start_px, points)
    return target.motion.path(points, index, state.born)


def measure(frame: Frame, state: TrajectoriesState) -> Mapping[str, SeriesValue]:
    """Return the values of the series; those that need the truth are left out where it is not known."""
    before = frame.index - state.reach
    values: dict[str, SeriesValue] = {"smoothed_frame": float(before)}
    now, then = (true_positions(frame.target, state, index) for index in (frame.index, before))
    if now is None or then is None:
        return values | _false_motion(state)
    raw, smoothed = state.raw[0] - now, state.smoothed[state.reach] - then
    found = {
        "raw_rms_px": _rms(raw),
        "filtered_rms_px": _rms(state.filtered[0] - now),
        "smoothed_rms_px": _rms(smoothed),
        "mismatch_share": _far(raw, state.outlier_px),
        "smoothed_mismatch_share": _far(smoothed, state.outlier_px),
    }
    return values | {name: value for name, value in found.items() if math.isfinite(value)}


def _false_motion(state: TrajectoriesState) -> dict[str, SeriesValue]:
    """Return how far tracks seem to be from where they began: of those at rest, if pictures tell which those are."""
    corners = state.corners
    resting = np.ones(len(state.first), np.bool_) if corners is None else corners.resting
    moved = {
        "raw_motion_px": _rms((state.raw[0] - state.first)[resting]),
        "false_motion_px": _rms((state.smoothed[state.reach] - state.first)[resting]),
    }
    values: dict[str, SeriesValue] = {name: value for name, value in moved.items() if math.isfinite(value)}
    return values if corners is None else values | {"resting": float(resting.sum())}


def _rms(off: NDArray[np.float64]) -> float:
    """Return the root mean square length of vectors (K, 2), of those that are known."""
    squares = np.square(off).sum(axis=1)
    known = squares[np.isfinite(squares)]
    return float(np.sqrt(known.mean())) if len(known) else math.nan


def _far(off: NDArray[np.float64], limit_px: float) -> float:
    """Return the share of vectors (K, 2) that are longer than a limit, of those that are known."""
    lengths = np.hypot(off[:, 0], off[:, 1])
    known = lengths[np.isfinite(lengths)]
    return float((known > limit_px).mean()) if len(known) else math.nan


def report(rows: Sequence[Diagnostics]) -> Mapping[str, Any]:
    """Return how many tracks there were, how far they seemed to move, and their errors where the truth is known.

    A frame's smoothed positions are those by the last frame that has smoothed it, so those of the last frames, whose
    lag is not full yet, do not count.
    """
    settled = {int(row.number("smoothed_frame")): row for row in rows}
    kinds = {
        "raw_motion_px": rows,
        "false_motion_px": settled.values(),
        "raw_rms_px": rows,
        "filtered_rms_px": rows,
        "smoothed_rms_px": settled.values(),
    }
    found = {name: _whole([row.number(name) for row in some]) for name, some in kinds.items()}
    tracks = max((row.number("tracks") for row in rows), default=0.0)
    known = {name: value for name, value in found.items() if value is not None or name == "false_motion_px"}
    return {"tracks": int(tracks), **known}


def _whole(values: Sequence[float]) -> float | None:
    known = [value * value for value in values if math.isfinite(value)]
    return math.sqrt(sum(known) / len(known)) if known else None
