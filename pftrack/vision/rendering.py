"""Rendering: drawings and worlds as pictures and films."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, singledispatch
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import (
    COLOURS,
    TITLES_FROM_PX,
    VIRIDIS,
    Arrows,
    Axes,
    Colour,
    Drawing,
    Ellipse,
    Ellipsoids,
    Frustum,
    Links,
    Mesh,
    Picture,
    Points,
    Polyline,
    Primitive,
    Text,
    Viewpoint,
    World,
    WorldDrawing,
)

__all__ = ["png", "render", "render_beside"]


# Pictures of worlds, seen from a viewpoint; and numbers as colours, as heat.
#
# A `Projection` turns, scales and moves a world's coordinates into those of a square drawing: x to the right, y down, z
# towards the viewer, px. It has no perspective, so each primitive stays one of its kind, an ellipsoid too, and code
# that can paint a picture's drawing can paint a world. The page's canvas does the same while a user turns the world
# (`frontend_static/session/flat/projection.js`).

MARGIN = 1.04
"""Factor of free space around a world."""
RULER_MARGIN = 0.04
"""Distance of a ruler from the corner of its picture, as a share of the side."""
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
            world: The world to project.
            azimuth_deg: Direction of the viewer, as in `Viewpoint`.
            elevation_deg: Elevation of the viewer, as in `Viewpoint`.
            side_px: Side of the picture.
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
        """Map primitives by name; clouds are sorted, the furthest first, so the nearest point lies on top."""
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
        side_px: Side of the drawing.
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
    """Return the drawing of a world seen from a viewpoint.

    Args:
        drawn: Contents of the world.
        viewpoint: Where to look from.
        side_px: Width and height of the drawing.
    """
    world = drawn.world
    projection = Projection.of(world, viewpoint.azimuth_deg, viewpoint.elevation_deg, side_px)
    shown = projection.primitives(drawn.primitives) | _ruler(world, side_px, projection.scale)
    return Drawing(side_px, side_px, shown, f"{world.title}, {world.unit} · {viewpoint.title}")


SHARE = 0.65
"""Share of the colours; the rest is the picture, in grey."""

LEVELS = 256


def viridis(values: Floats) -> NDArray[np.uint8]:
    """Return colours (..., 3) RGB for numbers (...), from purple for 0 and below to yellow for 1 and above."""
    return np.rint(_shades(values)).astype(np.uint8)


def over(image_rgb: NDArray[np.uint8], values: Floats, *, width: int) -> NDArray[np.uint8]:
    """Return a picture in grey with numbers over it in viridis, from purple for 0 to yellow for 1.

    Args:
        image_rgb: (h, w, 3).
        values: 0..1, over the same picture, of any size.
        width: Width of the result, px, at most that of the picture.

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


# Drawings become pictures.
#
# One renderer without depth, for thumbnails, documentation and video: what the scene shows, seen from the front. It
# paints with OpenCV at a sixteenth of a pixel, antialiased, in the order in which an experiment lists its primitives. A
# drawing's coordinates count from the centre of the top left pixel, so at `scale` k a position x lands on
# `k (x + 1/2) - 1/2`.
#
# A film shows the worlds of a drawing beside the picture, each in a square as high as the picture, from its first
# viewpoint.

SHIFT = 4  # OpenCV takes positions as whole sixteenths of a pixel
FAR_PX = 30_000.0  # beyond this OpenCV's whole numbers overflow
ELLIPSE_CORNERS = 72
OUTLINE_PX = 1.0
ARROW_HEAD, ARROW_HEAD_WIDTHS = 0.35, 6.0
"""Length of an arrow's head, in widths of its line, and at most this share of the arrow."""
ARROW_HALF_ANGLE = float(np.deg2rad(24.0))
STAMPED_FROM = 5_000  # from this number on, points are stamped at once, without antialiasing
RIM_PX = 3
LARGEST_PICTURE_PX = 64_000_000
# Replacements for characters that OpenCV's font lacks.
GLYPHS = str.maketrans({"·": "-", "–": "-", "—": "-", "×": "x", "…": "...", "σ": "sigma", "γ": "gamma", "°": " deg"})


