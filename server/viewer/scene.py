"""The scene: a drawing's primitives as viser nodes, updated in place.

A primitive keeps its name from frame to frame, so each name is one node whose arrays are replaced; adding nodes anew
would cost two to three times as much. A name that is absent from a frame is hidden, not removed, because it usually
comes back (an estimate that is lost for a while). A hidden layer is not sent at all.

All nodes of a frame change within one atomic block, so that a browser never shows the particles of one frame on the
picture of another.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import viser

from pftrack.drawing import (
    Axes,
    Colour,
    Drawing,
    Ellipse,
    Frustum,
    Links,
    Mesh,
    Picture,
    Points,
    Polyline,
    Primitive,
    Text,
)
from pftrack.layer import Layer
from server.viewer import shapes
from server.viewer.camera import Box
from server.viewer.shapes import Stance

__all__ = ["Scene"]

JPEG_QUALITY = 88
"""Sharp enough that a ball of ten pixels keeps its edge; 15 kB at 320 x 240."""
LAYER_GAP_PX = 0.05
"""Height between one primitive and the next, so that what is painted later lies on top."""
LINE_SCALE = 1.6
"""Screen pixels for a unit of line width: a picture is usually shown at about twice its size."""
UPRIGHT_WXYZ = (0.0, 1.0, 0.0, 0.0)
"""viser lays an image face down with its rows along y; half a turn about x shows it upright."""
STALE_NODES = 64
"""How many hidden nodes are kept for their return."""


@dataclass(slots=True)
class _Node:
    kind: type[Primitive]
    handle: Any  # viser's handles share `visible` and `remove`, and no type that mypy can follow through `__setattr__`
    source: Primitive | None = None
    look: object = None  # what seldom changes: viser takes longer to compare it than to send it
    stance: Stance | None = None


class Scene:
    """What is shown of one session, in all of its browsers.

    Args:
        server: The session's own viser server.
        layers: What can be switched on and off.
    """

    def __init__(self, server: viser.ViserServer, layers: Iterable[Layer]) -> None:
        self._server = server
        self._layers = {layer.name: layer.shown for layer in layers}
        self._nodes: dict[str, _Node] = {}
        server.scene.set_up_direction("+y")
        server.scene.world_axes.visible = False
        server.scene.configure_default_lights(enabled=True, cast_shadow=False)

    def set_layer(self, layer: str, *, shown: bool) -> None:
        """Show or hide a layer from the next drawing on."""
        self._layers[layer] = shown

    def box(self, drawing: Drawing) -> Box:
        """Return what there is to see of a drawing."""
        shown = [item for item in drawing.primitives.values() if self._layers.get(item.layer, True)]
        cameras = (shapes.to_scene(item.apex, Stance(1.0, 0.0)) for item in shown if isinstance(item, Frustum))
        apex = next((tuple(place.tolist()) for place in cameras), None)
        return Box(drawing.width, drawing.height, shapes.depth(shown), apex)

    def apply(self, drawing: Drawing, relief: float) -> None:
        """Make the scene show a drawing; the caller holds the server's atomic block.

        Args:
            drawing: What is to be seen.
            relief: Factor on the heights above the picture.
        """
        shown: set[str] = set()
        summit = 0.0
        apex = None if drawing.apex is None else tuple(drawing.apex.tolist())
        for order, (name, item) in enumerate(drawing.primitives.items()):
            if not self._layers.get(item.layer, True) or _is_empty(item):
                continue
            if isinstance(item, Frustum) and relief < 1.0:
                continue
            shown.add(name)
            summit = max(summit, shapes.summit(item))
            lift = order * LAYER_GAP_PX + (summit * relief if shapes.is_flat(item) else 0.0)
            node = self._nodes.get(name)
            if node is not None and node.kind is not type(item):
                self._nodes.pop(name).handle.remove()
                node = None
            if node is None:
                self._nodes[name] = node = _Node(type(item), None)
            stance = Stance(relief, lift, apex)
            if node.source is not item or node.stance != stance:
                _SHOW[type(item)](self._server, name, node, item, stance)
                node.source, node.stance = item, stance
            node.handle.visible = True
        for name in self._nodes.keys() - shown:
            self._nodes[name].handle.visible = False
        self._forget(shown)

    def _forget(self, shown: set[str]) -> None:
        hidden = [name for name in self._nodes if name not in shown]
        for name in hidden[: max(0, len(hidden) - STALE_NODES)]:
            self._nodes.pop(name).handle.remove()


def _is_empty(item: Primitive) -> bool:
    match item:
        case Points():
            return len(item.positions) == 0
        case Polyline():
            return len(shapes.polyline_segments(item.positions)) == 0
        case Links():
            return len(item.segments) == 0
        case Mesh():
            return len(item.faces) == 0
        case _:
            return False


def _show_picture(server: viser.ViserServer, name: str, node: _Node, item: Picture, stance: Stance) -> None:
    rows, columns = item.image_rgb.shape[:2]
    # The origin is the centre of the top left pixel, so the plane begins half a pixel before it.
    centre = ((columns - 1) / 2.0, -(rows - 1) / 2.0, stance.lift)
    if node.handle is None:
        node.handle = server.scene.add_image(
            f"/{name}",
            item.image_rgb,
            float(columns),
            float(rows),
            format="jpeg",
            jpeg_quality=JPEG_QUALITY,
            cast_shadow=False,
            receive_shadow=False,
            wxyz=UPRIGHT_WXYZ,
            position=centre,
        )
        return
    if not (isinstance(node.source, Picture) and node.source.image_rgb is item.image_rgb):
        node.handle.image = item.image_rgb
        node.handle.render_width, node.handle.render_height = float(columns), float(rows)
    node.handle.position = centre


def _show_points(server: viser.ViserServer, name: str, node: _Node, item: Points, stance: Stance) -> None:
    # A point is a disc that faces the camera: half of one that lies in a tilted picture would vanish behind it.
    clear = replace(stance, lift=stance.lift + stance.relief * item.size)
    positions = shapes.to_scene(item.positions, clear)
    if node.handle is None:
        node.handle = server.scene.add_point_cloud(
            f"/{name}",
            positions,
            item.colours,
            point_size=item.size,
            point_shape="circle",
            point_shading="flat",
            precision="float32",
        )
        return
    node.handle.points = positions
    node.handle.colors = item.colours
    if node.look != item.size:
        node.handle.point_size = item.size
    node.look = item.size


def _show_lines(
    server: viser.ViserServer,
    name: str,
    node: _Node,
    segments: shapes.Floats,
    look: tuple[Colour, float],
    stance: Stance,
) -> None:
    points = shapes.to_scene(segments, stance)
    colours = np.asarray(look[0], dtype=np.uint8)
    thickness = max(1.5, look[1] * LINE_SCALE)
    if node.handle is None:
        node.handle = server.scene.add_line_segments(
            f"/{name}", points, colours, thickness=thickness, thickness_units="screen"
        )
        return
    node.handle.points = points
    if node.look != look:
        node.handle.colors = colours
        node.handle.thickness = thickness
    node.look = look


def _show_polyline(server: viser.ViserServer, name: str, node: _Node, item: Polyline, stance: Stance) -> None:
    _show_lines(server, name, node, shapes.polyline_segments(item.positions), (item.colour, item.width), stance)


def _show_ellipse(server: viser.ViserServer, name: str, node: _Node, item: Ellipse, stance: Stance) -> None:
    _show_lines(server, name, node, shapes.ellipse_segments(item), (item.colour, item.width), stance)


def _show_links(server: viser.ViserServer, name: str, node: _Node, item: Links, stance: Stance) -> None:
    _show_lines(server, name, node, item.segments, (item.colour, item.width), stance)


def _show_frustum(server: viser.ViserServer, name: str, node: _Node, item: Frustum, stance: Stance) -> None:
    # It is what the others lean towards, and leans nowhere itself.
    upright = replace(stance, apex=None)
    _show_lines(server, name, node, shapes.frustum_segments(item), (item.colour, item.width), upright)


def _show_axes(server: viser.ViserServer, name: str, node: _Node, item: Axes, stance: Stance) -> None:
    _show_lines(server, name, node, shapes.axes_segments(item), (item.colour, item.width), stance)


def _show_mesh(server: viser.ViserServer, name: str, node: _Node, item: Mesh, stance: Stance) -> None:
    # Pressed flat it still fills its own layer, so that what is behind does not shine through what is before it.
    height = max(float(item.vertices[:, 2].max()), 1.0)
    pressed = replace(stance, relief=max(stance.relief, 0.5 * LAYER_GAP_PX / height))
    vertices = shapes.to_scene(item.vertices, pressed)
    if node.handle is None:
        node.handle = server.scene.add_mesh_simple(
            f"/{name}",
            vertices,
            shapes.turned_over(item.faces),
            color=item.colour,
            opacity=item.opacity,
            # Through a translucent solid its far side would be seen as stains.
            side="front",
            cast_shadow=False,
            receive_shadow=False,
        )
        return
    node.handle.vertices = vertices
    if not (isinstance(node.source, Mesh) and np.array_equal(node.source.faces, item.faces)):
        node.handle.faces = shapes.turned_over(item.faces)
    if node.look != (item.colour, item.opacity):
        node.handle.color = item.colour
        node.handle.opacity = item.opacity
    node.look = item.colour, item.opacity


def _show_text(server: viser.ViserServer, name: str, node: _Node, item: Text, stance: Stance) -> None:
    x, y, z = (float(value) for value in shapes.to_scene(item.position, stance))
    if node.handle is None:
        node.handle = server.scene.add_label(
            f"/{name}",
            item.text,
            position=(x, y, z),
            anchor="bottom-center" if item.anchor == "middle" else "bottom-left",
        )
        return
    node.handle.text = item.text
    node.handle.position = (x, y, z)


_SHOW: dict[type[Primitive], Callable[[viser.ViserServer, str, _Node, Any, Stance], None]] = {
    Picture: _show_picture,
    Points: _show_points,
    Polyline: _show_polyline,
    Ellipse: _show_ellipse,
    Links: _show_links,
    Axes: _show_axes,
    Mesh: _show_mesh,
    Text: _show_text,
    Frustum: _show_frustum,
}
