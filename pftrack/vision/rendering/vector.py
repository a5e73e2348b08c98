"""Drawings become vector graphics: one SVG of what a film shows of a frame, for slides and for print.

The picture is embedded as PNG; everything drawn on it is a shape of its own, in a group of its layer, in the order in
which an experiment lists its primitives. Positions count from the centre of the top left pixel, so all of it is moved
by half a pixel.
"""

import base64
from collections.abc import Iterable, Mapping
from functools import singledispatch
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import (
    TITLES_FROM_PX,
    Arrows,
    Axes,
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
)
from pftrack.core.model.palette import COLOURS, Colour
from pftrack.vision.rendering.projection import look_at
from pftrack.vision.rendering.raster import covariance_root, png

LETTERS_PX = 12
CORNERS = 72
DARK = 3 * 160
"""Letters whose red, green and blue sum up to less stand on a white rim, others on a black one."""


def svg(drawing: Drawing, *, layers: Mapping[str, bool] | None = None) -> bytes:
    """Return a drawing, with its worlds to the right of it, as a file of SVG.

    Args:
        drawing: What is to be seen.
        layers: Which layers to show; one that is not named is shown.
    """
    parts = [drawing, *(look_at(each, each.world.viewpoints[0], drawing.height) for each in drawing.worlds)]
    left, groups = 0, []
    for part in parts:
        groups.append(f'<g transform="translate({left})">{_part(part, layers)}</g>')
        left += part.width
    size = f'width="{left}" height="{drawing.height}" viewBox="0 0 {left} {drawing.height}"'
    title = f"<title>{escape(drawing.caption)}</title>"
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="{LETTERS_PX}">'
    return f"{head}{title}{''.join(groups)}</svg>\n".encode()


def _part(drawing: Drawing, layers: Mapping[str, bool] | None) -> str:
    shown = [
        f"<g data-layer={quoteattr(item.layer)}>{_shape(item, drawing)}</g>"
        for item in drawing.primitives.values()
        if layers is None or layers.get(item.layer, True)
    ]
    paper = f'<rect width="{drawing.width}" height="{drawing.height}" fill="{_colour(COLOURS["paper"])}"/>'
    window = f'viewBox="0 0 {drawing.width} {drawing.height}" width="{drawing.width}" height="{drawing.height}"'
    return f'<svg {window} overflow="hidden">{paper}<g transform="translate(.5 .5)">{"".join(shown)}</g></svg>'


@singledispatch
def _shape(primitive: Primitive, drawing: Drawing) -> str:
    """Return one primitive as elements of SVG."""
    del drawing
    raise TypeError(f"cannot draw a {type(primitive).__name__}")


def _colour(colour: ArrayLike) -> str:
    red, green, blue = np.rint(np.asarray(colour, np.float64)).astype(int).tolist()
    return f"#{red:02x}{green:02x}{blue:02x}"


def _path(positions: NDArray[np.float32] | Floats, *, closed: bool = False) -> str:
    """Return positions (n, 2 or 3) as the data of a path, without those that are not finite."""
    flat = np.asarray(positions, np.float64)[:, :2]
    known = flat[np.isfinite(flat).all(axis=1)]
    return f"M{' '.join(f'{x:.2f},{y:.2f}' for x, y in known)}{'Z' if closed else ''}" if len(known) > 1 else ""


def _lines(paths: Iterable[str], colour: Colour, width: float, more: str = "") -> str:
    data = "".join(paths)
    look = f'fill="none" stroke="{_colour(colour)}" stroke-width="{width:g}" stroke-linejoin="round"'
    return f'<path d="{data}" {look}{more}/>' if data else ""


@_shape.register
def _picture(picture: Picture, drawing: Drawing) -> str:
    encoded = base64.b64encode(png(np.ascontiguousarray(picture.image_rgb))).decode()
    place = f'x="-.5" y="-.5" width="{drawing.width}" height="{drawing.height}" preserveAspectRatio="none"'
    return f'<image {place} href="data:image/png;base64,{encoded}"/>'


@_shape.register
def _points(points: Points, drawing: Drawing) -> str:
    del drawing
    radius = max(0.5, points.size / 2)
    places = zip(points.positions[:, :2].tolist(), points.colours, strict=True)
    return "".join(
        f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{radius:g}" fill="{_colour(colour)}"/>'
        for (x, y), colour in places
        if np.isfinite(x) and np.isfinite(y)
    )


@_shape.register
def _polyline(line: Polyline, drawing: Drawing) -> str:
    del drawing
    return _lines([_path(line.positions)], line.colour, line.width)


@_shape.register
def _links(links: Links, drawing: Drawing) -> str:
    del drawing
    return _lines(map(_path, links.segments), links.colour, links.width)