def render(
    drawing: Drawing, *, layers: Mapping[str, bool] | None = None, scale: float = 1.0, caption: bool = True
) -> NDArray[np.uint8]:
    """Paint a drawing, without the worlds beside it.

    Args:
        drawing: The drawing to paint.
        layers: Which layers to show; one that is not named is shown.
        scale: Pixels of the result per px of the drawing.
        caption: Whether to write the drawing's caption into the top left corner.

    Returns:
        (round(height * scale), round(width * scale), 3) uint8 RGB.
    """
    width, height = round(drawing.width * scale), round(drawing.height * scale)
    if not (width >= 1 and height >= 1 and width * height <= LARGEST_PICTURE_PX):
        raise ValueError(f"a picture must have 1 to {LARGEST_PICTURE_PX} pixels, got {width} x {height}")
    canvas = np.full((height, width, 3), COLOURS["paper"], np.uint8)
    for primitive in drawing.primitives.values():
        if layers is None or layers.get(primitive.layer, True):
            _paint(primitive, canvas, scale)
    if caption and drawing.caption:
        size = 0.4 * max(1.0, scale)
        _write(canvas, drawing.caption, (round(15 * size), round(35 * size)), (0, 0, 0), size)
    return canvas


def render_beside(
    drawing: Drawing, *, layers: Mapping[str, bool] | None = None, scale: float = 1.0
) -> NDArray[np.uint8]:
    """Paint a drawing and, to the right of it, its worlds.

    Args:
        drawing: The drawing to paint.
        layers: Which layers to show; one that is not named is shown.
        scale: Pixels of the result per px of the drawing.

    Returns:
        (round(height * scale), width, 3) uint8 RGB.
    """
    parts = [drawing, *(look_at(each, each.world.viewpoints[0], drawing.height) for each in drawing.worlds)]
    return np.concatenate([render(part, layers=layers, scale=scale) for part in parts], axis=1)


def png(picture_rgb: NDArray[np.uint8]) -> bytes:
    """Encode an RGB picture as PNG."""
    _, encoded = cv2.imencode(".png", cv2.cvtColor(picture_rgb, cv2.COLOR_RGB2BGR))
    return encoded.tobytes()


@singledispatch
def _paint(primitive: Primitive, canvas: NDArray[np.uint8], scale: float) -> None:  # noqa: ARG001 - see its members
    """Paint one primitive onto the canvas."""
    raise TypeError(f"cannot paint a {type(primitive).__name__}")


def _sixteenths(positions: NDArray[np.float32], scale: float) -> NDArray[np.int32]:
    """Positions (n, 2 or 3) px -> (n, 2) sixteenths of a pixel of the canvas; what is not finite goes far away."""
    flat = np.asarray(positions, np.float64)[:, :2]
    placed = np.clip(np.nan_to_num(scale * (flat + 0.5) - 0.5, nan=-FAR_PX), -FAR_PX, FAR_PX)
    return np.rint(placed * (1 << SHIFT)).astype(np.int32)


def _whole(places: NDArray[np.int32]) -> NDArray[np.int32]:
    """Sixteenths of a pixel -> the nearest whole pixel."""
    return (places + (1 << SHIFT - 1)) >> SHIFT


def _thickness(width: float, scale: float) -> int:
    return min(max(1, round(width * scale)), 255)


@_paint.register
def _picture(picture: Picture, canvas: NDArray[np.uint8], _scale: float) -> None:
    height, width = canvas.shape[:2]
    enlarged = width >= picture.image_rgb.shape[1]
    # Plain INTER_NEAREST begins each pixel up to a whole pixel of the canvas late.
    way = cv2.INTER_NEAREST_EXACT if enlarged else cv2.INTER_AREA
    canvas[:] = cv2.resize(picture.image_rgb, (width, height), interpolation=way)


@_paint.register
def _points(points: Points, canvas: NDArray[np.uint8], scale: float) -> None:
    places = _sixteenths(points.positions, scale)
    radius = max(0.5, points.size * scale / 2)
    if len(places) >= STAMPED_FROM:
        _stamp(canvas, _whole(places), points.colours, round(radius))
        return
    height, width = canvas.shape[:2]
    margin = round(radius) + 1
    whole = _whole(places)
    seen = np.all((whole > -margin) & (whole < np.array([width, height]) + margin), axis=1)
    fixed = round(radius * (1 << SHIFT))
    colours = points.colours[seen].tolist()
    for place, colour in zip(places[seen].tolist(), colours, strict=True):
        cv2.circle(canvas, place, fixed, colour, cv2.FILLED, cv2.LINE_AA, SHIFT)


