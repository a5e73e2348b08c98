"""A hand whose pose comes from its silhouette alone, by a beam of hypotheses (Shimada 1997, chapter 2).

Fingers disappear behind the palm within a frame or two, so nothing can be followed from picture to picture. Instead,
hands from a model are compared with the silhouette. Several are kept, since only later frames may show which one is
right.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.geometry import fill
from pftrack.core.model.drawing import (
    COLOURS,
    Colour,
    Drawing,
    Links,
    Mesh,
    Picture,
    Points,
    Primitive,
    WorldDrawing,
)
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.experiments.declared import read_words, read_worlds
from pftrack.experiments.experiment import Experiment, Judge, Measured, Video
from pftrack.experiments.hand import recording
from pftrack.experiments.hand.fingers import HandFeatures
from pftrack.experiments.hand.model import HandState, HandTrackerParameters
from pftrack.experiments.hand.recording import FINDER, HandTips, RecordedHandParameters, suits, wire
from pftrack.experiments.hand.scene import HandSceneParameters, HandSource, HandTarget
from pftrack.experiments.hand.shape import HandShape, joints, palm_axes, parts
from pftrack.experiments.hand.trackers import TRACKERS, features
from pftrack.experiments.shared.pose.drawing import draw_with_rim
from pftrack.experiments.shared.sketch import at_height, caption, dots, lines
from pftrack.vision.rendering import Projection

FOLDER = Path(__file__).parent

(HAND_WORLD,) = read_worlds(FOLDER)

LOST_PALMS = 0.65
"""Mean distance of the tips in space above which a hand counts as lost, palm axes."""


# Drawings of hands: silhouette, protrusions and hands in the picture, and the hand in space.
#
# In space the hand stands in palm axes with its sixteen parts and its joints, the other hands as ghosts, and the true
# one. The silhouette has no depth, so hands that look alike from the front may differ much from the side. The forearm
# points downwards however the hand is turned in the picture, and the camera is in front.

SIDES = 10
"""Sides of a capsule, around its axis."""

_QUARTER = np.deg2rad([90.0, 45.0, 0.0])
PROFILE = [(0.0, -np.sin(angle), np.cos(angle)) for angle in _QUARTER]
PROFILE += [(1.0, np.sin(angle), np.cos(angle)) for angle in _QUARTER[::-1]]
"""Rings from end to end: their end, their distance beyond it along the axis and from the axis, in radii."""


def capsules(starts: Floats, ends: Floats, radii: Floats) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return vertices (n, 3) and faces (m, 3) of capsules.

    Args:
        starts: (k, 3) centres of one end.
        ends: (k, 3) centres of the other.
        radii: (k, 2) at these ends.
    """
    axes = ends - starts
    lengths = np.maximum(np.sqrt(np.square(axes).sum(axis=1, keepdims=True)), 1e-9)
    along = axes / lengths
    # Any direction far from that of the axis gives two directions at right angles to the axis.
    helper = np.where(np.abs(along[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    across = np.cross(along, helper)
    across /= np.sqrt(np.square(across).sum(axis=1, keepdims=True))
    other = np.cross(along, across)
    angles = 2.0 * np.pi * np.arange(SIDES) / SIDES
    around = across[:, None] * np.cos(angles)[:, None] + other[:, None] * np.sin(angles)[:, None]
    rings = []
    for end, beyond, away in PROFILE:
        radius = radii[:, int(end)][:, None]
        centre = starts + end * axes + beyond * radius * along
        rings.append(centre[:, None] + away * radius[:, :, None] * around)
    vertices = np.stack(rings, axis=1).reshape(-1, 3)
    own = len(PROFILE) * SIDES
    faces = _rings() + own * np.arange(len(starts))[:, None, None]
    return vertices.astype(np.float32), faces.reshape(-1, 3).astype(np.int32)


def plate(near: Floats, far: Floats) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return vertices (2 n, 3) and faces of a plate between two outlines (n, 3), the near one seen clockwise."""
    count = len(near)
    fan = np.stack([np.zeros(count - 2, int), np.arange(1, count - 1), np.arange(2, count)], axis=1)
    here = np.arange(count)
    following = (here + 1) % count
    sides = [
        np.stack([here, here + count, following], axis=1),
        np.stack([following, here + count, following + count], axis=1),
    ]
    faces = np.concatenate([fan, fan[:, ::-1] + count, *sides])
    return np.concatenate([near, far]).astype(np.float32), faces.astype(np.int32)


def ribbon(segments: Floats, width: float) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return vertices (4 n, 3) and faces of flat strips along segments (n, 2, 3), a little longer than these.

    Args:
        segments: In planes of constant z.
        width: Width of a strip, in the unit of the segments.
    """
    start, end = segments[:, 0], segments[:, 1]
    along = end - start
    along /= np.maximum(np.sqrt(np.square(along).sum(axis=1, keepdims=True)), 1e-9)
    aside = 0.5 * width * np.stack([-along[:, 1], along[:, 0], np.zeros(len(along))], axis=1)
    ahead = 0.5 * width * along
    corners = np.stack([start - ahead - aside, end + ahead - aside, end + ahead + aside, start - ahead + aside], axis=1)
    faces = np.array([[0, 1, 2], [0, 2, 3]]) + 4 * np.arange(len(segments))[:, None, None]
    return corners.reshape(-1, 3).astype(np.float32), faces.reshape(-1, 3).astype(np.int32)


@lru_cache(maxsize=1)
def _rings() -> Ints:
    """Return the faces between the rings of one capsule."""
    faces = []
    for ring in range(len(PROFILE) - 1):
        for side in range(SIDES):
            a, b = ring * SIDES + side, ring * SIDES + (side + 1) % SIDES
            faces += [[a, a + SIDES, b], [b, a + SIDES, b + SIDES]]
    return np.array(faces)


LARGEST_DRAWN = 400.0
"""Longer side of the raster for outlines, px; finer ones would not be visible."""
FAINTEST = 0.3
"""Least opacity, so improbable hands stay visible."""


def draw_silhouette(features: HandFeatures) -> dict[str, Primitive]:
    """Draw the outline of the silhouette, the axes of its protrusions, their tips, and the wrist."""
    to_picture = features.silhouette.in_picture
    axes = [to_picture(each.axis) for each in features.protrusions]
    segments = np.concatenate([np.zeros((0, 2, 2)), *(np.stack([axis[:-1], axis[1:]], axis=1) for axis in axes)])
    ends = [axis[0] for axis in axes]
    if features.wrist is not None:
        ends.append(to_picture(features.wrist))
    around = _contours(features.silhouette.mask, features.silhouette.reduction)
    return {
        "silhouette": lines(around, COLOURS["observation"], 1.5, "silhouette", height=0.8),
        "protrusions": lines(segments, COLOURS["second"], 2.0, "protrusions", height=1.0),
        "protrusion ends": dots(np.array(ends).reshape(-1, 2), COLOURS["second"], 6.0, "protrusions", height=1.2),
    }


def hand(state: HandState, place: int, size: tuple[int, int]) -> dict[str, Primitive]:
    """Draw one of the kept hands: its outline, and its fingers as lines with their joints; grey while none is seen."""
    pose, colour = state.beam.members[place], hand_colour(state)
    around = outline(pose, state.scale, state.shape, size)
    return {
        "outline": lines(around, colour, 2.0, "hand", height=2.0),
        **draw_with_rim("fingers", bones(pose, state.scale, state.shape, colour, "fingers")),
    }


def hand_colour(state: HandState) -> Colour:
    """Return the colour of an estimate, or of a remembered pose while no hand is visible."""
    return COLOURS["hidden" if state.searching else "estimate"]


def ghosts(state: HandState, shown: int, size: tuple[int, int]) -> dict[str, Primitive]:
    """Draw the outlines of the other kept hands, the more opaque the more probable."""
    width = 0.03 * state.scale
    vertices, faces, opacities = [np.zeros((0, 3), np.float32)], [np.zeros((0, 3), np.int32)], [np.zeros(0, np.float32)]
    count = 0
    for place, weight in enumerate(state.beam.weights.tolist()):
        if place == shown:
            continue
        around = outline(state.beam.members[place], state.scale, state.shape, size)
        corners, triangles = ribbon(at_height(around, 1.5).astype(np.float64), width)
        vertices.append(corners)
        faces.append(triangles + np.int32(count))
        opacities.append(np.full(len(corners), FAINTEST + (1.0 - FAINTEST) * weight, np.float32))
        count += len(corners)
    together = np.concatenate(vertices), np.concatenate(faces)
    return {"ghosts": Mesh(*together, COLOURS["prediction"], np.concatenate(opacities), "other hands")}


def truth(target: HandTarget) -> dict[str, Primitive]:
    """Draw the fingers where they truly are, and their tips, with a light rim."""
    return {
        **draw_with_rim("true fingers", bones(target.pose, target.scale, target.shape, COLOURS["truth"], "truth")),
        "true tips rim": dots(target.tips, COLOURS["paper"], 8.0, "truth", height=2.5),
        "true tips": dots(target.tips, COLOURS["truth"], 6.0, "truth", height=2.6),
    }


def second_run(estimate: tuple[float, ...], size: float) -> dict[str, Primitive]:
    """Draw a cross of a size, px, at each finger tip of a second run; its row has only these."""
    tips = np.array(estimate).reshape(5, 1, 1, 3)[..., :2]
    arms = size * np.array([[[-1.0, -1.0], [1.0, 1.0]], [[-1.0, 1.0], [1.0, -1.0]]])
    return {"second": lines((tips + arms).reshape(-1, 2, 2), COLOURS["second"], 2.0, "second run", height=2.4)}


def bones(pose: Floats, scale: float, shape: HandShape, colour: Colour, layer: str) -> Links:
    """Draw the fingers of a pose as lines from joint to joint, and the lines from the wrist to where they begin."""
    return lines(_chains(joints(pose, scale, shape)[:, :, :2], pose[:2]), colour, 1.5, layer, height=2.2)


def _chains(places: Floats, wrist: Floats) -> Floats:
    """Return the segments (20, 2, d) from a wrist (d,) along the fingers, given their joints and tips (5, 4, d)."""
    chain = np.concatenate([np.broadcast_to(wrist, (5, 1, len(wrist))), places], axis=1)
    return np.stack([chain[:, :-1], chain[:, 1:]], axis=2).reshape(-1, 2, len(wrist))


def outline(pose: Floats, scale: float, shape: HandShape, size: tuple[int, int]) -> Floats:
    """Return the outline of a pose's silhouette as segments (n, 2, 2), px of a picture of this width and height."""
    step = max(1.0, max(size) / LARGEST_DRAWN)
    corners, counts = parts(pose, scale, shape)
    width, height = (int(np.ceil(length / step)) for length in size)
    return _contours(fill((corners + 0.5) / step - 0.5, counts, height, width), step)


def _contours(mask: Bools, step: float) -> Floats:
    """Return the outlines of a mask as segments (n, 2, 2), px; its pixels are `step` px wide."""
    found, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)
    rings = [ring.reshape(-1, 2).astype(np.float64) for ring in found if len(ring) > 1]
    lines = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings]
    together = np.concatenate(lines) if lines else np.zeros((0, 2, 2))
    return np.asarray(step * (together + 0.5) - 0.5)


FOREARM = 0.6
"""Shown length, palm axes."""
BONE = 0.03
"""Half the width of a ghost's bones, palm axes."""
FAINTEST_GHOST = 0.12


def hand_world(state: HandState, shown: int, target: object) -> WorldDrawing:
    """Draw one of the kept hands with its joints, the others as bones, and the true one where it is known.

    Args:
        state: The belief.
        shown: The hand that is drawn whole.
        target: The known truth.
    """
    pose = state.beam.members[shown]
    upright = _upright(float(pose[2]))
    places = _place(pose, state.scale, state.shape, upright)
    drawn: dict[str, Primitive] = {
        "forearm": _forearm(state.shape),
        **_ghosts(state, shown, upright),
        "palm": _palm(pose, state, upright),
        "fingers": _fingers(places, state),
        "joints": _joints(places),
    }
    if isinstance(target, HandTarget):
        true = _place(target.pose, target.scale, target.shape, upright)
        ends = _chains(true, np.zeros(3)).astype(np.float32)
        drawn["true fingers"] = Links(ends, COLOURS["truth"], 2.0, "truth")
    return WorldDrawing(HAND_WORLD, drawn)


IN_SPACE, HAND_AT = "hand in space", 1.2
"""A layer, and the wrist's height above the picture on it, palm axes; its camera is orthographic."""


def in_space(world: WorldDrawing, pose: Floats, scale: float) -> dict[str, Primitive]:
    """Draw the hand of a world before the picture, where it is seen."""
    place = np.array([pose[0], pose[1], HAND_AT * scale])
    before = Projection(_upright(float(pose[2])).T, np.zeros(3), scale, place)
    hand = {name: before.primitive(world.primitives[name]) for name in ("palm", "fingers")}
    return {f"{name} in space": replace(item, layer=IN_SPACE) for name, item in hand.items()}


def _upright(angle: float) -> Floats:
    """Return the matrix (3, 3) that turns rows up, and a hand that is turned by an angle in the picture upright."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine, 0.0], [-sine, -cosine, 0.0], [0.0, 0.0, 1.0]])


def _place(pose: Floats, scale: float, shape: HandShape, upright: Floats) -> Floats:
    """Return the joints and tips (5, 4, 3) of a pose from its wrist, palm axes."""
    places = joints(pose, scale, shape)
    places[:, :, :2] -= pose[:2]
    return np.asarray((places / scale) @ upright.T)


def _palm(pose: Floats, state: HandState, upright: Floats) -> Mesh:
    shape = state.shape
    turn = upright @ palm_axes(pose, state.scale, shape.side) / state.scale
    count = len(shape.outline)
    near, far = (
        np.column_stack([shape.outline, np.full(count, z)]) @ turn.T for z in (shape.thickness, -shape.thickness)
    )
    vertices, faces = plate(near[::-1], far[::-1]) if shape.side > 0.0 else plate(near, far)
    return Mesh(vertices, faces, hand_colour(state), 0.85, "hand")


def _fingers(places: Floats, state: HandState) -> Mesh:
    starts, ends = places[:, :-1].reshape(-1, 3), places[:, 1:].reshape(-1, 3)
    radii = np.stack([state.shape.radii[:, :-1], state.shape.radii[:, 1:]], axis=2).reshape(-1, 2)
    return Mesh(*capsules(starts, ends, radii), hand_colour(state), 0.85, "hand")


def _joints(places: Floats) -> Points:
    return dots(places.reshape(-1, 3), COLOURS["paper"], 0.05, "fingers")


def _ghosts(state: HandState, shown: int, upright: Floats) -> dict[str, Primitive]:
    bones, opacities = [np.zeros((0, 2, 3))], [np.zeros(0)]
    for place, weight in enumerate(state.beam.weights.tolist()):
        if place == shown:
            continue
        places = _place(state.beam.members[place], state.scale, state.shape, upright)
        offset = np.append(state.beam.members[place][:2] - state.beam.members[shown][:2], 0.0) / state.scale
        bones.append(_chains(places, np.zeros(3)) + offset @ upright.T)
        opacities.append(np.full(20, FAINTEST_GHOST + (1.0 - FAINTEST_GHOST) * weight))
    ends = np.concatenate(bones)
    vertices, faces = capsules(ends[:, 0], ends[:, 1], np.full((len(ends), 2), BONE))
    each = len(vertices) // max(len(ends), 1)
    shares = np.repeat(np.concatenate(opacities), each).astype(np.float32)
    return {"ghosts": Mesh(vertices, faces, COLOURS["prediction"], shares, "other hands")}


def _forearm(shape: HandShape) -> Links:
    half = shape.arm[0]
    corners = np.array([[-half, -FOREARM, 0.0], [-half, 0.0, 0.0], [half, 0.0, 0.0], [half, -FOREARM, 0.0]])
    return Links(np.stack([corners[:-1], corners[1:]], axis=1).astype(np.float32), COLOURS["hidden"], 2.0, "hand")


class SimulatedHandParameters(HandTrackerParameters, HandSceneParameters):
    """The simulated hand and its trackers."""


def simulate() -> Setup:
    """Wire the simulated hand."""
    return Setup(HandSource, SimulatedHandParameters())


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: the measurements, the chosen hand, the others as ghosts; and the hand in space."""
    del past
    image, state = step.frame.picture, step.state
    height, width, _ = image.shape
    shown = min(step.parameters.shown_hypothesis, len(state.beam)) - 1
    primitives: dict[str, Primitive] = {"picture": Picture(image)}
    primitives |= draw_silhouette(features(step.frame, step.parameters))
    primitives |= ghosts(state, shown, (width, height))
    primitives |= hand(state, shown, (width, height))
    if isinstance(step.frame.target, HandTarget):
        primitives |= truth(step.frame.target)
    if other is not None:
        primitives |= second_run(other.estimate, 0.1 * state.scale)
    space = hand_world(state, shown, step.frame.target)
    primitives |= in_space(space, state.beam.members[shown], state.scale)
    return Drawing(width, height, primitives, _caption(step, shown), (space,))


def measure(frame: Frame, state: HandState) -> Mapping[str, SeriesValue]:
    """Return the errors of a frame's hands, where the truth is known, and the frame's finding."""
    return {**recording.measure(frame, state), **recording.flags(state)}


def _caption(step: Step, shown: int) -> str:
    row, state = step.diagnostics, step.state
    parts = [step.tracker_title]
    count = len(state.beam)
    if state.searching:
        parts.append("waiting; grey: the hand seen last")
    elif count > 1:
        parts.append(f"hand {shown + 1} of {count}, {100 * state.beam.weights[shown]:.0f} %")
    if row.error is not None and isinstance(step.frame.target, HandTarget):
        tips, target = state.tips[shown], step.frame.target
        off = float(_distance(tips, target.position))
        parts.append(f"tips off by {off:.0f} px" + (", lost (by truth)" if _too_far(tips, target) else ""))
    return caption(row, *parts, recording.describe(state))


def _distance(estimates: Floats, truths: Floats) -> Any:  # noqa: ANN401 - one or many
    """Return the mean distance of the five tips (..., 15) in space, px."""
    off = (estimates - truths).reshape(*np.shape(estimates)[:-1], 5, 3)
    return np.sqrt(np.square(off).sum(axis=-1)).mean(axis=-1)


def is_missed(state: HandState, target: Target) -> bool:
    """Return whether the tips are too far from the true ones in space, for a hand of this size."""
    if not isinstance(target, HandTarget):
        return False
    return _too_far(state.estimate, target)


def _too_far(tips: Floats, target: HandTarget) -> bool:
    return not _distance(tips, target.position) <= LOST_PALMS * target.scale


EXPERIMENT = Experiment(
    **read_words(FOLDER, TRACKERS, measured=Measured(measure=measure, report=recording.report)),
    id="hand",
    simulate=simulate,
    draw=draw,
    judge=Judge(_distance, "px", missed=is_missed),
    video=Video(
        wire,
        recorded=lambda _kind: RecordedHandParameters(),
        marks=(HandTips,),
        wanted="the tips of the fingers",
        advice=(
            "Film the whole hand with all five fingers spread, the palm towards the camera and the arm leaving the "
            "picture on one side. A plain background works best, much darker or lighter than the skin or of another "
            "colour. Before a patterned one the camera has to stand still, and the hand to move or to come in later."
        ),
        finder=FINDER,
        suits=suits,
        truth=None,
    ),
    warm_frames=3,
)
