"""The points in the picture: where they are measured and how sure that is, where they were, and what the shape says."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.camera import pinhole
from pftrack.core.model.drawing import COLOURS, Colour, Ellipse, Links, Points, Primitive
from pftrack.experiments.shared.pose_sketch import dashes
from pftrack.experiments.shared.sketch import at_height, circle
from pftrack.experiments.structure.trackers.state import StructureState
from pftrack.experiments.structure.truth import align_similarity
from pftrack.sources.tracks.target import BodyTarget

__all__ = ["TRAIL_FRAMES", "draw_measurements", "paper", "second_in_picture", "shape_in_picture", "true_in_picture"]

TRAIL_FRAMES = 15
NEAREST = 1e-3
DOT_PX, RING_PX = 4.0, 7.0
SIGMAS = 2.0
FURTHEST = 5.0
"""What is further from the picture's corner than so many of its heights is not drawn."""

SEEN = np.array(COLOURS["observation"], np.uint8)
WIDEST = 0.15
"""Half axis of an ellipse of uncertainty, as a share of the picture's height: a larger one says no more than a ring."""


@lru_cache(maxsize=4)
def paper(width: int, height: int) -> NDArray[np.uint8]:
    """Return a white picture."""
    white = np.full((height, width, 3), 255, dtype=np.uint8)
    white.flags.writeable = False
    return white


def draw_measurements(state: StructureState, height: float) -> dict[str, Primitive]:
    """Draw where the points were, where they are and how sure that is; of what is hardly seen a ring at the shape's."""
    seen, names = state.seen, state.body.names
    positions = seen.filled[-TRAIL_FRAMES:] + state.principal_px
    deviations = np.sqrt(seen.variances[-TRAIL_FRAMES:])
    sure = (SIGMAS * deviations.max(axis=2) < WIDEST * height) & _near(positions, height)
    ways = np.stack([positions[:-1], positions[1:]], axis=2)[sure[1:] & sure[:-1]]
    drawn: dict[str, Primitive] = {"trails": _links(ways, COLOURS["hidden"], 1.0, "trails")}
    dots = positions[-1][sure[-1]]
    drawn["points"] = Points(at_height(dots, 2.0), np.tile(SEEN, (len(dots), 1)), DOT_PX, "points")
    believed = _estimated_points(state)
    shown = sure[-1] | _near(believed, height)
    for number in np.flatnonzero(shown):
        if sure[-1, number]:
            half_axes = (SIGMAS * np.diag(deviations[-1, number])).astype(np.float32)
            centre = at_height(positions[-1, number][None], 1.0)[0]
            drawn[f"noise {names[number]}"] = Ellipse(centre, half_axes, COLOURS["observation"], 1.0, "noise")
        else:
            ring = circle(believed[number], RING_PX, COLOURS["hidden"], "points", height=2.0)
            drawn[f"hidden {names[number]}"] = ring
    return drawn


def _near(positions: NDArray[np.float64], height: float) -> NDArray[np.bool_]:
    """Return which positions (..., 2) are near enough to the picture to be drawn."""
    return np.asarray((np.abs(positions) < FURTHEST * height).all(axis=-1))


def _estimated_points(state: StructureState) -> NDArray[np.float64]:
    """Return where the shape has the points (n, 2), px."""
    return _project(state, state.placed.points)


def _project(state: StructureState, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where points (n, 3) in the shape's frame are seen (n, 2), px."""
    camera = state.placed.camera
    inside = points @ camera[:, :3].T + camera[:, 3]
    inside[:, 2] = np.maximum(inside[:, 2], NEAREST)
    return pinhole(inside, state.focal_px) + state.principal_px


def shape_in_picture(state: StructureState, height: float) -> dict[str, Primitive]:
    """Draw the shape as it is believed to be seen: its points, and the edges between them."""
    return _body("shape", _estimated_points(state), state.body.edges, COLOURS["estimate"], 2.0, "shape", height)


def second_in_picture(state: StructureState, points: NDArray[np.float64], height: float) -> dict[str, Primitive]:
    """Draw the shape (n, 3) of a second run, laid on this one's and seen by its camera."""
    places = _project(state, align_similarity(points, state.placed.points)(points))
    return _body("second", places, state.body.edges, COLOURS["second"], 1.5, "second run", height)


def true_in_picture(target: BodyTarget, height: float) -> dict[str, Primitive]:
    """Draw the body as it truly is seen, what is hidden dashed."""
    marks = target.landmarks
    if marks is None:
        return {}
    edges = target.shape.edges
    shown = marks.visible[edges].all(axis=1)
    drawn = _body("true", marks.points_px, edges[shown], COLOURS["truth"], 1.0, "truth", height)
    ends = at_height(marks.points_px[edges[~shown]].reshape(-1, 2), 1.5).reshape(-1, 2, 3)
    return drawn | {"true hidden edges": dashes(ends, COLOURS["truth"], 1.0, "truth")}


def _body(
    name: str,
    places: NDArray[np.float64],
    edges: NDArray[np.int64],
    colour: Colour,
    width: float,
    layer: str,
    height: float,
) -> dict[str, Primitive]:
    near = _near(places, height)
    arms = 3.0 * np.array([[[-1.0, 0.0], [1.0, 0.0]], [[0.0, -1.0], [0.0, 1.0]]])
    crosses = (places[near][:, None, None] + arms).reshape(-1, 2)
    kept = edges[near[edges].all(axis=1)]
    return {
        f"{name} edges": _links(places[kept], colour, width, layer),
        f"{name} crosses": _links(crosses, colour, min(width, 1.5), layer),
    }


def _links(ends: NDArray[np.float64], colour: Colour, width: float, layer: str) -> Links:
    """Draw segments (n, 2, 2), px."""
    return Links(at_height(ends.reshape(-1, 2), 1.5).reshape(-1, 2, 3), colour, width, layer)
