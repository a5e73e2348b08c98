"""A chain of three links, whose lengths and pose one camera is to tell (Shimada 1997).

Depth is not seen, so that a link may point away from the camera or towards it, and a long link that is turned away
looks like a short one. What joints and lengths may be makes it tractable. Kalman filters cut their Gaussian by these
bounds, several of them together follow both sides of an ambiguity; set membership keeps regions of all that is
possible.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pftrack.core.model.diagnostics import Diagnostics, Step
from pftrack.core.model.drawing import Drawing, Picture, Primitive
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame
from pftrack.experiments.declared import read_quality, read_words
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.linkage.draw import (
    DEPTH_WORLD,
    LENGTHS_WORLD,
    depth_world,
    draw_belief,
    draw_measurements,
    lengths_world,
    second_run,
    truth,
)
from pftrack.experiments.linkage.parameters import SimulatedLinkageParameters
from pftrack.experiments.linkage.quality import (
    HELD_AT_END,
    MEASURES,
    SERIES,
    direction_error,
    is_missed,
    measure,
    report,
)
from pftrack.experiments.linkage.recording import WANTED, LinkagePoints, RecordedLinkageParameters, wire
from pftrack.experiments.linkage.scene import NAMES, LinkageSource, LinkageTarget, LinkMeasurements, in_radians
from pftrack.experiments.linkage.trackers import TRACKERS
from pftrack.experiments.shared.sketch import caption, error_words
from pftrack.experiments.video import PICTURES, Video

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


def _is_lost(errors: Any, _sizes: Any, parameters: Any) -> Any:  # noqa: ANN401 - one or many, on either model
    return errors > parameters.lost_deg


EXPERIMENT = Experiment(
    **read_words(FOLDER),
    id="linkage",
    trackers=TRACKERS,
    quality=read_quality(FOLDER, TRACKERS),
    warm_frames=3,
    worlds=(DEPTH_WORLD, LENGTHS_WORLD),
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
    lost=_is_lost,
    missed=is_missed,
    series=SERIES,
    measure=measure,
    measures=MEASURES,
    report=report,
)
