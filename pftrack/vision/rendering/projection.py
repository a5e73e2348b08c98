"""Worlds become pictures: what a viewer sees who looks at a world from some side; and numbers as colours, as heat.

A `Projection` turns, scales and moves a world's coordinates into those of a square drawing: x to the right, y down, z
towards the viewer, px. It has no perspective, so each primitive stays one of its kind, an ellipsoid too, and code that
can paint a picture's drawing can paint a world. The page's canvas does the same by itself while somebody turns the
world (`frontend_static/session/flat/projection.js`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import (
    Arrows,
    Axes,
    Drawing,
    Ellipsoids,
    Links,
    Mesh,
    Points,
    Polyline,
    Primitive,
    Text,
    Viewpoint,
    World,
    WorldDrawing,
)
from pftrack.core.model.palette import COLOURS, VIRIDIS

MARGIN = 1.04
"""Factor of free space around a world."""
RULER_MARGIN = 0.04
"""How far from the corner of its picture a ruler lies, as a share of the side."""
TEXT_ABOVE_PX = 5.0


@dataclass(frozen=True)
class Projection:
    """A map p -> scale turn (p - middle) + place from a world to a drawing.

    Attributes:
        turn: (3, 3) directions that are seen to the right, downwards and towards the viewer, as rows.
        middle: (3,) of the world, in its unit.
        scale: px of the drawing per unit.
        place: (3,) where the middle is in the drawing, px.
    """

    turn: Floats
    middle: Floats
    scale: float
    place: Floats

    @classmethod
    def of(cls, world: World, azimuth_deg: float, elevation_deg: float, side_px: float) -> "Projection":
        """Return how a world fills a square picture.

        Args:
            world: What is looked at.
            azimuth_deg: From where, as `Viewpoint` says.
            elevation_deg: From where, as `Viewpoint` says.
            side_px: Of the picture.
        """
        centre = (side_px - 1.0) / 2.0
        scale = side_px / (2.0 * MARGIN * world.radius)
        place = np.array((centre, centre, 0.0))
        return cls(world.turn(azimuth_deg, elevation_deg), np.array(world.middle), scale, place)

    def points(self, positions: NDArray[np.float32]) -> NDArray[np.float32]:
        """Map positions (..., 3)."""
        mapped = self.scale * (positions - self.middle) @ self.turn.T + self.place
        return mapped.astype(np.float32)

    def primitive(self, item: Primitive) -> Primitive:
        """Map a primitive of a world.

        Raises:
            TypeError: It belongs to a picture only.
        """
        changed: dict[str, Any]
        match item:
            case Points():
                changed = {"positions": self.points(item.positions), "size": item.size * self.scale}
            case Polyline():
                changed = {"positions": self.points(item.positions)}
            case Links() | Arrows():
                changed = {"segments": self.points(item.segments)}
            case Mesh():
                changed = {"vertices": self.points(item.vertices)}
            case Ellipsoids():
                spread = self.scale**2 * (self.turn @ item.covariances @ self.turn.T)
                changed = {"centres": self.points(item.centres), "covariances": spread.astype(np.float32)}
            case Axes():
                directions = (self.turn @ item.rotation).astype(np.float32)
                length = item.length * self.scale
                changed = {"origin": self.points(item.origin), "rotation": directions, "length": length}
            case Text():
                changed = {"position": self.points(item.position)}
                if item.point is not None:
                    changed["point"] = self.points(item.point)
            case _:
                raise TypeError(f"a {type(item).__name__} belongs to a picture, not to a world")
        return replace(item, **changed)

    def primitives(self, items: Mapping[str, Primitive]) -> dict[str, Primitive]:
        """Map primitives by name; clouds are put in order, the furthest first, so that the nearest lies on top."""
        return {name: _far_to_near(self.primitive(item)) for name, item in items.items()}


def _far_to_near(item: Primitive) -> Primitive:
    match item:
        case Points():
            order = np.argsort(item.positions[:, 2], kind="stable")
            return replace(item, positions=item.positions[order], colours=item.colours[order])
        case Ellipsoids():
            order = np.argsort(item.centres[:, 2], kind="stable")
            covariances, colours = item.covariances[order], item.colours[order]
            return replace(item, centres=item.centres[order], covariances=covariances, colours=colours)
        case _:
            return item


def _ruler(world: World, side_px: float, scale: float) -> dict[str, Primitive]:
    """Draw a world's ruler into the lower left corner of a square drawing.

    Args:
        world: For its unit and the ruler's length.
        side_px: Of the drawing.
        scale: px of the drawing per unit.
    """
    margin = RULER_MARGIN * side_px
    start = np.array((margin, side_px - 1.0 - margin, 0.0), dtype=np.float32)
    end = start + np.array((world.ruler * scale, 0.0, 0.0), dtype=np.float32)
    above = start - np.array((0.0, TEXT_ABOVE_PX, 0.0), dtype=np.float32)
    colour = COLOURS["hidden"]
    return {
        "ruler": Links(np.stack((start, end))[None], colour, 2.0, "ruler"),
        "ruler length": Text(above, f"{world.ruler:g} {world.unit}", colour, "ruler"),
    }


def look_at(drawn: WorldDrawing, viewpoint: Viewpoint, side_px: int) -> Drawing:
    """Return a world as the drawing that somebody sees who looks from a viewpoint.

    Args:
        drawn: What there is in the world.
        viewpoint: Where to look from.
        side_px: Width and height of the drawing.
    """
    world = drawn.world
    projection = Projection.of(world, viewpoint.azimuth_deg, viewpoint.elevation_deg, side_px)
    shown = projection.primitives(drawn.primitives) | _ruler(world, side_px, projection.scale)
    return Drawing(side_px, side_px, shown, f"{world.title}, {world.unit} · {viewpoint.title}")


SHARE = 0.65
"""Of the colours; the rest is the picture, in grey."""

LEVELS = 256


def viridis(values: Floats) -> NDArray[np.uint8]:
    """Return colours (..., 3) RGB for numbers (...), from purple for 0 and below to yellow for 1 and above."""
    return np.rint(_shades(values)).astype(np.uint8)


def over(image_rgb: NDArray[np.uint8], values: Floats, *, width: int) -> NDArray[np.uint8]:
    """Return a picture in grey with numbers over it in viridis, from purple for 0 to yellow for 1.

    Args:
        image_rgb: (h, w, 3).
        values: 0..1, over the same picture, of any size.
        width: Of the result, px, if the picture is not narrower.

    Returns:
        (height, width, 3) RGB.
    """
    scale = min(1.0, width / image_rgb.shape[1])
    size = max(round(image_rgb.shape[1] * scale), 1), max(round(image_rgb.shape[0] * scale), 1)
    small = cv2.resize(np.ascontiguousarray(image_rgb), size, interpolation=cv2.INTER_AREA)
    places = cv2.resize(values.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    grey = cv2.cvtColor(small, cv2.COLOR_RGB2GRAY).astype(np.float64)[:, :, None]
    return np.rint(SHARE * _shades(places) + (1.0 - SHARE) * grey).astype(np.uint8)


def _shades(values: NDArray[Any]) -> Floats:
    """Return colours (..., 3) of numbers (...) of 0 to 1."""
    return np.asarray(_levels()[np.clip(np.rint((LEVELS - 1) * values), 0, LEVELS - 1).astype(np.intp)])


@cache
def _levels() -> Floats:
    """Return the colours (levels, 3) in equal steps."""
    stops, levels = np.linspace(0.0, 1.0, len(VIRIDIS)), np.linspace(0.0, 1.0, LEVELS)
    return np.column_stack([np.interp(levels, stops, channel) for channel in np.array(VIRIDIS, float).T])
