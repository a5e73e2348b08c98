"""Pieces of drawings of a solid that is tracked by its points."""

import numpy as np
from numpy.typing import NDArray

from pftrack.drawing import COLOURS, Axes, Colour, Links, Points, Primitive, Text
from pftrack.experiments.sketch import at_height, uncertainty
from pftrack.frame import Landmarks
from pftrack.geometry.rotation import rotation
from pftrack.trackers.pose_state import PoseState

__all__ = ["dashes", "feature_clouds", "feature_marks", "pose_axes", "true_marks"]

MOST_DRAWN = 5000
UPPER, LOWER = COLOURS["observation"], COLOURS["prediction"]
"""Particles from the solid's prediction, and from the feature's own past."""


def feature_clouds(state: PoseState, size: float) -> dict[str, Primitive]:
    """Draw the particles of all features, coloured by which prediction they came from, lifted by weight."""
    positions = state.positions
    features, count, _ = positions.shape
    stride = max(1, -(-features * count // MOST_DRAWN))
    chosen = np.arange(0, count, stride)
    log_weights = np.broadcast_to(state.log_weights, (features, count))[:, chosen]
    relative = np.exp(log_weights - log_weights.max(axis=1, keepdims=True))
    colours = np.where((chosen < state.upper_counts[:, None])[:, :, None], UPPER, LOWER).astype(np.uint8)
    raised = at_height(positions[:, chosen].reshape(-1, 2), 1.0 + 10.0 * relative.ravel())
    return {"particles": Points(raised, colours.reshape(-1, 3), size, "particles by prediction")}


def feature_marks(state: PoseState, names: tuple[str, ...], size: float) -> dict[str, Primitive]:
    """Draw each feature's uncertainty and name, vermilion while it is not recognised."""
    drawn: dict[str, Primitive] = {}
    marks = zip(names, state.feature_means, state.feature_covariances, state.recognised, strict=True)
    for name, mean, covariance, recognised in marks:
        colour = COLOURS["estimate"] if recognised else COLOURS["lost"]
        drawn[f"feature {name}"] = uncertainty(mean, covariance, colour, "features")
        place = at_height((mean + size)[None], 2.0)[0]
        drawn[f"name {name}"] = Text(place, name, colour, "names")
    return drawn


def true_marks(landmarks: Landmarks, size: float) -> dict[str, Primitive]:
    """Draw a cross where each feature truly is, grey where it is hidden."""
    drawn: dict[str, Primitive] = {}
    arms = size * np.array([[[-1.0, -1.0], [1.0, 1.0]], [[-1.0, 1.0], [1.0, -1.0]]])
    for name, chosen, colour in (
        ("true features", landmarks.visible, COLOURS["truth"]),
        ("hidden features", ~landmarks.visible, COLOURS["hidden"]),
    ):
        crosses = landmarks.points_px[chosen][:, None, None, :] + arms
        segments = at_height(crosses.reshape(-1, 2), 2.0).reshape(-1, 2, 3)
        drawn[name] = Links(segments, colour, 1.0, "truth")
    return drawn


def pose_axes(state: PoseState, origin_mm: NDArray[np.float64], length: float) -> dict[str, Primitive]:
    """Draw the solid's own axes at a point of it, z turned so that it comes out of the picture for a solid at rest."""
    turn = rotation(state.pose.mean)
    # Drawings count height towards the viewer, the camera counts depth away from them.
    flipped = turn * np.array([1.0, 1.0, -1.0])[:, None] * np.array([1.0, 1.0, -1.0])[None, :]
    origin = state.drawn(origin_mm[None])[0].astype(np.float32)
    return {"axes": Axes(origin, flipped.astype(np.float32), length, "axes")}


def dashes(segments: NDArray[np.float32], colour: Colour, width: float, layer: str, *, length: float = 6.0) -> Links:
    """Draw segments (n, 2, 3) as broken lines.

    Args:
        segments: Ends, px.
        colour: Of the dashes.
        width: Of the dashes, px.
        layer: That they are on.
        length: Of a dash and of the gap after it, px.
    """
    pieces = []
    for first, last in segments:
        count = max(1, round(float(np.linalg.norm(last - first)) / (2.0 * length)))
        marks = np.linspace(0.0, 1.0, 2 * count + 1)[:, None]
        line = first + marks * (last - first)
        pieces.append(np.stack([line[0:-1:2], line[1::2]], axis=1))
    broken = np.concatenate(pieces) if pieces else np.zeros((0, 2, 3))
    return Links(broken.astype(np.float32), colour, width, layer)
