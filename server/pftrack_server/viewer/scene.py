"""The scene: a drawing's primitives as viser nodes, updated in place.

A primitive keeps its name from frame to frame, so each name is one node. Only its changed arrays are replaced, which
costs half or a third of adding the node again. A name that is missing in a frame is hidden, not removed, because it
usually returns (an estimate that is lost for a while). A hidden layer is not sent at all.

All nodes of a frame change within one atomic block, so that a browser never shows the particles of one frame on the
picture of another.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np
import viser

from pftrack.core.model import drawing as model
from pftrack.experiments.shared.sketch import raised
from pftrack_server.core.pictures import EncodedPicture, SceneDrawing
from pftrack_server.viewer import shapes, viser_handles, worlds
from pftrack_server.viewer.camera import Box
from pftrack_server.viewer.shapes import Stance

LAYER_GAP_PX = 0.05
"""Height step between primitives, so that those painted later lie on top."""
AMBIENT_LIGHT = 2.0
"""Intensity with which colours are about as bright as under viser's environment map."""
LINE_SCALE = 1.6
"""Screen pixels per unit of line width: a picture is usually shown at about twice its size."""
POINT_SIZE = 0.5
"""Factor on point sizes: viser's size is a radius."""
UPRIGHT_WXYZ = (0.0, 1.0, 0.0, 0.0)
"""Half a turn about x: viser lays an image face down with its rows along y."""
STALE_NODES = 64
"""Most hidden nodes to keep for their return."""
ANCHORS: dict[str, Literal["bottom-left", "bottom-center", "bottom-right"]] = {
    "start": "bottom-left",
    "middle": "bottom-center",
    "end": "bottom-right",
}


@dataclass(slots=True)
class Node:
    """A node of the scene, and its content.

    Attributes:
        show: Function that shows it.
        handle: viser's handle, once it exists.
        source: The primitive or the picture that it shows.
        look: Its seldom changing properties; viser takes longer to compare them than to send them.
        points: The points of its lines in the scene; those of a frame or an axis seldom change.
        stance: Its stance.
    """

    show: "Show"
    handle: Any  # viser's handles share `visible` and `remove`, and no type that mypy can follow through `__setattr__`
    source: model.Primitive | EncodedPicture | None = None
    look: object = None
    points: shapes.Floats | None = None
    stance: Stance | None = None


def is_on(layer: model.Layer) -> bool:
    """Return whether a layer is shown at first; layers over time are, since the scene has depth."""
    return layer.shown or layer.role == "through time"


def _is_empty(item: model.Primitive | EncodedPicture) -> bool:
    """Return whether a primitive shows nothing."""
    match item:
        case model.Points() | model.Ellipsoids():
            return len(item.positions if isinstance(item, model.Points) else item.centres) == 0
        case model.Polyline() | model.Links() | model.Arrows():
            return len(shapes.segments(item)) == 0
        case model.Mesh():
            return len(item.faces) == 0 or not np.isfinite(item.vertices).all()
        case _:
            return False


def _show_picture(server: viser.ViserServer, name: str, node: Node, item: EncodedPicture, stance: Stance) -> None:
    # The origin is the centre of the top left pixel, so the plane begins half a pixel before it.
    centre = ((item.width - 1) / 2.0, -(item.height - 1) / 2.0, stance.lift)
    extent = float(item.width), float(item.height)
    if node.handle is None:
        node.handle = viser_handles.add_jpeg(server, f"/{name}", item.file, extent, wxyz=UPRIGHT_WXYZ, position=centre)
    elif not (isinstance(node.source, EncodedPicture) and node.source.file == item.file):
        viser_handles.replace_jpeg(node.handle, item.file)
    if node.look != (extent, centre):
        node.handle.render_width, node.handle.render_height = extent
        node.handle.position = centre
    node.look = extent, centre


def _show_points(server: viser.ViserServer, name: str, node: Node, item: model.Points, stance: Stance) -> None:
    # A point is a disc that faces the camera: in the plane of a tilted picture, half of it would be hidden.
    clear = stance if stance.free else replace(stance, lift=stance.lift + stance.relief * item.size)
    positions = shapes.to_scene(item.positions, clear)
    if node.handle is None:
        node.handle = server.scene.add_point_cloud(
            f"/{name}",
            positions,
            item.colours,
            point_size=item.size * POINT_SIZE,
            point_shape="circle",
            point_shading="flat",
            precision="float32",
        )
        return
    node.handle.points = positions
    node.handle.colors = item.colours
    if node.look != item.size:
        node.handle.point_size = item.size * POINT_SIZE
    node.look = item.size


