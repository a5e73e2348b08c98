"""Worlds in the scene: one below the other to the right of the picture, and shown together with it.

A world is placed like a drawing seen from the front (`pftrack.vision.rendering`). Its primitives are then shown like
those of any drawing, but free in space: they are not flattened into the picture's plane.
"""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import COLOURS, Drawing, Links, Primitive, Text, Viewpoint, World
from pftrack.vision.rendering import Projection
from pftrack_server.viewer.camera import Box, Side, View

GAP = 0.2
"""Gap between the picture and its worlds, in heights of the picture."""
FILLED = 0.86
"""Share of its square that a world's ball fills; the rest is for its title and its ruler."""
FOV_RAD = float(np.deg2rad(16.0))
MARGIN = 1.05
STEEPEST_DEG = 89.0
"""Steepest view, degrees: straight from above, no direction would be up when the scene is turned further."""


def place_worlds(drawing: Drawing) -> Iterator[tuple[str, Primitive]]:
    """Yield the primitives of a drawing's worlds, in the drawing's px, each by a name of its own."""
    for order, each in enumerate(drawing.worlds):
        world, side = each.world, drawing.height / len(drawing.worlds)
        projection = _projection(world, order, len(drawing.worlds), drawing.width, drawing.height)
        corner = projection.place - np.array((side / 2.0, side / 2.0, 0.0))
        inside = {name: projection.primitive(item) for name, item in each.primitives.items()}
        for name, item in (inside | _beside(world, corner, side, projection.scale)).items():
            yield f"world {world.name}: {name}", item


def _beside(world: World, corner: NDArray[np.float64], side: float, scale: float) -> dict[str, Primitive]:
    """Draw a world's title, and its ruler in each of the three directions: at an angle one of them is foreshortened.

    Args:
        world: The world.
        corner: (3,) upper left corner of the square around its ball, px.
        side: Side of that square, px.
        scale: Scale, px per unit.
    """
    colour, length = COLOURS["hidden"], world.ruler * scale
    ends = np.array(((length, 0.0, 0.0), (0.0, -length, 0.0), (0.0, 0.0, length)))
    start = corner + np.array((0.0, side, 0.0))
    title = corner + np.array((side / 2.0, 0.0, 0.0))
    segments = np.stack((np.tile(start, (3, 1)), start + ends), axis=1)
    words = f"{world.ruler:g} {world.unit}"
    return {
        "title": Text(title.astype(np.float32), f"{world.title}, {world.unit}", colour, "ruler", "middle"),
        "ruler": Links(segments.astype(np.float32), colour, 1.5, "ruler"),
        "ruler length": Text(start.astype(np.float32), words, colour, "ruler"),
    }


def preset(world: World, viewpoint: Viewpoint) -> str:
    """Return the name of the camera preset for a world's viewpoint."""
    return f"{world.name}/{viewpoint.name}"


def sides(worlds: Sequence[World]) -> dict[str, Side]:
    """Return the camera views of worlds, by the names of their presets."""
    return {
        preset(world, viewpoint): partial(view, order, len(worlds), world, viewpoint)
        for order, world in enumerate(worlds)
        for viewpoint in world.viewpoints
    }


def beside(count: int, height: float) -> float:
    """Return how far `count` worlds extend to the right of a picture of a height, px."""
    return (GAP + 1.0 / count) * height if count else 0.0


def view(order: int, count: int, world: World, viewpoint: Viewpoint, box: Box, aspect: float) -> View:
    """Return the camera that shows a whole world from a viewpoint.

    Args:
        order: Number of worlds above it.
        count: Number of worlds.
        world: The world.
        viewpoint: The viewpoint.
        box: Box of the picture.
        aspect: The window's width over its height.
    """
    projection = _projection(world, order, count, box.width, box.height)
    elevation = float(np.clip(viewpoint.elevation_deg, -STEEPEST_DEG, STEEPEST_DEG))
    upright = np.array((1.0, -1.0, 1.0))  # a scene counts y upwards
    towards = upright * (projection.turn @ world.turn(viewpoint.azimuth_deg, elevation)[2])
    target = upright * projection.place
    radius = projection.scale * world.radius
    distance = MARGIN * radius / np.sin(FOV_RAD / 2.0) / min(1.0, max(aspect, 0.1))
    return View(target + distance * towards, target, FOV_RAD)


def _projection(world: World, order: int, count: int, width: float, height: float) -> Projection:
    """Return a world's projection: its front towards the viewer, all worlds centred on the picture's height."""
    side = height / count
    across = width - 0.5 + beside(count, height) - side / 2.0
    down = (height - 1.0) / 2.0 + side * (order - (count - 1) / 2.0)
    scale = FILLED * side / 2.0 / world.radius
    return Projection(world.turn(0.0, 0.0), np.array(world.middle), scale, np.array((across, down, 0.0)))
