"""What is drawn of recorded beliefs: in the picture, or on paper in the plane of two chosen components."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.belief import Belief, Plane
from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.drawing import COLOURS, Colour, Drawing, Links, Picture, Polyline, Primitive, Text
from pftrack.core.model.layer import Key, Layer
from pftrack.core.model.palette import OKABE_ITO
from pftrack.experiments.experiment import Step
from pftrack.experiments.shared.beliefs import BeliefState, place_of
from pftrack.experiments.shared.sketch import SECOND_RUN, at_height, circle, error_words, particle_clouds, uncertainty

__all__ = ["LAYERS", "draw"]

TRAIL_FRAMES = 60
FRAME_HEIGHT_PX = 3.0
"""How far one frame of the past is lifted in the space-time view."""
MOST_OTHERS = 200
"""Other targets that are drawn."""
MOST_PATHS = 200
"""Particles whose paths are drawn."""
MOST_NAMED = 40
"""Up to so many have their number beside them."""

HUES = [OKABE_ITO[name] for name in ("orange", "sky blue", "bluish green", "yellow", "reddish purple", "vermillion")]

LAYERS = (
    Layer("picture"),
    Layer("particles by sampler", "Particles", legend=(Key("prediction", "particles"),)),
    Layer("particles by weight", shown=False),
    Layer("estimate", legend=(Key("estimate", "selected target"), Key("hidden", "nothing said in this frame"))),
    Layer("others", "Other targets"),
    Layer("truth", legend=(Key("truth", "truth"),)),
    Layer("uncertainty"),
    Layer("particle paths", "Paths of the particles", shown=False),
    Layer("trail", role="flat only"),
    Layer("path through time", shown=False, role="through time"),
    Layer("components", "Names of components"),
    SECOND_RUN,
)


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: picture or paper, all targets, the truth, the particles of the selected one and its path."""
    state: BeliefState = step.state
    row, beliefs = step.diagnostics, state.beliefs
    plane = beliefs.plane
    image = step.frame.image_rgb if step.frame.image_rgb is not None else _paper(*plane.size)
    height, width, _ = image.shape
    dot = max(width, height) / 160
    primitives: dict[str, Primitive] = {"picture": Picture(image)}
    if step.frame.image_rgb is None and beliefs.selected.box is None:
        primitives |= _names(state)
    for one in beliefs.others[:MOST_OTHERS]:
        primitives |= _target(one, state, _hue(one.target), dot, "others", named=len(beliefs.others) <= MOST_NAMED)
    if state.particles is not None:
        states = state.particles.states[:, list(beliefs.components)]
        shown = _finite(_on(plane, states))
        primitives |= particle_clouds(shown, state.particles, 0, dot)
    if state.paths is not None and len(state.paths.paths) > 1:
        primitives["paths"] = _paths(plane, state.paths.paths)
    if state.covariance is not None and np.isfinite(state.covariance).all() and len(state.estimate) > 1:
        scale = np.array(plane.scale)
        spread = state.covariance * scale[:, None] * scale
        middle = _on(plane, state.estimate[None])[0]
        primitives["covariance"] = uncertainty(_finite(middle), spread, COLOURS["estimate"], "uncertainty")
    primitives |= _truths(step, dot)
    if other is not None and len(other.estimate) == len(state.estimate):
        there = _finite(_on(plane, np.array(other.estimate)[None])[0])
        primitives["second"] = circle(there, 1.5 * dot, COLOURS["second"], "second run")
    colour = COLOURS["estimate" if beliefs.present else "hidden"]
    primitives |= _target(beliefs.selected, state, colour, dot, "estimate", named=bool(beliefs.others))
    path = past[max(row.frame - TRAIL_FRAMES, 0) : row.frame + 1]
    places = _finite(_on(plane, np.array([each.estimate for each in path])))
    primitives["trail"] = Polyline(at_height(places, 1.0), COLOURS["estimate"], 2.0, "trail")
    heights = FRAME_HEIGHT_PX * (row.frame - np.array([each.frame for each in path]))
    primitives["space-time"] = Polyline(at_height(places, 1.0 + heights), COLOURS["estimate"], 3.0, "path through time")
    return Drawing(width, height, primitives, _caption(step))


