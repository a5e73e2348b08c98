"""A chain of three links, whose lengths and pose one camera is to tell (Shimada 1997).

Depth is not seen, so that a link may point away from the camera or towards it, and a long link that is turned away
looks like a short one. What joints and lengths may be makes it tractable. Kalman filters cut their Gaussian by these
bounds, several of them together follow both sides of an ambiguity; set membership keeps regions of all that is
possible.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import Drawing, Picture, Primitive
from pftrack.core.model.measures import EvaluatedRun, Measure
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.core.numerics.elementary import wrap
from pftrack.experiments.declared import read_quality, read_words
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.linkage.draw import (
    depth_world,
    draw_belief,
    draw_measurements,
    lengths_world,
    second_run,
    truth,
)
from pftrack.experiments.linkage.model import LINKS
from pftrack.experiments.linkage.parameters import SimulatedLinkageParameters
from pftrack.experiments.linkage.recording import (
    HELD_AT_END,
    LAST_FRAMES,
    WANTED,
    LinkagePoints,
    RecordedLinkageParameters,
    wire,
)
from pftrack.experiments.linkage.scene import NAMES, LinkageSource, LinkageTarget, LinkMeasurements, in_radians
from pftrack.experiments.linkage.state import LinkageState
from pftrack.experiments.linkage.trackers import TRACKERS, Region, contains
from pftrack.experiments.shared.sketch import caption, error_words
from pftrack.experiments.video import PICTURES, Video
from pftrack.filters.beam import Beam

IN_SPACE = 11
"""Numbers of an estimate in space: omega, t, theta and r."""
CLEARLY_RAD = np.deg2rad(20)
"""So far from the truth a direction must be for its mirror image to be another one."""


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


def _last_errors(course: EvaluatedRun) -> Floats:
    known = np.flatnonzero(~np.isnan(course.errors))
    errors = np.full(len(course.errors), np.nan)
    errors[known[-LAST_FRAMES:]] = course.errors[known[-LAST_FRAMES:]]
    return errors


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


FOLDER = Path(__file__).parent


def simulate() -> Setup:
    """Wire the simulated chain."""
    return Setup(LinkageSource, SimulatedLinkageParameters(), success=HELD_AT_END.name)


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: the chain in the picture, in depth, and what is known of its lengths."""
    del past
    frame, state, parameters = step.frame, step.state, step.parameters
    height, width, _ = frame.picture.shape
    longest = float(max(width, height))
    primitives: dict[str, Primitive] = {"picture": Picture(frame.picture), **draw_measurements(frame, state)}
    if isinstance(frame.target, LinkageTarget):
        primitives |= truth(frame.target, state, longest)
    second = None
    if other is not None and len(other.estimate) == len(state.mean):
        second = in_radians(np.array(other.estimate))
    if second is not None:
        primitives |= second_run(second, state, longest)
    primitives |= draw_belief(state, parameters.shown_hypothesis, longest)
    worlds = (
        depth_world(state, frame.target, parameters, second),
        lengths_world(state, frame.target, parameters, second),
    )
    return Drawing(width, height, primitives, _caption(step), worlds)


def _caption(step: Step) -> str:
    row, events = step.diagnostics, step.state.events
    parts = [step.tracker_title]
    count = row.number("hypothesis_count")
    if count > 1:
        parts.append(f"{count:g} hypotheses")
    parts += [word for word, times in (("split", events.splits), ("refuted", events.refuted)) if times]
    if events.outlier:
        parts.append("observation left out")
    if row.number("contained") == 0:
        parts.append("truth excluded")
    unseen = _unseen(step.frame)
    if unseen:
        parts.append(f"not seen: {', '.join(unseen)}")
    return caption(row, *parts, error_words(row, "°"))


def _unseen(frame: Frame) -> list[str]:
    """Return the names of the points that were not measured; of links seen as lines, which of these were not."""
    if frame.measurements is None:
        return list(NAMES)
    if isinstance(frame.measurements, LinkMeasurements):
        missing = np.flatnonzero(np.isnan(frame.measurements.offsets_px)).tolist()
        return [f"link {link + 1}" for link in missing]
    known = np.asarray(np.isfinite(frame.measurements.points_px).all(axis=1))
    return [name for name, seen in zip(NAMES[-len(known) :], known.tolist(), strict=True) if not seen]


EXPERIMENT = Experiment(
    **read_words(FOLDER, TRACKERS),
    id="linkage",
    quality=read_quality(FOLDER, TRACKERS),
    warm_frames=3,
    simulate=simulate,
    video=Video(
        wire,
        footage=(*PICTURES, "tracks"),
        recorded=lambda _kind: RecordedLinkageParameters(),
        marks=(LinkagePoints,),
        wanted=WANTED,
        unmarked=("tracks",),
        advice="Start at a picture in which all four points are seen, and no link points at the camera.",
        truth=None,
        clip_title="Chain of links",
    ),
    draw=draw,
    error=direction_error,
    lost=lambda errors, _sizes, parameters: errors > parameters.lost_deg,
    missed=is_missed,
    measure=measure,
    measures=MEASURES,
    report=report,
)
