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
from pftrack.core.model.drawing import Drawing, Key, Layer, Picture, Primitive
from pftrack.core.model.glossary import Term, cite
from pftrack.core.model.plot import ERROR, INNOVATION, PARTICLES, SAMPLE_SIZE, STEP_TIME, Plot, Reading
from pftrack.core.model.preset import ExampleSweep, read_failures, read_presets
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame
from pftrack.experiments.experiment import Experiment, Quality
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
    CALIBRATION,
    HELD_AT_END,
    LOSS_DECLARATION,
    MEASURES,
    SERIES,
    direction_error,
    is_missed,
    measure,
    report,
)
from pftrack.experiments.linkage.recording import WANTED, LinkagePoints, RecordedLinkageParameters, wire
from pftrack.experiments.linkage.scene import NAMES, LinkageSource, LinkageTarget, LinkMeasurements, in_radians
from pftrack.experiments.linkage.shape import LINKS
from pftrack.experiments.linkage.trackers import TRACKERS
from pftrack.experiments.shared.sketch import SECOND_RUN, caption, error_words
from pftrack.experiments.video import PICTURES, Video

FRAMES = 300
"""At most; each path has its own length."""


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


def _length(link: int) -> Plot:
    return Plot(
        f"length-{link}",
        f"length of link {link}",
        "interval",
        "What is believed: two standard deviations, 95 % of particles or all that is not excluded; and the truth.",
        "px",
        (f"length_{link}",),
        truth=f"true_length_{link}",
    )


def _direction(link: int) -> Plot:
    return Plot(
        f"direction-{link}",
        f"direction of link {link}",
        "band",
        "The angle to the image, within two standard deviations; at 0 and 180 the link lies parallel to the image.",
        "°",
        (f"direction_{link}",),
        f"direction_{link}_sd",
        f"true_direction_{link}",
    )


PLOTS = (
    ERROR,
    _length(3),
    Plot(
        "tree",
        "tree of hypotheses",
        "tree",
        "Where hypotheses split and end, and the way back from the most probable one.",
        series=("hypotheses",),
        shown="shown_hypothesis",
    ),
    Plot(
        "contained",
        "truth contained",
        "frequency",
        "Share of the frames so far in which the truth is among what is held possible: 1 of regions as long as motion, "
        "errors and bounds are as said, and no other kind of tracker came before.",
        series=("contained",),
        levels=(1.0,),
        needs_truth=True,
    ),
    _direction(3),
    _length(2),
    _direction(2),
    _length(1),
    _direction(1),
    Plot(
        "count",
        "hypotheses",
        "value",
        "How many hypotheses there are: more after a split, fewer once some are refuted.",
        series=("hypothesis_count",),
    ),
    INNOVATION,
    SAMPLE_SIZE,
)

READINGS = (
    Reading("error", "error"),
    *(Reading(f"length {link}", "interval", "px", f"length_{link}") for link in range(1, LINKS + 1)),
    *(
        Reading(f"direction {link}", "value", "°", f"direction_{link}", f"direction_{link}_sd")
        for link in range(1, LINKS + 1)
    ),
    Reading("bounds cut", "value", series="cut"),
    PARTICLES,
    STEP_TIME,
)

TERMS = (
    Term(
        "length", "of a link of the chain, in the picture's unit; with one camera it shows only in the course of time"
    ),
    Term("direction", "where a link points, as an angle from the axis of the picture"),
    Term("bounds cut", "how much the known bounds have cut off from what is believed"),
    Term("mirror", "two poses of a link that one camera sees alike: towards it and away from it"),
)

EXPERIMENT = Experiment(
    id="linkage",
    title="Linkage seen by one camera",
    family="Poses of bodies",
    question="How much of a chain's lengths and depth can one camera tell, by what its joints can do?",
    references=(cite("shimada1997", "chapters 3 to 5"),),
    description=(
        "Three links move, and a camera that sees no depth measures where the joints are. A link that passes the pose "
        "parallel to the image may come out on either side of it. One Kalman filter has to guess; several keep both "
        "until a joint's limit refutes one; ellipsoids keep all that is possible, and never exclude the truth."
    ),
    unit="deg",
    trackers=TRACKERS,
    default_tracker="ekf-mirrors",
    warm_frames=3,
    frames=FRAMES,
    presets=read_presets(Path(__file__).with_name("presets.yaml")),
    failures=read_failures(Path(__file__).with_name("failures.yaml")),
    quality=Quality(CALIBRATION, LOSS_DECLARATION),
    layers=(
        Layer("picture"),
        Layer("measurements", legend=(Key("observation", "measured"),)),
        Layer("truth", legend=(Key("truth", "truth"),)),
        Layer("hypotheses", legend=(Key("prediction", "hypotheses, the darker the more probable"),)),
        Layer("particles", legend=(Key("prediction", "particles"),)),
        Layer("guide boxes", title="Ranges of directions and lengths"),
        Layer("ellipsoids"),
        Layer("estimate", legend=(Key("estimate", "estimate"),)),
        SECOND_RUN,
        Layer("axes"),
    ),
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
    target="linkage",
    plots=PLOTS,
    readings=READINGS,
    terms=TERMS,
    # How sure one must be of the points, and for how many hypotheses there must be room.
    example_sweep=ExampleSweep(
        {"measurement_noise_px": (0.5, 1, 1.5, 2, 3), "beam_width": (1, 2, 4, 8)},
        trackers=("ekf-mirrors",),
        trials=4,
        frames=91,
    ),
)
