"""What is drawn in the picture: silhouette and protrusions, the hand that is shown, the others, and the truth."""

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.polygons import fill
from pftrack.core.model.drawing import COLOURS, Colour, Links, Mesh, Points, Primitive
from pftrack.experiments.hand.detection.protrusions import HandFeatures
from pftrack.experiments.hand.scene import HandTarget
from pftrack.experiments.hand.shape import HandShape, joints, parts
from pftrack.experiments.hand.solids import ribbon
from pftrack.experiments.hand.trackers.state import HandState
from pftrack.experiments.shared.pose_sketch import draw_with_rim
from pftrack.experiments.shared.sketch import at_height

__all__ = ["bones", "draw_silhouette", "ghosts", "hand", "hand_colour", "outline", "second_run", "truth"]

LARGEST_DRAWN = 400.0
"""Longer side of the raster on which outlines are found, px: finer ones could not be seen."""
FAINTEST = 0.3
"""What is hardly probable at all is still seen."""


def draw_silhouette(features: HandFeatures) -> dict[str, Primitive]:
    """Draw the outline of the silhouette, the axes of its protrusions, their tips, and the wrist."""
    to_picture = features.silhouette.in_picture
    axes = [to_picture(each.axis) for each in features.protrusions]
    lines = np.concatenate([np.zeros((0, 2, 2)), *(np.stack([axis[:-1], axis[1:]], axis=1) for axis in axes)])
    ends = [axis[0] for axis in axes]
    if features.wrist is not None:
        ends.append(to_picture(features.wrist))
    around = _contours(features.silhouette.mask, features.silhouette.reduction)
    return {
        "silhouette": Links(_raise(around, 0.8), COLOURS["observation"], 1.5, "silhouette"),
        "protrusions": Links(_raise(lines, 1.0), COLOURS["second"], 2.0, "protrusions"),
        "protrusion ends": _dots(np.array(ends).reshape(-1, 2), COLOURS["second"], 6.0, "protrusions"),
    }


def hand(state: HandState, place: int, size: tuple[int, int]) -> dict[str, Primitive]:
    """Draw one of the kept hands: its outline, and its fingers as lines with their joints; grey while none is seen."""
    pose, colour = state.beam.members[place], hand_colour(state)
    around = outline(pose, state.scale, state.shape, size)
    return {
        "outline": Links(_raise(around, 2.0), colour, 2.0, "hand"),
        **draw_with_rim("fingers", bones(pose, state.scale, state.shape, colour, "fingers")),
    }


def hand_colour(state: HandState) -> Colour:
    """Return the colour of an estimate, or of what is only remembered while no hand is seen."""
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
        corners, triangles = ribbon(_raise(around, 1.5).astype(np.float64), width)
        vertices.append(corners)
        faces.append(triangles + np.int32(count))
        opacities.append(np.full(len(corners), FAINTEST + (1.0 - FAINTEST) * weight, np.float32))
        count += len(corners)
    together = np.concatenate(vertices), np.concatenate(faces)
    return {"ghosts": Mesh(*together, COLOURS["prediction"], np.concatenate(opacities), "other hands")}


def truth(target: HandTarget) -> dict[str, Primitive]:
    """Draw the fingers where they truly are, and their tips, with a light rim."""
    lines = bones(target.pose, target.scale, target.shape, COLOURS["truth"], "truth")
    return {
        **draw_with_rim("true fingers", lines),
        "true tips rim": _dots(target.tips, COLOURS["paper"], 8.0, "truth", 2.5),
        "true tips": _dots(target.tips, COLOURS["truth"], 6.0, "truth", 2.6),
    }


def second_run(estimate: tuple[float, ...], size: float) -> dict[str, Primitive]:
    """Draw a cross of a size, px, at each finger tip of a second run: all that a row knows of its hand."""
    tips = np.array(estimate).reshape(5, 1, 1, 3)[..., :2]
    arms = size * np.array([[[-1.0, -1.0], [1.0, 1.0]], [[-1.0, 1.0], [1.0, -1.0]]])
    return {"second": Links(_raise((tips + arms).reshape(-1, 2, 2), 2.4), COLOURS["second"], 2.0, "second run")}


def bones(pose: NDArray[np.float64], scale: float, shape: HandShape, colour: Colour, layer: str) -> Links:
    """Draw the fingers of a pose as lines from joint to joint, and the lines from the wrist to where they begin."""
    places = joints(pose, scale, shape)[:, :, :2]
    wrist = np.broadcast_to(pose[:2], (5, 1, 2))
    chain = np.concatenate([wrist, places], axis=1)
    ends = np.stack([chain[:, :-1], chain[:, 1:]], axis=2).reshape(-1, 2, 2)
    return Links(_raise(ends, 2.2), colour, 1.5, layer)


def outline(pose: NDArray[np.float64], scale: float, shape: HandShape, size: tuple[int, int]) -> NDArray[np.float64]:
    """Return the outline of a pose's silhouette as segments (n, 2, 2), px of a picture of this width and height."""
    step = max(1.0, max(size) / LARGEST_DRAWN)
    corners, counts = parts(pose, scale, shape)
    width, height = (int(np.ceil(length / step)) for length in size)
    return _contours(fill((corners + 0.5) / step - 0.5, counts, height, width), step)


def _contours(mask: NDArray[np.bool_], step: float) -> NDArray[np.float64]:
    """Return the outlines of a mask as segments (n, 2, 2), px; its pixels are `step` px wide."""
    found, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)
    rings = [ring.reshape(-1, 2).astype(np.float64) for ring in found if len(ring) > 1]
    lines = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings]
    together = np.concatenate(lines) if lines else np.zeros((0, 2, 2))
    return np.asarray(step * (together + 0.5) - 0.5)


def _raise(segments: NDArray[np.float64], height: float) -> NDArray[np.float32]:
    return at_height(segments.reshape(-1, 2), height).reshape(-1, 2, 3)


def _dots(places: NDArray[np.float64], colour: Colour, size: float, layer: str, height: float = 1.2) -> Points:
    return Points(at_height(places, height), np.tile(np.array(colour, np.uint8), (len(places), 1)), size, layer)