def _stamp(canvas: NDArray[np.uint8], places: NDArray[np.int32], colours: NDArray[np.uint8], radius: int) -> None:
    height, width = canvas.shape[:2]
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            if dx * dx + dy * dy <= radius * radius:
                x, y = places[:, 0] + dx, places[:, 1] + dy
                inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
                canvas[y[inside], x[inside]] = colours[inside]


def _line(
    canvas: NDArray[np.uint8],
    positions: NDArray[np.float32],
    colour: Colour,
    width: float,
    scale: float,
    *,
    dashed: bool = False,
) -> None:
    known = positions[np.isfinite(positions[:, :2]).all(axis=1)]
    if len(known) < 2:
        return
    places = _sixteenths(known, scale)
    strokes = list(np.stack([places[:-1:2], places[1::2]], axis=1)) if dashed else [places]
    cv2.polylines(canvas, strokes, False, colour, _thickness(width, scale), cv2.LINE_AA, SHIFT)


@_paint.register
def _polyline(line: Polyline, canvas: NDArray[np.uint8], scale: float) -> None:
    _line(canvas, line.positions, line.colour, line.width, scale)


@_paint.register
def _links(links: Links, canvas: NDArray[np.uint8], scale: float) -> None:
    for segment in links.segments:
        _line(canvas, segment, links.colour, links.width, scale)


