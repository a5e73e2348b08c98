"""Trajectories in the picture and through time, what is plotted of them, and tables of them for other programs.

Measured, filtered, smoothed and true points are drawn, outliers, and the selected track. A table has filtered and
smoothed positions, in the unit of the file that they came from.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.files import csv_text
from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.drawing import Links, Points, Primitive
from pftrack.core.model.measures import EvaluatedRun, Measure
from pftrack.core.model.palette import COLOURS, Colour
from pftrack.core.model.setup import Export
from pftrack.experiments.shared.sketch import at_height, circle, dots, lines
from pftrack.experiments.trajectories.model import TrajectoriesState
from pftrack.experiments.trajectories.recording import true_positions

TRAIL_FRAMES = 60
ON_PICTURE, OUTLIERS_ON_PICTURE = 12, 3
"""Frames of a trail, and of outliers, where there is a picture beneath that is to be seen."""

TRUE_FRAMES = 26
"""As many as one wants to see beside the smoothed ones: each is asked of the scene."""

FRAME_HEIGHT_PX = 4.0
"""How far one frame of the past is lifted in the space-time view."""

MOST_DRAWN = 2500
DOT_PX, PARTICLE_PX, RING_PX = 4.0, 2.5, 9.0
FURTHEST = 4.0
"""What is further from the picture's corner than so many of its longer sides is not drawn."""


def trails(state: TrajectoriesState, longest: float) -> dict[str, Primitive]:
    """Draw the last frames of all tracks, flat and through time, and the measurements that are outliers.

    Args:
        state: Of the frame.
        longest: Longer side of the picture, px.
    """
    raw, filtered, smoothed = (
        _near(rows[:TRAIL_FRAMES], longest) for rows in (state.raw, state.filtered, state.smoothed)
    )
    bare = state.corners is None
    flat, few = (TRAIL_FRAMES, TRAIL_FRAMES) if bare else (ON_PICTURE, OUTLIERS_ON_PICTURE)
    ends = np.stack([smoothed, raw], axis=2)
    wrong = state.outliers[:TRAIL_FRAMES] & np.isfinite(ends).all(axis=(2, 3))
    astray = ends[:few][wrong[:few]]
    risen = 1.0 + FRAME_HEIGHT_PX * np.nonzero(wrong)[0][:, None].astype(np.float64)
    drawn: dict[str, Primitive] = {
        "raw": Links(_join(raw[:flat], 1.0), COLOURS["observation"], 1.0, "measurements"),
        "raw points": _dots(raw[0], COLOURS["observation"], DOT_PX, "measurements"),
        "filtered": Links(_join(filtered[:flat], 1.2), COLOURS["prediction"], 1.5, "filtered"),
        "smoothed": Links(_join(smoothed[:flat], 1.4), COLOURS["estimate"], 2.0, "smoothed"),
        "outliers": lines(astray, COLOURS["lost"], 1.0, "outliers", height=1.6),
        "outlier points": _dots(astray[:, 1], COLOURS["lost"], DOT_PX + 1.0, "outliers"),
        "space-time": Links(_join(smoothed, 1.0, FRAME_HEIGHT_PX), COLOURS["estimate"], 2.0, "paths through time"),
        "outlier space-time": lines(ends[wrong], COLOURS["lost"], 1.5, "measured paths through time", height=risen),
        "raw space-time": Links(
            _join(raw, 1.0, FRAME_HEIGHT_PX), COLOURS["observation"], 1.0, "measured paths through time"
        ),
    }
    return drawn


def true_trails(state: TrajectoriesState, target: object, index: int, longest: float) -> dict[str, Primitive]:
    """Draw where the points truly were, where that is known."""
    ages = range(min(len(state.raw), TRUE_FRAMES))
    known = [true_positions(target, state, index - age) for age in ages]
    rows = [_near(one, longest) for one in known if one is not None]
    flat = TRUE_FRAMES if state.corners is None else ON_PICTURE
    if not rows:
        return {}
    return {
        "true": Links(_join(np.array(rows[:flat]), 1.1), COLOURS["truth"], 1.0, "true paths"),
        "true points": _dots(rows[0], COLOURS["truth"], 3.0, "truth"),
        "true space-time": Links(
            _join(np.array(rows), 1.0, FRAME_HEIGHT_PX), COLOURS["truth"], 1.0, "paths through time"
        ),
    }


