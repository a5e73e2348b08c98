"""Results of other programs: a user's own loop, or the results of any tracker, as an ordinary run.

A recording of beliefs (`pftrack.record`) holds particles, means and covariances or boxes by frame, and perhaps a clip
and a truth. Its tracker returns the recorded beliefs. So everything that works on runs works on it: it can be watched
frame by frame, plotted, measured against a truth, compared with others frame by frame, and exported.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import COLOURS, OKABE_ITO, Colour, Drawing, Picture, Polyline, Primitive, Text
from pftrack.core.model.measures import MEAN_IOU, PICTURE_MEASURES
from pftrack.core.model.parameters import Parameters, parameter, revise
from pftrack.core.model.recipe import Footage
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Belief, Frame, FrameSequence, Plane, Target, Truth
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.core.refusal import ParameterError
from pftrack.experiments.declared import read_words
from pftrack.experiments.experiment import Experiment, Judge, Measured, Video
from pftrack.experiments.recorded.scene import (
    TRACKERS,
    UNITS,
    BeliefState,
    ExampleParameters,
    ExampleSource,
    RecordedBeliefs,
    overlap,
    place_of,
)
from pftrack.experiments.shared import sketch
from pftrack.experiments.shared.reports import loss_share
from pftrack.sources.beliefs.content import SelectionParameters
from pftrack.sources.beliefs.sequence import BeliefSequence
from pftrack.sources.results.table import Box

FOLDER = Path(__file__).parent


def measure_truth(frame: Frame, state: BeliefState) -> Mapping[str, SeriesValue]:
    """Measure the overlap with the true box, the true components, and where numbers change."""
    found: dict[str, SeriesValue] = {}
    target, box = frame.target, state.beliefs.selected.box
    if state.beliefs.truths:
        found["identity_switches"] = float(state.beliefs.switches)
    if target is None:
        return found
    found["true_across"] = float(target.position[0])
    if len(target.position) > 1:
        found["true_down"] = float(target.position[1])
    if target.extent is not None and box is not None:
        found["overlap"] = overlap(box, _true_box(target, target.extent))
    return found


def _true_box(target: Target, extent: tuple[float, float]) -> Floats:
    """Return the box (x, y, w, h) of a target of some width and height, px."""
    sides = np.array(extent)
    return np.concatenate([target.position[:2] - (sides - 1.0) / 2.0, sides])


def boxes_of(state: BeliefState) -> list[Box]:
    """Return the boxes of all targets of a frame."""
    beliefs = state.beliefs
    here = [beliefs.selected, *beliefs.others] if beliefs.present else beliefs.others
    boxes: list[Box] = []
    for one in sorted(here, key=lambda one: one.target):
        if one.box is not None:
            x, y, w, h = one.box.tolist()
            boxes.append(Box(0, one.target, x, y, w, h, one.score, one.label))
    return boxes


MOST_OTHERS = 200
"""Other targets that are drawn."""
MOST_NAMED = 40
"""Largest number of targets that show their numbers."""

HUES = [OKABE_ITO[name] for name in ("orange", "sky blue", "bluish green", "yellow", "reddish purple", "vermillion")]


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: picture or paper, all targets, the truth, the particles of the selected one and its path."""
    state: BeliefState = step.state
    row, beliefs = step.diagnostics, state.beliefs
    plane = beliefs.plane
    image = step.frame.image_rgb if step.frame.image_rgb is not None else sketch.paper(*plane.size)
    height, width, _ = image.shape
    dot = sketch.DOT * max(width, height)
    primitives: dict[str, Primitive] = {"picture": Picture(image)}
    if step.frame.image_rgb is None and beliefs.selected.box is None:
        primitives |= _names(state)
    for one in beliefs.others[:MOST_OTHERS]:
        primitives |= _target(one, state, _hue(one.target), dot, "others", named=len(beliefs.others) <= MOST_NAMED)
    if state.particles is not None:
        states = state.particles.states[:, list(beliefs.components)]
        shown = _finite(_on(plane, states))
        primitives |= sketch.particle_clouds(shown, state.particles, 0, dot)
    if state.covariance is not None and np.isfinite(state.covariance).all() and len(state.estimate) > 1:
        scale = np.array(plane.scale)
        spread = state.covariance * scale[:, None] * scale
        middle = _on(plane, state.estimate[None])[0]
        primitives["covariance"] = sketch.uncertainty(_finite(middle), spread, COLOURS["estimate"], "uncertainty")
    primitives |= _truths(step, dot)
    if other is not None and len(other.estimate) == len(state.estimate):
        there = _finite(_on(plane, np.array(other.estimate)[None])[0])
        primitives["second"] = sketch.circle(there, 1.5 * dot, COLOURS["second"], "second run")
    colour = COLOURS["estimate" if beliefs.present else "hidden"]
    primitives |= _target(beliefs.selected, state, colour, dot, "estimate", named=bool(beliefs.others))
    path = past[max(row.frame - sketch.PAST_FRAMES, 0) : row.frame + 1]
    places = _finite(_on(plane, np.array([each.estimate for each in path])))
    primitives |= sketch.paths(path, places, (width, height))
    return Drawing(width, height, primitives, _caption(step))


