"""The hand in space: its sixteen parts and its joints in palm axes, the other hands as ghosts, and the true one.

The silhouette says nothing of depth, so hands that look alike from the front may differ much from aside. The forearm
points downwards however the hand is turned in the picture, and the camera is in front.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import COLOURS, Links, Mesh, Points, Primitive, WorldDrawing
from pftrack.core.model.world import Viewpoint, World
from pftrack.experiments.hand.scene import HandTarget
from pftrack.experiments.hand.shape import HandShape, joints, palm_axes
from pftrack.experiments.hand.sketch import hand_colour
from pftrack.experiments.hand.solids import capsules, plate
from pftrack.experiments.hand.trackers.state import HandState

__all__ = ["HAND_WORLD", "hand_world"]

HAND_WORLD = World(
    "hand",
    "Hand in space",
    "palm axes",
    1.75,
    middle=(0.0, 0.95, 0.0),
    viewpoints=(
        Viewpoint("3-d", "3-D", 40.0, 20.0),
        Viewpoint("front", "Front", 0.0, 0.0),
        Viewpoint("side", "Side", 90.0, 0.0),
        Viewpoint("tips", "Tips", 0.0, 90.0),
    ),
)

FOREARM = 0.6
"""How much of it is shown, palm axes."""
BONE = 0.03
"""Half the width of a ghost's bones, palm axes."""
FAINTEST = 0.12


def hand_world(state: HandState, shown: int, target: object) -> WorldDrawing:
    """Draw one of the kept hands with its joints, the others as bones, and the true one where it is known.

    Args:
        state: What is believed.
        shown: Which hand is drawn whole.
        target: What is known of the truth.
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
        chain = np.concatenate([np.zeros((5, 1, 3)), true], axis=1)
        ends = np.stack([chain[:, :-1], chain[:, 1:]], axis=2).reshape(-1, 2, 3)
        drawn["true fingers"] = Links(ends.astype(np.float32), COLOURS["truth"], 2.0, "truth")
    return WorldDrawing(HAND_WORLD, drawn)


def _upright(angle: float) -> NDArray[np.float64]:
    """Return the matrix (3, 3) that turns rows up, and a hand that is turned by an angle in the picture upright."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine, 0.0], [-sine, -cosine, 0.0], [0.0, 0.0, 1.0]])


def _place(
    pose: NDArray[np.float64], scale: float, shape: HandShape, upright: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the joints and tips (5, 4, 3) of a pose from its wrist, palm axes."""
    places = joints(pose, scale, shape)
    places[:, :, :2] -= pose[:2]
    return np.asarray((places / scale) @ upright.T)


def _palm(pose: NDArray[np.float64], state: HandState, upright: NDArray[np.float64]) -> Mesh:
    shape = state.shape
    turn = upright @ palm_axes(pose, state.scale, shape.side) / state.scale
    count = len(shape.outline)
    near, far = (
        np.column_stack([shape.outline, np.full(count, z)]) @ turn.T for z in (shape.thickness, -shape.thickness)
    )
    vertices, faces = plate(near[::-1], far[::-1]) if shape.side > 0.0 else plate(near, far)
    return Mesh(vertices, faces, hand_colour(state), 0.85, "hand")


def _fingers(places: NDArray[np.float64], state: HandState) -> Mesh:
    starts, ends = places[:, :-1].reshape(-1, 3), places[:, 1:].reshape(-1, 3)
    radii = np.stack([state.shape.radii[:, :-1], state.shape.radii[:, 1:]], axis=2).reshape(-1, 2)
    return Mesh(*capsules(starts, ends, radii), hand_colour(state), 0.85, "hand")


def _joints(places: NDArray[np.float64]) -> Points:
    every = places.reshape(-1, 3).astype(np.float32)
    colours = np.tile(np.array(COLOURS["paper"], np.uint8), (len(every), 1))
    return Points(every, colours, 0.05, "fingers")


def _ghosts(state: HandState, shown: int, upright: NDArray[np.float64]) -> dict[str, Primitive]:
    starts, ends, opacities = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros(0)]
    for place, weight in enumerate(state.beam.weights.tolist()):
        if place == shown:
            continue
        places = _place(state.beam.members[place], state.scale, state.shape, upright)
        offset = np.append(state.beam.members[place][:2] - state.beam.members[shown][:2], 0.0) / state.scale
        chain = np.concatenate([np.zeros((5, 1, 3)), places], axis=1) + offset @ upright.T
        starts.append(chain[:, :-1].reshape(-1, 3))
        ends.append(chain[:, 1:].reshape(-1, 3))
        opacities.append(np.full(20, FAINTEST + (1.0 - FAINTEST) * weight))
    firsts = np.concatenate(starts)
    vertices, faces = capsules(firsts, np.concatenate(ends), np.full((len(firsts), 2), BONE))
    each = len(vertices) // max(len(firsts), 1)
    shares = np.repeat(np.concatenate(opacities), each).astype(np.float32)
    return {"ghosts": Mesh(vertices, faces, COLOURS["prediction"], shares, "other hands")}


def _forearm(shape: HandShape) -> Links:
    half = shape.arm[0]
    corners = np.array([[-half, -FOREARM, 0.0], [-half, 0.0, 0.0], [half, 0.0, 0.0], [half, -FOREARM, 0.0]])
    return Links(np.stack([corners[:-1], corners[1:]], axis=1).astype(np.float32), COLOURS["hidden"], 2.0, "hand")