def draw_selected(state: TrajectoriesState, longest: float) -> dict[str, Primitive]:
    """Draw a ring around the selected track, and its particles where it has some."""
    drawn: dict[str, Primitive] = {}
    if state.particles is not None:
        states, shares = state.particles
        # The heaviest first, so that those stay that stand for many.
        order = np.argsort(-shares, kind="stable")[:MOST_DRAWN]
        inside = _near(states[order], longest)
        drawn["particles"] = _dots(inside, COLOURS["prediction"], PARTICLE_PX, "particles", height=2.0)
    estimate = _near(state.estimate[None], longest)[0]
    if np.isfinite(estimate).all():
        drawn["estimate"] = circle(estimate, RING_PX, COLOURS["estimate"], "selected track", height=2.2)
    return drawn


def second_estimate(estimate: tuple[float, ...], longest: float) -> dict[str, Primitive]:
    """Draw where a second run has its selected track."""
    place = _near(np.array([estimate], dtype=np.float64), longest)[0]
    if not np.isfinite(place).all():
        return {}
    return {"second": circle(place, 1.6 * RING_PX, COLOURS["second"], "second run", height=2.1)}


def _near(positions: Floats, longest: float) -> Floats:
    """Return positions (..., 2), NaN where they are too far from the picture to be drawn."""
    near = (np.abs(positions) < FURTHEST * longest).all(axis=-1, keepdims=True)
    return np.where(near, positions, np.nan)


def _join(rows: Floats, height: float, lift: float = 0.0) -> NDArray[np.float32]:
    """Return the segments (n, 2, 3) between neighbouring frames of positions (W, K, 2), older frames further up."""
    ends = np.stack([rows[:-1], rows[1:]], axis=2)
    heights = np.broadcast_to(height + lift * np.arange(len(rows))[:, None], rows.shape[:2])
    known = np.isfinite(ends).all(axis=(2, 3))
    levels = np.stack([heights[:-1], heights[1:]], axis=2)[known]
    return at_height(ends[known], levels)


def _dots(positions: Floats, colour: Colour, size: float, layer: str, *, height: float = 1.8) -> Points:
    return dots(positions[np.isfinite(positions).all(axis=1)], colour, size, layer, height=height)


def _errors(course: EvaluatedRun) -> Floats:
    return course.errors


MEASURES = (
    Measure(
        "median_track_error_px",
        "Median error",
        "Median over the labelled frames of the distance of the selected track's filtered position from the truth.",
        "median",
        _errors,
        unit="px",
        better="lower",
    ),
)

HEADER = "frame", "track", "x", "y", "filtered_x", "filtered_y", "smoothed_x", "smoothed_y", "outlier"


def table_of(state: TrajectoriesState, past: Sequence[Diagnostics]) -> bytes:
    """Return all tracks up to a frame as CSV; what was not measured has empty cells.

    Args:
        state: Of the frame.
        past: Of all frames from 0 on.
    """
    origin = state.origin
    scale = 1.0 if origin is None else origin.scale
    corner = np.zeros(2) if origin is None else origin.corner
    rows, outliers = state.history
    first = past[-1].frame + 1 - len(rows) + (0 if origin is None else origin.first_frame)
    names = [str(number) for number in range(rows.shape[1])] if origin is None else origin.names
    places = rows / scale + corner
    lines: list[tuple[str, ...]] = [HEADER]
    for frame in range(len(rows)):
        for track, name in enumerate(names):
            if np.isfinite(places[frame, track]).any():
                cells = (_cell(number) for number in places[frame, track].ravel())
                lines.append((str(first + frame), name, *cells, str(int(outliers[frame, track]))))
    return csv_text(lines).encode()


def _cell(number: np.float64) -> str:
    return f"{number:.10g}" if np.isfinite(number) else ""


EXPORTS = (Export("paths", "Trajectories up to here, CSV", "paths.csv", "text/csv", table_of),)