@_shape.register
def _axes(axes: Axes, drawing: Drawing) -> str:
    del drawing
    ends = (np.stack([axes.origin, axes.origin + axes.length * direction]) for direction in axes.rotation.T)
    return _lines(map(_path, ends), axes.colour, axes.width)


@_shape.register
def _ellipse(ellipse: Ellipse, drawing: Drawing) -> str:
    del drawing
    outline = ellipse.centre[:2] + _circle() @ ellipse.half_axes
    dashes = f' stroke-dasharray="{3 * ellipse.width:g}"' if ellipse.dashed else ""
    return _lines([_path(outline, closed=True)], ellipse.colour, ellipse.width, dashes)


@_shape.register
def _ellipsoids(ellipsoids: Ellipsoids, drawing: Drawing) -> str:
    del drawing
    bodies = zip(ellipsoids.centres, ellipsoids.covariances, ellipsoids.colours, strict=True)
    shapes = []
    for centre, covariance, colour in bodies:
        outline = centre[:2] + ellipsoids.sigmas * _circle() @ covariance_root(covariance[:2, :2]).T
        if np.isfinite(outline).all():
            look = f'fill="{_colour(colour)}" fill-opacity="{ellipsoids.opacity:g}" stroke="{_colour(colour)}"'
            shapes.append(f'<path d="{_path(outline, closed=True)}" {look}/>')
    return "".join(shapes)


@_shape.register
def _arrows(arrows: Arrows, drawing: Drawing) -> str:
    del drawing
    ends = arrows.segments[np.isfinite(arrows.segments[..., :2]).all(axis=(1, 2))][..., :2].astype(np.float64)
    heads = []
    for start, end in ends:
        length = float(np.hypot(*(end - start)))
        if length > 0.0:
            along = (end - start) / length * min(0.35 * length, 6.0 * arrows.width)
            aside = 0.45 * np.array([-along[1], along[0]])
            heads.append(_path(np.stack([end, end - along + aside, end - along - aside]), closed=True))
    drawn = f'<path d="{"".join(heads)}" fill="{_colour(arrows.colour)}"/>' if heads else ""
    return _lines(map(_path, ends), arrows.colour, arrows.width) + drawn


@_shape.register
def _frustum(frustum: Frustum, drawing: Drawing) -> str:
    """Draw nothing: the camera does not see itself."""
    del frustum, drawing
    return ""


@_shape.register
def _mesh(mesh: Mesh, drawing: Drawing) -> str:
    del drawing
    corners = mesh.vertices[mesh.faces]
    if not len(corners) or not np.isfinite(corners).all():
        return ""
    edges = corners[:, 1:] - corners[:, :1]
    normals = np.cross(edges[:, 0], edges[:, 1]).astype(np.float64)
    facing = np.abs(normals[:, 2]) / np.maximum(np.linalg.norm(normals, axis=1), 1e-12)
    colours = np.broadcast_to(np.asarray(mesh.colour, np.float64), mesh.vertices.shape)[mesh.faces].mean(axis=1)
    shaded = colours * (0.4 + 0.6 * facing[:, None])
    opacities = np.broadcast_to(np.asarray(mesh.opacity, np.float64), len(mesh.vertices))[mesh.faces].mean(axis=1)
    order = np.argsort(corners[:, :, 2].mean(axis=1), kind="stable")
    # Of one opacity all triangles are blended together, so that what lies behind another does not shine through.
    whole = float(mesh.opacity) if not isinstance(mesh.opacity, np.ndarray) else None
    triangles = "".join(
        f'<path d="{_path(corners[face], closed=True)}" fill="{_colour(shaded[face])}"'
        + ("/>" if whole is not None else f' fill-opacity="{opacities[face]:.3g}"/>')
        for face in order
    )
    return triangles if whole is None else f'<g opacity="{whole:g}">{triangles}</g>'


@_shape.register
def _text(text: Text, drawing: Drawing) -> str:
    if not np.isfinite(text.position[:2]).all():
        return ""
    words = text.title if text.title and drawing.width >= TITLES_FROM_PX else text.text
    rim = "#ffffff" if sum(text.colour) < DARK else "#000000"
    x, y = text.position[:2].tolist()
    look = f'fill="{_colour(text.colour)}" stroke="{rim}" stroke-width="2" paint-order="stroke"'
    return f'<text x="{x:.2f}" y="{y:.2f}" text-anchor="{text.anchor}" {look}>{escape(words)}</text>'


def _circle() -> Floats:
    angles = np.linspace(0, 2 * np.pi, CORNERS, endpoint=False)
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)