def _show_lines(server: viser.ViserServer, name: str, node: Node, item: shapes.Lines, stance: Stance) -> None:
    # Other primitives lean towards the frustum; it does not lean itself.
    upright = replace(stance, apex=None) if isinstance(item, model.Frustum) else stance
    points = shapes.to_scene(shapes.segments(item), upright)
    look = item.colour, item.width
    colours = np.asarray(item.colour, dtype=np.uint8)
    thickness = max(1.0, item.width * LINE_SCALE)
    if node.handle is None:
        node.handle = server.scene.add_line_segments(
            f"/{name}", points, colours, thickness=thickness, thickness_units="screen"
        )
    elif node.points is None or not np.array_equal(node.points, points):
        node.handle.points = points
    if node.look not in {None, look}:
        node.handle.colors = colours
        node.handle.thickness = thickness
    node.look, node.points = look, points


def _show_ellipsoids(server: viser.ViserServer, name: str, node: Node, item: model.Ellipsoids, stance: Stance) -> None:
    placed = shapes.bodies(item, stance)
    look = len(item.centres), item.opacity
    if node.handle is not None and node.look != look:
        node.handle.remove()
        node.handle = None
    node.look = look
    if node.handle is None:
        vertices, faces = shapes.BALL
        node.handle = server.scene.add_batched_meshes_simple(
            f"/{name}",
            vertices,
            faces,
            placed.wxyz,
            placed.centres,
            batched_scales=placed.half_axes,
            batched_colors=item.colours,
            opacity=item.opacity,
            lod="off",
        )
        return
    node.handle.batched_positions = placed.centres
    node.handle.batched_wxyzs = placed.wxyz
    node.handle.batched_scales = placed.half_axes
    node.handle.batched_colors = item.colours


def _show_mesh(server: viser.ViserServer, name: str, node: Node, item: model.Mesh, stance: Stance) -> None:
    if node.handle is None:
        assert not isinstance(item.colour, np.ndarray)  # noqa: S101 - for mypy
        assert not isinstance(item.opacity, np.ndarray)  # noqa: S101
        node.handle = server.scene.add_mesh_simple(
            f"/{name}",
            _flatten(item, stance),
            shapes.turn_over(item.faces),
            color=item.colour,
            opacity=item.opacity,
            # The far side of a translucent solid would show as stains.
            side="front",
        )
        return
    before = node.source
    assert isinstance(before, model.Mesh)  # noqa: S101 - for mypy: a node shows one kind of primitive
    if node.stance != stance or not np.array_equal(before.vertices, item.vertices):
        node.handle.vertices = _flatten(item, stance)
    if not np.array_equal(before.faces, item.faces):
        node.handle.faces = shapes.turn_over(item.faces)
    if (before.colour, before.opacity) != (item.colour, item.opacity):
        node.handle.color = item.colour
        node.handle.opacity = item.opacity


def _show_coloured_mesh(server: viser.ViserServer, name: str, node: Node, item: model.Mesh, stance: Stance) -> None:
    parts = _flatten(item, stance), shapes.turn_over(item.faces), item.rgba
    if node.handle is None:
        node.handle = viser_handles.ColouredMesh(server, f"/{name}", *parts)
    else:
        node.handle.update(*parts)


def _flatten(item: model.Mesh, stance: Stance) -> shapes.Floats:
    """Return a mesh's vertices in the scene.

    Even a flat mesh fills its own layer, so that its back does not shine through its front.
    """
    height = max(float(item.vertices[:, 2].max()), 1.0)
    return shapes.to_scene(item.vertices, replace(stance, relief=max(stance.relief, 0.5 * LAYER_GAP_PX / height)))


def _show_text(server: viser.ViserServer, name: str, node: Node, item: model.Text, stance: Stance) -> None:
    x, y, z = shapes.to_scene(item.position, stance).tolist()
    # Outside the picture there is room, and people can move closer to read a name.
    look = item.title or item.text, (x, y, z)
    if node.handle is None:
        node.handle = server.scene.add_label(f"/{name}", look[0], position=look[1], anchor=ANCHORS[item.anchor])
    elif node.look != look:
        node.handle.text, node.handle.position = look
    node.look = look


Show: TypeAlias = Callable[[viser.ViserServer, str, Node, Any, Stance], None]

_SHOW: dict[type[model.Primitive | EncodedPicture], Show] = {
    EncodedPicture: _show_picture,
    model.Points: _show_points,
    model.Ellipsoids: _show_ellipsoids,
    model.Mesh: _show_mesh,
    model.Text: _show_text,
}