def _caption(step: Step) -> str:
    row, beliefs = step.diagnostics, step.state.beliefs
    parts = []
    if beliefs.others:
        parts += [f"target {beliefs.selected.target}", f"{row.number('targets'):g} targets"]
    if not beliefs.present:
        parts.append("no record in this frame")
    overlap = row.number("overlap")
    if np.isfinite(overlap):
        parts.append(f"overlap {overlap:.2f}")
    if beliefs.switches:
        parts.append("a number changes")
    return sketch.caption(row, *parts, sketch.error_words(row, ""))


def _target(
    belief: Belief, state: BeliefState, colour: Colour, dot: float, layer: str, *, named: bool
) -> dict[str, Primitive]:
    """Draw a box, or where there is none a circle, with the target's number."""
    name = f"{layer} {belief.target}" if layer != "estimate" else "estimate"
    drawn: dict[str, Primitive] = {}
    if belief.box is not None:
        corner = belief.box[:2]
        drawn[name] = _box(belief.box, colour, layer, 2.0)
    else:
        corner = _finite(_on(state.beliefs.plane, place_of(belief, state.beliefs.components)[None])[0])
        drawn[name] = sketch.circle(corner, dot, colour, layer, height=2.0)
    if named:
        drawn[f"{name} number"] = Text(sketch.at_height(corner, 2.0), belief.label or str(belief.target), colour, layer)
    return drawn


def _truths(step: Step, dot: float) -> dict[str, Primitive]:
    """Draw the truth of the selected target, and the boxes of all others."""
    state, target = step.state, step.frame.target
    drawn: dict[str, Primitive] = {}
    for one in state.beliefs.truths[:MOST_OTHERS]:
        if one.box is not None:
            drawn[f"truth {one.target}"] = _box(one.box, COLOURS["truth"], "truth", 1.0)
    if target is None:
        return drawn
    place = _finite(_on(state.beliefs.plane, target.position[None])[0])
    if target.extent is not None and not drawn:
        drawn["truth"] = _box(_true_box(target, target.extent), COLOURS["truth"], "truth", 1.0)
    return drawn | {"true place": sketch.circle(place, 0.6 * dot, COLOURS["truth"], "truth")}


def _names(state: BeliefState) -> dict[str, Primitive]:
    """Label the paper's edges with the components across and upwards, and with their values."""
    beliefs, plane = state.beliefs, state.beliefs.plane
    width, height = plane.size
    drawn: dict[str, Primitive] = {}
    places = ((width / 2, height - 12.0), (12.0, height / 2))
    for axis, (component, place) in enumerate(zip(beliefs.components, places, strict=False)):
        name = beliefs.names[component] if component < len(beliefs.names) else f"component {component}"
        side, scale, shift = plane.size[axis], plane.scale[axis], plane.shift[axis]
        ends = sorted(((0.0 - shift) / scale, (side - shift) / scale)) if scale else (0.0, 0.0)
        words = f"{name}, {ends[0]:.3g} to {ends[1]:.3g}"
        position = sketch.at_height(np.array(place))
        drawn[f"name {axis}"] = Text(position, words, COLOURS["hidden"], "components", "start" if axis else "middle")
    return drawn


def _box(box: Floats, colour: Colour, layer: str, height: float) -> Polyline:
    return sketch.rectangle(box[:2] - 0.5, box[2:], colour, layer, height)


def _on(plane: Plane, states: Floats) -> Floats:
    """Return places (n, 2) of chosen components (n, 1) or (n, 2), px."""
    both = states if states.shape[1] > 1 else np.hstack([states, np.zeros_like(states)])
    return both[:, :2] * plane.scale + plane.shift


