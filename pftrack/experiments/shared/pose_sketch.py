"""Pieces of drawings of a solid that is tracked by its points."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import COLOURS, Axes, Colour, Frustum, Links, Points, Primitive, Text
from pftrack.core.model.frame import Landmarks
from pftrack.core.model.layer import Key
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.experiments.shared.pose_placing import place_points
from pftrack.experiments.shared.sketch import at_height, uncertainty

__all__ = [
    "BY_PREDICTION",
    "beside",
    "camera",
    "dashes",
    "draw_with_rim",
    "feature_clouds",
    "feature_marks",
    "feature_names",
    "model_points",
    "pose_axes",
    "true_marks",
]

MOST_DRAWN = 5000
NAMES_DOWN = 18
"""Names, one below the other, that fill the height of a picture and can still be read where it is small."""

UPPER, LOWER = COLOURS["observation"], COLOURS["prediction"]
"""Particles from the solid's prediction, and from the feature's own past."""


BY_PREDICTION = (
    Key("observation", "particles from the solid's pose"),
    Key("prediction", "particles from the feature's own past"),
)
"""What these colours mean."""


def feature_clouds(state: PoseState, size: float) -> dict[str, Primitive]:
    """Draw the particles of all features, coloured by which prediction they came from, lifted by weight."""
    positions = state.belief.positions
    features, count, _ = positions.shape
    stride = max(1, -(-features * count // MOST_DRAWN))
    chosen = np.arange(0, count, stride)
    log_weights = np.broadcast_to(state.belief.log_weights, (features, count))[:, chosen]
    relative = np.exp(log_weights - log_weights.max(axis=1, keepdims=True))
    colours = np.where((chosen < state.belief.upper_counts[:, None])[:, :, None], UPPER, LOWER).astype(np.uint8)
    raised = at_height(positions[:, chosen].reshape(-1, 2), 1.0 + 10.0 * relative.ravel())
    return {"particles": Points(raised, colours.reshape(-1, 3), size, "particles by prediction")}


def feature_marks(state: PoseState, names: tuple[str, ...]) -> dict[str, Primitive]:
    """Draw each feature's uncertainty, vermilion while it is not recognised."""
    marks = zip(names, state.feature_means, state.feature_covariances, _colours(state), strict=True)
    return {
        f"feature {name}": uncertainty(mean, covariance, colour, "features", width=1.0)
        for name, mean, covariance, colour in marks
    }


def feature_names(
    state: PoseState, names: tuple[str, ...], places: NDArray[np.float64], titles: Mapping[str, str] | None = None
) -> dict[str, Primitive]:
    """Draw the features' names at places (F, 2) px, and lines that lead to them.

    Args:
        state: Where the features are.
        names: Of the features.
        places: (F, 2) of the names, px.
        titles: The names written out, where these are short. They run away from their features.
    """
    ends = at_height(np.stack([places, state.feature_means], axis=1).reshape(-1, 2), 2.0)
    drawn: dict[str, Primitive] = {"name lines": Links(ends.reshape(-1, 2, 3), COLOURS["hidden"], 1.0, "names")}
    points, titles = at_height(state.feature_means, 2.0), titles or {}
    for name, place, point, colour in zip(names, at_height(places, 2.0), points, _colours(state), strict=True):
        drawn[f"name {name}"] = Text(
            place,
            name,
            colour,
            "names",
            anchor="middle" if name not in titles else "end" if place[0] < point[0] else "start",
            title=titles.get(name, ""),
            point=point,
        )
    return drawn