@_paint.register
def _ellipse(ellipse: Ellipse, canvas: NDArray[np.uint8], scale: float) -> None:
    angles = np.linspace(0, 2 * np.pi, ELLIPSE_CORNERS, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    outline = (ellipse.centre[:2] + circle @ ellipse.half_axes).astype(np.float32)
    closed = outline if ellipse.dashed else np.concatenate([outline, outline[:1]])
    _line(canvas, closed, ellipse.colour, ellipse.width, scale, dashed=ellipse.dashed)


@_paint.register
def _ellipsoids(ellipsoids: Ellipsoids, canvas: NDArray[np.uint8], scale: float) -> None:
    """Paint their outlines, which are ellipses, and fill them."""
    angles = np.linspace(0, 2 * np.pi, ELLIPSE_CORNERS, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    bodies = zip(ellipsoids.centres, ellipsoids.covariances, ellipsoids.colours.tolist(), strict=True)
    for centre, covariance, colour in bodies:
        outline = centre[:2] + ellipsoids.sigmas * circle @ covariance_root(covariance[:2, :2]).T
        if not np.isfinite(outline).all():
            continue
        filled = canvas.copy()
        cv2.fillConvexPoly(filled, _sixteenths(outline, scale), colour, cv2.LINE_AA, SHIFT)
        cv2.addWeighted(filled, ellipsoids.opacity, canvas, 1 - ellipsoids.opacity, 0, dst=canvas)
        _line(canvas, np.concatenate([outline, outline[:1]]).astype(np.float32), colour, OUTLINE_PX, scale)


def covariance_root(covariance: NDArray[np.float32]) -> Floats:
    """Return the lower triangular root (2, 2) of a covariance, which may be flat."""
    (first, both), (_, second) = covariance.astype(np.float64)
    across = np.sqrt(max(first, 0.0))
    slope = both / across if across > 0.0 else 0.0
    return np.array([[across, 0.0], [slope, np.sqrt(max(second - slope * slope, 0.0))]])


@_paint.register
def _arrows(arrows: Arrows, canvas: NDArray[np.uint8], scale: float) -> None:
    for start, end in arrows.segments[..., :2].astype(np.float64):
        if not np.isfinite((*start, *end)).all():
            continue
        way = end - start
        length = float(np.hypot(*way))
        _line(canvas, np.stack([start, end]).astype(np.float32), arrows.colour, arrows.width, scale)
        if length <= 0.0:
            continue
        head = min(ARROW_HEAD * length, ARROW_HEAD_WIDTHS * arrows.width)
        along = head * way / length
        aside = np.tan(ARROW_HALF_ANGLE) * np.array([-along[1], along[0]])
        corners = np.stack([end, end - along + aside, end - along - aside]).astype(np.float32)
        cv2.fillConvexPoly(canvas, _sixteenths(corners, scale), arrows.colour, cv2.LINE_AA, SHIFT)


@_paint.register
def _axes(axes: Axes, canvas: NDArray[np.uint8], scale: float) -> None:
    for direction in axes.rotation.T:
        ends = np.stack([axes.origin, axes.origin + axes.length * direction]).astype(np.float32)
        _line(canvas, ends, axes.colour, axes.width, scale)


@_paint.register
def _frustum(frustum: Frustum, canvas: NDArray[np.uint8], scale: float) -> None:
    """Paint nothing: the camera does not see itself."""


@_paint.register
def _mesh(mesh: Mesh, canvas: NDArray[np.uint8], scale: float) -> None:
    corners = mesh.vertices[mesh.faces]
    if not len(corners) or not np.isfinite(corners).all():
        return
    edges = corners[:, 1:] - corners[:, :1]
    normals = np.cross(edges[:, 0], edges[:, 1]).astype(np.float64)
    facing = np.abs(normals[:, 2]) / np.maximum(np.linalg.norm(normals, axis=1), 1e-12)
    places = _sixteenths(corners.reshape(-1, 3), scale).reshape(-1, 3, 2)
    order = np.argsort(corners[:, :, 2].mean(axis=1), kind="stable")
    colours = np.broadcast_to(np.asarray(mesh.colour, np.float64), mesh.vertices.shape)[mesh.faces].mean(axis=1)
    layer = canvas.copy()
    for face in order:
        shade = (colours[face] * (0.4 + 0.6 * facing[face])).tolist()
        cv2.fillConvexPoly(layer, places[face], shade, cv2.LINE_AA, SHIFT)
    if not isinstance(mesh.opacity, np.ndarray):
        cv2.addWeighted(layer, mesh.opacity, canvas, 1 - mesh.opacity, 0, dst=canvas)
        return
    share = _opacities(places[order], mesh.opacity[mesh.faces[order]].mean(axis=1), canvas.shape[:2])
    canvas[:] = np.rint(share * layer + (1.0 - share) * canvas)


def _opacities(places: NDArray[np.int32], opacities: NDArray[np.float32], size: tuple[int, ...]) -> NDArray[np.float32]:
    """Return how opaque a mesh is at each pixel of the canvas, (height, width, 1), its triangles painted in order."""
    mask = np.zeros(size, np.uint8)
    values = np.rint(255.0 * np.clip(opacities, 0.0, 1.0)).astype(int).tolist()
    # The rim lies beneath: the layer's own edge is already soft, and would be softened twice.
    for triangle, value in zip(places, values, strict=True):
        cv2.polylines(mask, [triangle], True, value, RIM_PX, cv2.LINE_8, SHIFT)
    for triangle, value in zip(places, values, strict=True):
        cv2.fillConvexPoly(mask, triangle, value, cv2.LINE_AA, SHIFT)
    return mask[..., None].astype(np.float32) / np.float32(255.0)


@_paint.register
def _text(text: Text, canvas: NDArray[np.uint8], scale: float) -> None:
    if np.isfinite(text.position[:2]).all():
        x, y = _whole(_sixteenths(text.position[None], scale)[0]).tolist()
        size, room = 0.4 * max(1.0, scale), canvas.shape[1]
        words = text.title if text.title and room >= TITLES_FROM_PX * max(1.0, scale) else text.text
        length = _length(words, size)
        start = x - {"start": 0, "middle": length // 2, "end": length}[text.anchor]
        x = max(RIM_PX, min(start, room - length - RIM_PX)) if 0 <= x <= room else start
        _write(canvas, words, (x, y), text.colour, size)


def _length(words: str, size: float) -> int:
    return int(cv2.getTextSize(words.translate(GLYPHS), cv2.FONT_HERSHEY_SIMPLEX, size, 1)[0][0])


def _write(canvas: NDArray[np.uint8], text: str, place: tuple[int, int], colour: Colour, size: float) -> None:
    """Write with a rim in the opposite brightness, so the text is legible on any picture."""
    plain = text.translate(GLYPHS).encode("ascii", "replace").decode()
    rim = (255, 255, 255) if sum(colour) < 3 * 160 else (0, 0, 0)
    stroke = max(1, round(2 * size))
    cv2.putText(canvas, plain, place, cv2.FONT_HERSHEY_SIMPLEX, size, rim, stroke + 2, cv2.LINE_AA)
    cv2.putText(canvas, plain, place, cv2.FONT_HERSHEY_SIMPLEX, size, colour, stroke, cv2.LINE_AA)