def _finite(places: Floats) -> Floats:
    """Return places that can be drawn: what is not finite, or absurdly far, lies outside the picture's corner."""
    return np.clip(np.nan_to_num(places, nan=-1e5, posinf=1e5, neginf=-1e5), -1e5, 1e5)


def _hue(target: int) -> Colour:
    return HUES[target % len(HUES)]


SCORING = "Scoring"
MOST_DISTANCE = 100_000


class ScoringParameters(Parameters, group=SCORING):
    """When a target counts as lost."""

    lost_distance: float = parameter(0, "Lost from", within=(0, MOST_DISTANCE, 1))
    """Distance from the truth from which on the target counts as lost, in the unit of the states; 0 for outside its
    true box. Where truths have no box, the default is the root mean square distance of the true places from the middle
    of their path: the error of an estimate that stays there."""
    lost_share: float = loss_share(0.25)


class RecordedBeliefParameters(SelectionParameters, ScoringParameters):
    """The shown part of a recording."""

    @property
    def judged_by_box(self) -> bool:
        """Whether a place in the picture is held to the true box: where no distance is set."""
        return not self.lost_distance and (self.component_across, self.component_down) == (0, 1)


class ExampleBeliefParameters(ExampleParameters, RecordedBeliefParameters):
    """The synthetic example, and its shown part."""


def simulate() -> Setup:
    """Wire the example that is made up."""
    return Setup(ExampleSource, ExampleBeliefParameters(), units=lambda begun: _units(lambda each: UNITS[each], begun))


def wire(sequence: FrameSequence, _mark: None, start: int, truth: Truth | None) -> Setup:
    """Wire a recording of beliefs; nothing needs to be marked.

    Raises:
        ParameterError: It is a recording of something else.
    """
    if not isinstance(sequence, BeliefSequence):
        raise ParameterError("footage", sequence.index.kind, "a recording of beliefs")
    known = truth.at if truth else None

    def open_source(_seed: int, parameters: RecordedBeliefParameters) -> RecordedBeliefs:
        return RecordedBeliefs(sequence, parameters, start, known)

    def units(begun: RecordedBeliefParameters) -> dict[str, str]:
        units = _units(sequence.unit_of, begun)
        # States of one component have an estimate of one.
        return units | {"estimate": units["across"]} if sequence.content.dimension == 1 else units

    parameters = RecordedBeliefParameters()
    spread = open_source(0, parameters).true_spread()
    if spread < MOST_DISTANCE:
        parameters = revise(parameters, {"lost_distance": float(f"{spread:.3g}")})
    footage = Footage.of(sequence, None, start, truth).model_copy(update={"labelled": sequence.content.has_truth})
    return Setup(open_source, parameters, footage, units=units)


def _units(unit_of: Callable[[int], str], begun: SelectionParameters) -> dict[str, str]:
    """Return the units of the chosen components, and of the estimate where both have the same."""
    across, down = unit_of(begun.component_across), unit_of(begun.component_down)
    return {"across": across, "down": down, "estimate": across if across == down else ""}


def _distance(estimates: Floats, truths: Floats) -> Any:  # noqa: ANN401 - one or many
    return np.sqrt(np.square(estimates - truths).sum(axis=-1))


def _is_lost(errors: Any, sizes: Any, parameters: Any) -> Any:  # noqa: ANN401 - one or many, on either model
    beyond = np.where(np.asarray(sizes) > 0, np.asarray(sizes) / 2.0, np.inf)
    limit = parameters.lost_distance or beyond
    return np.asarray(errors) >= limit


EXPERIMENT = Experiment(
    **read_words(FOLDER, TRACKERS, measured=Measured(measure=measure_truth, measures=(*PICTURE_MEASURES, MEAN_IOU))),
    id="recorded",
    simulate=simulate,
    video=Video(
        wire,
        footage=("beliefs",),
        recorded=lambda _kind: RecordedBeliefParameters(),
        wanted="left out: the recording says where its targets are",
        advice="Nothing needs to be marked: the recording says where its targets are.",
        clip_about=("selected_target", "component_across", "component_down", "lost_distance"),
    ),
    boxes=boxes_of,
    draw=draw,
    judge=Judge(_distance, "", _is_lost),
)