def beside(points: NDArray[np.float64], plan: NDArray[np.float64], height: float) -> NDArray[np.float64]:
    """Return places (n, 2) for the names of points (n, 2), so that none covers another: in two columns beside them.

    Args:
        points: px.
        plan: (n, 2) where the points are on the object: it decides on side and order, so that no name ever jumps.
        height: Of the picture, px.
    """
    places, gap = np.empty_like(points), height / NAMES_DOWN
    low, high = points.min(axis=0), points.max(axis=0)
    margin = (high - low).max() / 2.0
    for side, x in ((plan[:, 0] <= 0.0, low[0] - margin), (plan[:, 0] > 0.0, high[0] + margin)):
        rank = np.argsort(np.argsort(plan[side, 1], kind="stable"))
        places[side, 0] = x
        places[side, 1] = points[side, 1].mean() + gap * (rank - (len(rank) - 1) / 2.0)
    return places


def _colours(state: PoseState) -> list[Colour]:
    return [COLOURS["estimate"] if recognised else COLOURS["lost"] for recognised in state.recognised]


def model_points(state: PoseState, size: float) -> dict[str, Primitive]:
    """Draw the solid's points in its estimated pose, and the ways to where they are tracked in the picture."""
    points = place_points(state, state.solid.points_mm)
    arms = size * np.array([[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]])
    crosses = (points[:, None, None] + arms).reshape(-1, 2, 3).astype(np.float32)
    ways = np.stack([at_height(state.feature_means, 1.0), points.astype(np.float32)], axis=1)
    return {
        "ways": Links(ways, COLOURS["hidden"], 1.0, "model points"),
        "model points": Links(crosses, COLOURS["estimate"], 1.0, "model points"),
    }


def draw_with_rim(name: str, lines: Links) -> dict[str, Primitive]:
    """Draw dark lines with a light rim, so that they are seen on any picture."""
    rim = replace(lines, colour=COLOURS["paper"], width=lines.width + 1.0)
    return {f"{name} rim": rim, name: lines}


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


def pose_axes(state: PoseState, origin_mm: NDArray[np.float64], length_mm: float) -> dict[str, Primitive]:
    """Draw the solid's own axes at a point of it, z turned so that it comes out of the picture for a solid at rest.

    The axes that lie in the picture then are named; a third name would cover the others whenever the solid is turned.
    """
    directions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, -1]])
    ends = place_points(state, origin_mm + length_mm * directions).astype(np.float32)
    length = length_mm * state.solid.scale
    axes = (ends[1:] - ends[0]).T / np.float32(length)
    colour = COLOURS["estimate"]
    drawn: dict[str, Primitive] = {"axes": Axes(ends[0], axes, length, colour, 2.0, "axes")}
    for name, end in (("x", ends[1]), ("y", ends[2])):
        drawn[f"axis {name}"] = Text(
            ends[0] + np.float32(1.15) * (end - ends[0]), name, colour, "axes", anchor="middle"
        )
    return drawn


def camera(state: PoseState, size: tuple[int, int]) -> dict[str, Primitive]:
    """Draw the camera that the solid is assumed to be seen by, a focal length before its picture of a size, px."""
    apex = np.append(state.solid.principal_px, state.solid.focal_px).astype(np.float32)
    width, height = size
    border = np.array([[0, 0], [width, 0], [width, height], [0, height]]) - 0.5
    return {"camera": Frustum(apex, at_height(border), COLOURS["camera"], 1.0, "camera")}


def dashes(segments: NDArray[np.float32], colour: Colour, width: float, layer: str, *, length: float = 6.0) -> Links:
    """Draw segments (n, 2, 3) as broken lines.

    Args:
        segments: Ends, px.
        colour: Of the dashes.
        width: Of the dashes, px.
        layer: That they are on.
        length: Of a dash and of the gap after it, px.
    """
    ways = segments[:, 1] - segments[:, 0]
    counts = np.maximum(1, np.rint(np.linalg.norm(ways, axis=1) / (2.0 * length)).astype(np.int64))
    owners = np.repeat(np.arange(len(segments)), counts)
    within = np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)
    shares = (within[:, None] + np.array([0.0, 0.5])) / counts[owners, None]
    broken = segments[owners, None, 0] + shares[:, :, None] * ways[owners, None]
    return Links(broken.astype(np.float32), colour, width, layer)