def _way_to_show(item: model.Primitive | EncodedPicture) -> Show:
    """Return the function that shows a primitive; another function needs another node."""
    many = isinstance(item, model.Mesh) and not item.is_uniform
    return _show_coloured_mesh if many else _SHOW.get(type(item), _show_lines)


class Scene:
    """The scene of one session, in all of its browsers.

    Args:
        server: The session's own viser server.
        layers: Layers that can be switched on and off.
    """

    def __init__(self, server: viser.ViserServer, layers: Iterable[model.Layer]) -> None:
        self._server = server
        self._layers = {layer.name: is_on(layer) for layer in layers}
        self._roles = {layer.name: layer.role for layer in layers}
        self._nodes: dict[str, Node] = {}
        server.scene.set_up_direction("+y")
        server.scene.world_axes.visible = False
        server.scene.configure_default_lights(enabled=True, cast_shadow=False)
        # Software rendering takes seconds to filter viser's environment map.
        server.scene.configure_environment_map(None)
        server.scene.add_light_ambient("/light", intensity=AMBIENT_LIGHT)

    def set_layer(self, layer: str, *, shown: bool) -> None:
        """Show or hide a layer from the next drawing on."""
        self._layers[layer] = shown

    def legend(self, drawing: model.Drawing, relief: float) -> list[model.Key]:
        """Return the keys of a drawing's legend for the shown layers."""
        return [key for layer, key in drawing.legend if self._is_on(layer, relief)]

    def box(self, drawing: model.Drawing) -> Box:
        """Return the box of a drawing's visible part."""
        shown = [item for item in drawing.primitives.values() if self._is_on(item.layer, 1.0)]
        cameras = (shapes.to_scene(item.apex, Stance(1.0, 0.0)) for item in shown if isinstance(item, model.Frustum))
        apex = next((tuple(place.tolist()) for place in cameras), None)
        beside = worlds.beside(len(drawing.worlds), drawing.height)
        return Box(drawing.width, drawing.height, shapes.depth(shown), apex, shapes.behind(shown), beside)

    def apply(self, what: SceneDrawing, relief: float) -> None:
        """Make the scene show a drawing; the caller holds the server's atomic block.

        Args:
            what: The drawing.
            relief: Factor on the heights above the picture.
        """
        drawing = what.drawing
        shown: set[str] = set()
        apex = None if drawing.apex is None else tuple(drawing.apex.tolist())
        for order, (name, item) in enumerate(drawing.primitives.items()):
            if not self.is_seen(item, relief) or (isinstance(item, model.Frustum) and relief < 1.0):
                continue
            stance = Stance(relief, order * LAYER_GAP_PX, apex)
            parts = {name: what.pictures.get(name, item)}
            more = raised(item, drawing.width, drawing.height) if relief > 0.0 else None
            if more is not None and not _is_empty(more):
                parts[f"{name} raised"] = more
            shown |= parts.keys()
            for each, part in parts.items():
                self._show(each, part, stance)
        for name, item in worlds.place_worlds(drawing):
            if self.is_seen(item, relief):
                shown.add(name)
                self._show(name, item, shapes.FREE)
        for name in self._nodes.keys() - shown:
            self._nodes[name].handle.visible = False
        self._forget(shown)

    def is_seen(self, item: model.Primitive, relief: float) -> bool:
        """Return whether a primitive is visible, on a shown layer."""
        return self._is_on(item.layer, relief) and not _is_empty(item)

    def _is_on(self, layer: str, relief: float) -> bool:
        elsewhere = "flat only" if relief > 0.0 else "through time"
        return self._layers.get(layer, True) and self._roles.get(layer) != elsewhere

    def _show(self, name: str, item: model.Primitive | EncodedPicture, stance: Stance) -> None:
        show = _way_to_show(item)
        node = self._nodes.get(name) or Node(show, None)
        if node.show is not show:
            self._nodes.pop(name).handle.remove()
            node = Node(show, None)
        if node.source is not item or node.stance != stance:
            show(self._server, name, node, item, stance)
            node.source, node.stance = item, stance
        # A node that could not be shown even once has no handle to hide.
        self._nodes[name] = node
        node.handle.visible = True

    def _forget(self, shown: set[str]) -> None:
        hidden = [name for name in self._nodes if name not in shown]
        for name in hidden[: max(0, len(hidden) - STALE_NODES)]:
            self._nodes.pop(name).handle.remove()
