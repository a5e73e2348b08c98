"""Trajectories of feature points under noise with heavy tails (Ichimura and Ikoma).

A corner that is followed by block matching sometimes jumps to a similar place. A filter for Gaussian noise follows the
jump; one for Cauchy noise ignores it; a third estimates the scales of noise and motion. Corners are followed through a
simulated sequence or any recording; or tracks are simulated, or come from a table that another program has written.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import Drawing, Picture, Primitive
from pftrack.core.model.parameters import parameter, revise
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, FrameSequence, Source, Truth
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.experiments.declared import read_words
from pftrack.experiments.experiment import PICTURES, Experiment, Judge, Measured, Video
from pftrack.experiments.shared.sketch import (
    caption,
    distance,
    error_words,
    paper,
    past_frames,
)
from pftrack.experiments.trajectories import draw as sketch
from pftrack.experiments.trajectories.corners import CornerParameters, begin
from pftrack.experiments.trajectories.draw import (
    EXPORTS,
    TemplateSearch,
    empty_search_world,
    in_picture,
    scales_world,
    search_world,
    true_positions,
)
from pftrack.experiments.trajectories.model import TrajectoriesState, TrajectoriesTrackerParameters
from pftrack.experiments.trajectories.scene import (
    CornerSceneParameters,
    CornerSource,
    RecordedPictures,
    TracksSceneParameters,
    TracksSource,
    tracks_from,
)
from pftrack.experiments.trajectories.trackers import MODEL, TRACKERS
from pftrack.sources.tracks import TrackSequence

FOLDER = Path(__file__).parent


class RecordedTrajectoriesParameters(TrajectoriesTrackerParameters, CornerParameters):
    """A recording: how its corners are followed, and their filters."""


class SimulatedTrajectoriesParameters(
    TrajectoriesTrackerParameters, CornerParameters, CornerSceneParameters, TracksSceneParameters, group="Scene"
):
    """The simulated sequence or the simulated tracks, and their filters."""

    trajectories_scene: Literal["lattice", "tracks"] = parameter("lattice", "Scene", live=False)
    """Pictures of a wall, a book and a box, whose corners are followed; or nothing but tracks."""


def simulate() -> Setup:
    """Wire the simulated sequence, or the simulated tracks, with Ichimura and Ikoma's values."""

    def open_source(seed: int, parameters: SimulatedTrajectoriesParameters) -> Source[Any]:
        if parameters.trajectories_scene == "tracks":
            return TracksSource(seed, parameters)
        return CornerSource(seed, parameters)

    return Setup(open_source, SimulatedTrajectoriesParameters())


def wire(sequence: FrameSequence, _mark: None, start: int, _truth: Truth | None) -> Setup:
    """Wire a recording, whose corners are followed, or a table of tracks; nothing needs to be marked.

    Raises:
        ValueError: The picture `start` has no corner.
    """
    if isinstance(sequence, TrackSequence):
        tracks = tracks_from(sequence, start)
        return Setup(lambda _seed, _parameters: tracks, TrajectoriesTrackerParameters())
    # Filmed objects are hidden, leave and turn: a match that differs much is dropped, and a lost corner is replaced.
    values = {"corner_count": 100, "largest_cost": 20, "new_corners": True}
    pictures, parameters = RecordedPictures(sequence, start), revise(RecordedTrajectoriesParameters(), values)

    def open_source(_seed: int, parameters: RecordedTrajectoriesParameters) -> RecordedPictures:
        if not len(begin(sequence.picture(start), parameters)[1]):
            width, height = sequence.size
            raise ValueError(
                f"picture {start}, {width} x {height} px, has no corner that can be followed; start at another one, or "
                f"allow corners of less than {parameters.corner_quality:g} of the greatest strength, or nearer to the "
                f"edge than {parameters.corner_margin_px} px"
            )
        return pictures

    open_source(0, parameters)
    return Setup(open_source, parameters)


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: the picture, the last frames of all tracks, the truth, and the selected one with its particles."""
    del past
    frame, state = step.frame, step.state
    image = paper(*state.paper) if frame.image_rgb is None else frame.image_rgb
    height, width, _ = image.shape
    longest = float(max(width, height))
    primitives: dict[str, Primitive] = {"picture": Picture(image)}
    primitives |= sketch.true_trails(state, frame.target, frame.index, longest)
    primitives |= sketch.trails(state, longest)
    primitives |= past_frames((width, height), "paths through time")
    if other is not None:
        primitives |= sketch.second_estimate(other.estimate, longest)
    primitives |= sketch.draw_selected(state, longest)
    searched, scales = empty_search_world(), scales_world(state, step.parameters)
    if state.corners is not None and frame.image_rgb is not None:
        sought = TemplateSearch.of(state.corners, image, state.selected, step.parameters)
        primitives |= in_picture(sought)
        searched = search_world(sought)
    return Drawing(width, height, primitives, _caption(step), (searched, scales))


def _caption(step: Step) -> str:
    row = step.diagnostics
    count = row.number("tracks")
    parts = [step.tracker_title, f"{count:g} {'track' if count == 1.0 else 'tracks'}"]
    outliers = row.number("outlier_share")
    if outliers > 0:
        parts.append(f"{100 * outliers:.0f} % outliers")
    if error := error_words(row, " px"):
        parts.append(f"track {step.state.selected}: {error}")
    return caption(row, *parts)


# Errors and apparent motion of tracks, for one frame and for a whole run.


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
    """Return the apparent distances of tracks from their start, for tracks at rest if pictures show them."""
    corners = state.corners
    resting = np.ones(len(state.first), np.bool_) if corners is None else corners.resting
    moved = {
        "raw_motion_px": _rms((state.raw[0] - state.first)[resting]),
        "false_motion_px": _rms((state.smoothed[state.reach] - state.first)[resting]),
    }
    values: dict[str, SeriesValue] = {name: value for name, value in moved.items() if math.isfinite(value)}
    return values if corners is None else values | {"resting": float(resting.sum())}


def _rms(off: Floats) -> float:
    """Return the root mean square length of vectors (K, 2), of those that are known."""
    squares = np.square(off).sum(axis=1)
    known = squares[np.isfinite(squares)]
    return float(np.sqrt(known.mean())) if len(known) else math.nan


def _far(off: Floats, limit_px: float) -> float:
    """Return the share of vectors (K, 2) that are longer than a limit, of those that are known."""
    lengths = np.hypot(off[:, 0], off[:, 1])
    known = lengths[np.isfinite(lengths)]
    return float((known > limit_px).mean()) if len(known) else math.nan


def report(rows: Sequence[Diagnostics]) -> Mapping[str, Any]:
    """Return the number of tracks, their apparent motion, and their errors where the truth is known.

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


EXPERIMENT = Experiment(
    **read_words(FOLDER, TRACKERS, measured=Measured(measure=measure, report=report)),
    id="trajectories",
    model=MODEL,
    simulate=simulate,
    video=Video(
        wire,
        footage=(*PICTURES, "tracks"),
        recorded=lambda kind: TrajectoriesTrackerParameters() if kind == "tracks" else RecordedTrajectoriesParameters(),
        wanted="left out: all corners, or all tracks of a table, are followed",
        advice="Corners are found in the picture to start at; nothing needs to be marked.",
        truth=None,
    ),
    draw=draw,
    judge=Judge(distance, "px", lambda errors, _sizes, parameters: errors > parameters.lost_px),
    exports=EXPORTS,
)
