"""How good an estimate of a chain is: its errors, its bands, and how probable it is that the pose is lost.

`docs/explanation/calibration.md` has the bands. `python -m tools.loss_probability fit linkage` fits the probability of
a loss and writes `loss_probability.json`.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.measures import EvaluatedRun, Measure, held_at_end
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Frame, Target
from pftrack.core.numerics.elementary import wrap
from pftrack.experiments.linkage.scene import LinkageTarget, in_radians
from pftrack.experiments.linkage.set_trackers import Region, contains
from pftrack.experiments.linkage.shape import LINKS
from pftrack.experiments.linkage.state import LinkageState
from pftrack.filters.beam import Beam

IN_SPACE = 11
"""Numbers of an estimate in space: omega, t, theta and r."""
CLEARLY_RAD = np.deg2rad(20)
"""So far from the truth a direction must be for its mirror image to be another one."""

SERIES = (
    Series("contained", "truth contained", role="flag"),
    Series("mirrored", "a link mirrored in depth", role="mirrored"),
    Series("excess", "largest error over its deviation", role="excess"),
    *(Series(f"true_length_{link}", f"true length of link {link}", "px") for link in range(1, LINKS + 1)),
    *(Series(f"true_direction_{link}", f"true direction of link {link}", "°") for link in range(1, LINKS + 1)),
)


def direction_error(estimates: Floats, truths: Floats) -> Floats:
    """Return the greatest angle (...) between the believed and the true direction of a link, degrees.

    Args:
        estimates: (..., 6) or (..., 11), as trackers estimate them.
        truths: Of the same shape, relative to the same reference attitude.
    """
    believed, true = (_unit_vectors(np.asarray(one, dtype=np.float64)) for one in (estimates, truths))
    across = np.linalg.norm(np.cross(believed, true), axis=-1)
    return np.asarray(np.rad2deg(np.arctan2(across, (believed * true).sum(axis=-1)).max(axis=-1)))


def _unit_vectors(positions: Floats) -> Floats:
    """Return the directions of the links (..., 3, 3), a link in each row."""
    absolute = np.deg2rad(np.cumsum(positions[..., -2 * LINKS : -LINKS], axis=-1))
    flat = np.stack([np.cos(absolute), np.sin(absolute), np.zeros_like(absolute)], axis=-1)
    if positions.shape[-1] != IN_SPACE:
        return flat
    omega = np.deg2rad(positions[..., None, :3])
    angle = np.linalg.norm(omega, axis=-1, keepdims=True)
    axis = np.divide(omega, angle, out=np.zeros_like(omega), where=angle > 0.0)
    axis = np.broadcast_to(axis, flat.shape)
    along = (axis * flat).sum(axis=-1, keepdims=True)
    return np.asarray(
        np.cos(angle) * flat + np.sin(angle) * np.cross(axis, flat) + (1.0 - np.cos(angle)) * along * axis
    )


def measure(frame: Frame, state: LinkageState) -> Mapping[str, SeriesValue]:
    """Return the true lengths and directions, within half a turn of the believed ones, and whether regions hold it."""
    target = frame.target
    if not isinstance(target, LinkageTarget):
        return {}
    absolute = np.cumsum(target.theta)
    near = absolute + 2.0 * np.pi * np.round((state.directions - absolute) / (2.0 * np.pi))
    values: dict[str, SeriesValue] = {}
    for link in range(LINKS):
        values[f"true_length_{link + 1}"] = float(target.r[link])
        values[f"true_direction_{link + 1}"] = float(np.rad2deg(near[link]))
    if len(target.position) != IN_SPACE:
        values["mirrored"] = float(_is_mirrored(state.directions, absolute))
        values["excess"] = _excess(state, near, target)
    excluded = is_missed(state, target)
    if excluded is not None:
        values["contained"] = float(not excluded)
    return values


def is_missed(state: LinkageState, target: Target) -> bool | None:
    """Return whether regions exclude the truth; None for other beliefs, whose estimate says where they are.

    The middle of all that is possible may be far from the truth: regions hold no point to be the likeliest.
    """
    if isinstance(state.belief, Beam) and all(isinstance(member, Region) for member in state.belief.members):
        return not contains(state, in_radians(target.position))
    return None


def _is_mirrored(believed: Floats, true: Floats) -> bool:
    """Return whether a link is believed to point where its mirror image does, which the camera cannot tell from it.

    Args:
        believed: (3,) directions from the line of sight's plane, rad.
        true: (3,) the true ones.
    """
    off, off_mirror = np.abs(wrap(believed - true)), np.abs(wrap(believed + true))
    return bool(((off_mirror < off) & (off > CLEARLY_RAD)).any())


def _excess(state: LinkageState, directions: Floats, target: LinkageTarget) -> float:
    """Return the largest error of a length or direction over its deviation; a range is two to either side."""
    lows, highs = state.low[-LINKS:], state.high[-LINKS:]
    errors = np.concatenate([np.abs(target.r - (lows + highs) / 2.0), np.abs(state.directions - directions)])
    deviations = np.concatenate([(highs - lows) / 4.0, state.directions_sd])
    known = deviations > 0.0
    return float((errors[known] / deviations[known]).max()) if known.any() else math.nan


def report(rows: Sequence[Diagnostics]) -> Mapping[str, Any]:
    """Return the lengths' final intervals, the worst direction, and how often the truth was contained, where known."""
    last = rows[-1]
    intervals = [last.vector(f"length_{link}") for link in range(1, LINKS + 1)]
    found: dict[str, Any] = {"intervals_px": [list(one) for one in intervals if one is not None]}
    errors = [row.error for row in rows if row.error is not None and math.isfinite(row.error)]
    if errors:
        found["max_angle_error_rad"] = math.radians(max(errors))
    contained = [row.number("contained") for row in rows if math.isfinite(row.number("contained"))]
    if contained:
        found["contained_share"] = sum(contained) / len(contained)
    return found


LAST_FRAMES = 6
"""Over which Shimada's success of a crossing is judged."""


def _last_errors(course: EvaluatedRun) -> Floats:
    known = np.flatnonzero(~np.isnan(course.errors))
    errors = np.full(len(course.errors), np.nan)
    errors[known[-LAST_FRAMES:]] = course.errors[known[-LAST_FRAMES:]]
    return errors


HELD_AT_END = held_at_end(LAST_FRAMES)
"""Whether a chain came through: in between a wrong hypothesis may be ahead."""

MEASURES = (
    HELD_AT_END,
    Measure(
        "median_direction_error_deg",
        "Median error of the directions",
        "Median over the labelled frames of the greatest error of a link's direction.",
        "median",
        lambda course: course.errors,
        unit="°",
        better="lower",
    ),
    Measure(
        "final_direction_error_deg",
        f"Median error of the last {LAST_FRAMES} frames",
        f"Median over the last {LAST_FRAMES} labelled frames of the greatest error of a link's direction.",
        "median",
        _last_errors,
        unit="°",
        better="lower",
    ),
)