def _paths(plane: Plane, paths: NDArray[np.float64]) -> Links:
    """Draw where the ancestors of some of the particles were, (ages, N, tracked)."""
    ages, count, tracked = paths.shape
    chosen = paths[:, np.linspace(0, count - 1, min(count, MOST_PATHS)).astype(np.int64)]
    places = at_height(_finite(_on(plane, chosen.reshape(-1, tracked))), 0.8).reshape(ages, -1, 3)
    segments = np.stack([places[:-1], places[1:]], axis=2).reshape(-1, 2, 3)
    return Links(segments, COLOURS["prediction"], 1.0, "particle paths")


def _caption(step: Step) -> str:
    row, beliefs = step.diagnostics, step.state.beliefs
    parts = [f"frame {row.frame}"]
    if beliefs.others:
        parts += [f"target {beliefs.selected.target}", f"{row.number('targets'):g} targets"]
    if not beliefs.present:
        parts.append("nothing said in this frame")
    overlap = row.number("overlap")
    if np.isfinite(overlap):
        parts.append(f"overlap {overlap:.2f}")
    if beliefs.switches:
        parts.append("a number changes")
    return " · ".join(filter(None, [*parts, error_words(row, "")]))


def _target(
    belief: Belief, state: BeliefState, colour: Colour, dot: float, layer: str, *, named: bool
) -> dict[str, Primitive]:
    """Draw a box, or where there is none a circle, with the target's number."""
    name = f"{layer} {belief.target}" if layer != "estimate" else "estimate"
    if belief.box is not None:
        outline = _box(belief.box, colour, layer, 2.0)
        corner = belief.box[:2]
    else:
        corner = _finite(_on(state.beliefs.plane, place_of(belief, state.beliefs.components)[None])[0])
        return {name: circle(corner, dot, colour, layer, height=2.0)} | (
            _label(name, belief.target, corner, colour, layer) if named else {}
        )
    return {name: outline} | (_label(name, belief.target, corner, colour, layer) if named else {})


def _label(name: str, target: int, corner: NDArray[np.float64], colour: Colour, layer: str) -> dict[str, Primitive]:
    return {f"{name} number": Text(at_height(corner[None], 2.0)[0], str(target), colour, layer)}


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
        width, height = target.extent
        corner = target.position[:2] - ((width - 1.0) / 2.0, (height - 1.0) / 2.0)
        drawn["truth"] = _box(np.array([*corner.tolist(), width, height]), COLOURS["truth"], "truth", 1.0)
    return drawn | {"true place": circle(place, 0.6 * dot, COLOURS["truth"], "truth")}


def _names(state: BeliefState) -> dict[str, Primitive]:
    """Write beside the paper's edges which components are across and upwards, and what the edges are."""
    beliefs, plane = state.beliefs, state.beliefs.plane
    width, height = plane.size
    drawn: dict[str, Primitive] = {}
    places = ((width / 2, height - 12.0), (12.0, height / 2))
    for axis, (component, place) in enumerate(zip(beliefs.components, places, strict=False)):
        name = beliefs.names[component] if component < len(beliefs.names) else f"component {component}"
        side, scale, shift = plane.size[axis], plane.scale[axis], plane.shift[axis]
        ends = sorted(((0.0 - shift) / scale, (side - shift) / scale)) if scale else (0.0, 0.0)
        words = f"{name}, {ends[0]:.3g} to {ends[1]:.3g}"
        position = at_height(np.array([place]), 0.0)[0]
        drawn[f"name {axis}"] = Text(position, words, COLOURS["hidden"], "components", "start" if axis else "middle")
    return drawn


def _box(box: NDArray[np.float64], colour: Colour, layer: str, height: float) -> Polyline:
    x, y, w, h = (box - (0.5, 0.5, 0.0, 0.0)).tolist()
    corners = np.array(((x, y), (x + w, y), (x + w, y + h), (x, y + h), (x, y)))
    return Polyline(at_height(corners, height), colour, 2.0, layer)


def _on(plane: Plane, states: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return places (n, 2) of chosen components (n, 1) or (n, 2), px."""
    both = states if states.shape[1] > 1 else np.hstack([states, np.zeros_like(states)])
    return both[:, :2] * plane.scale + plane.shift


def _finite(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return places that can be drawn: what is not finite, or absurdly far, lies outside the picture's corner."""
    return np.clip(np.nan_to_num(places, nan=-1e5, posinf=1e5, neginf=-1e5), -1e5, 1e5)


def _hue(target: int) -> Colour:
    return HUES[target % len(HUES)]


@lru_cache(maxsize=4)
def _paper(width: int, height: int) -> NDArray[np.uint8]:
    white = np.full((height, width, 3), 255, dtype=np.uint8)
    white.flags.writeable = False
    return white
