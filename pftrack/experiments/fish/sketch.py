"""What is drawn of a frame: the picture, its edges, some particles as whole fish, the estimate, the truth, the path."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.drawing import COLOURS, Colour, Ellipse, Links, Picture, Points, Polyline, Primitive
from pftrack.core.model.frame import Target
from pftrack.core.model.palette import VIRIDIS
from pftrack.experiments.fish.scene import FishTarget
from pftrack.experiments.fish.scene.edge_distance import CAP_PX, QUARTERS, Edges
from pftrack.experiments.fish.shape import FishShape, body_points, tail_line
from pftrack.experiments.fish.trackers.state import FishState
from pftrack.experiments.shared.sketch import at_height, circle, particle_clouds

__all__ = ["draw_edges", "draw_particles", "draw_path", "draw_truth", "fish", "outlines"]

FEW, MANY = 10, 200
"""How many particles are drawn as whole fish: as in the paper's figures 8 and 9, or nearly all."""

OUTLINE_POINTS = 24
TRAIL_FRAMES = 45
LINES_IN_LENGTH, LINE_WIDTHS_PX = 13.0, (0.7, 3.0)
"""Widths of lines in the half length of a fish, and bounds of their width."""


def fish(
    pose: NDArray[np.float64], shape: FishShape, colour: Colour, layer: str, name: str, *, dashed: bool = False
) -> dict[str, Primitive]:
    """Draw a pose (4,) as an ellipse with a tail, and a stroke to the head."""
    ahead = np.array([np.cos(pose[2]), np.sin(pose[2])])
    axes = np.stack([shape.half_length * ahead, shape.half_width * np.array([-ahead[1], ahead[0]])])
    centre = at_height(pose[None, :2], 2.0)[0]
    width = float(np.clip(shape.half_length / LINES_IN_LENGTH, *LINE_WIDTHS_PX))
    head = pose[:2] + shape.half_length * ahead
    stroke = at_height(np.vstack([head - 0.3 * shape.half_length * ahead, head]), 2.0)
    return {
        f"{name} body": Ellipse(centre, axes.astype(np.float32), colour, width, layer, dashed),
        f"{name} tail": Polyline(at_height(tail_line(pose, shape), 2.0), colour, width, layer),
        f"{name} head": Polyline(stroke, colour, width, layer),
    }


def draw_particles(state: FishState, shape: FishShape, width: int) -> dict[str, Primitive]:
    """Draw all particles as points at their centres, and some of them as whole fish."""
    states = state.particles.states
    poses = states[:, [0, 1, 4, 5]]
    clouds = particle_clouds(poses[:, :2], state.particles, 0, width / 200.0)
    return {
        "many": outlines(_some(poses, MANY), shape, COLOURS["prediction"], 0.5, "many particles"),
        "few": outlines(_some(poses, FEW), shape, COLOURS["prediction"], 1.0, "ten particles"),
        "centres": clouds["weights"],
    }


def outlines(poses: NDArray[np.float64], shape: FishShape, colour: Colour, width: float, layer: str) -> Links:
    """Draw poses (n, 4) as outlines with tails, all of them one primitive."""
    around = body_points(poses, shape, OUTLINE_POINTS)
    segments = np.concatenate(
        [np.stack([around, np.roll(around, -1, axis=1)], axis=2), tail_line(poses, shape)[:, None]], axis=1
    ).reshape(-1, 2, 2)
    flat = np.full((len(segments), 2, 3), 1.0, np.float32)
    flat[:, :, :2] = segments
    return Links(flat, colour, width, layer)


def draw_edges(edges: Edges) -> dict[str, Primitive]:
    """Draw the distance image, dark near the edges, and the edges themselves."""
    rows, columns = np.nonzero(edges.edges)
    places = at_height(np.column_stack([columns, rows]).astype(np.float64), 1.0)
    colours = np.tile(np.array(COLOURS["lost"], np.uint8), (len(places), 1))
    return {
        "distances": Picture(_TABLE[edges.distances[1:-1, 1:-1]], "distance image"),
        "edges": Points(places, colours, 1.5, "edges"),
    }


def draw_truth(target: Target | None) -> dict[str, Primitive]:
    """Draw the true fish, or a circle where only its place is known."""
    if isinstance(target, FishTarget):
        return fish(target.pose, target.shape, COLOURS["truth"], "truth", "true")
    if target is not None:
        return {"true place": circle(target.position, target.size / 2.0, COLOURS["truth"], "truth")}
    return {}


def draw_path(past: Sequence[Diagnostics], frame: int) -> dict[str, Primitive]:
    """Draw where the estimate was in the last three seconds."""
    rows = past[max(frame - TRAIL_FRAMES, 0) : frame + 1]
    places = np.array([row.estimate for row in rows]).reshape(-1, 2)
    return {"path": Polyline(at_height(places, 1.0), COLOURS["estimate"], 2.0, "path")}


def _some(poses: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return an even choice of particles, which lie in the order of their parents."""
    if len(poses) <= count:
        return poses
    return poses[np.linspace(0, len(poses) - 1, count).astype(np.int64)]


_TABLE = np.array(VIRIDIS, np.uint8)[np.minimum(np.arange(256) * len(VIRIDIS) // (QUARTERS * CAP_PX), len(VIRIDIS) - 1)]
"""Colour of each distance."""
