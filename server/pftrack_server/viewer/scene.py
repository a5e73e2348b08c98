"""The scene: a drawing's primitives as viser nodes, updated in place.

A primitive keeps its name from frame to frame, so each name is one node, which `nodes` keeps up to date. A name that is
absent from a frame is hidden, not removed, because it usually comes back (an estimate that is lost for a while). A
hidden layer is not sent at all.

All nodes of a frame change within one atomic block, so that a browser never shows the particles of one frame on the
picture of another.
"""

from collections.abc import Iterable

import viser

from pftrack.core.model.drawing import Drawing, Frustum, Key, Layer, Primitive
from pftrack_server.core.pictures import EncodedPicture, SceneDrawing
from pftrack_server.viewer import shapes, worlds
from pftrack_server.viewer.camera import Box
from pftrack_server.viewer.nodes import LAYER_GAP_PX, Node, is_empty, way_to_show
from pftrack_server.viewer.shapes import Stance

STALE_NODES = 64
"""How many hidden nodes are kept for their return."""


class Scene:
    """What is shown of one session, in all of its browsers.

    Args:
        server: The session's own viser server.
        layers: What can be switched on and off.
    """

    def __init__(self, server: viser.ViserServer, layers: Iterable[Layer]) -> None:
        self._server = server
        self._layers = {layer.name: layer.shown for layer in layers}
        self._nodes: dict[str, Node] = {}
        server.scene.set_up_direction("+y")
        server.scene.world_axes.visible = False
        server.scene.configure_default_lights(enabled=True, cast_shadow=False)

    def set_layer(self, layer: str, *, shown: bool) -> None:
        """Show or hide a layer from the next drawing on."""
        self._layers[layer] = shown

    def legend(self, drawing: Drawing) -> list[Key]:
        """Return the keys of a drawing's legend that are about layers that are shown."""
        return [key for layer, key in drawing.legend if self._layers.get(layer, True)]

    def box(self, drawing: Drawing) -> Box:
        """Return the visible part of a drawing."""
        shown = [item for item in drawing.primitives.values() if self._layers.get(item.layer, True)]
        cameras = (shapes.to_scene(item.apex, Stance(1.0, 0.0)) for item in shown if isinstance(item, Frustum))
        apex = next((tuple(place.tolist()) for place in cameras), None)
        return Box(drawing.width, drawing.height, shapes.depth(shown), apex)

    def apply(self, what: SceneDrawing, relief: float) -> None:
        """Make the scene show a drawing; the caller holds the server's atomic block.

        Args:
            what: What is to be seen.
            relief: Factor on the heights above the picture.
        """
        drawing = what.drawing
        shown: set[str] = set()
        summit = 0.0
        apex = None if drawing.apex is None else tuple(drawing.apex.tolist())
        for order, (name, item) in enumerate(drawing.primitives.items()):
            if not self._is_seen(item) or (isinstance(item, Frustum) and relief < 1.0):
                continue
            shown.add(name)
            summit = max(summit, shapes.summit(item))
            lift = order * LAYER_GAP_PX + (summit * relief if shapes.is_flat(item) else 0.0)
            self._show(name, what.pictures.get(name, item), Stance(relief, lift, apex))
        for name, item in worlds.place_worlds(drawing):
            if self._is_seen(item):
                shown.add(name)
                self._show(name, item, shapes.FREE)
        for name in self._nodes.keys() - shown:
            self._nodes[name].handle.visible = False
        self._forget(shown)

    def _is_seen(self, item: Primitive) -> bool:
        return self._layers.get(item.layer, True) and not is_empty(item)

    def _show(self, name: str, item: Primitive | EncodedPicture, stance: Stance) -> None:
        show = way_to_show(item)
        node = self._nodes.get(name)
        if node is not None and node.show is not show:
            self._nodes.pop(name).handle.remove()
            node = None
        if node is None:
            node = Node(show, None)
        if node.source is not item or node.stance != stance:
            show(self._server, name, node, item, stance)
            node.source, node.stance = item, stance
        # One that could not be shown for the first time has no handle to be hidden by.
        self._nodes[name] = node
        node.handle.visible = True

    def _forget(self, shown: set[str]) -> None:
        hidden = [name for name in self._nodes if name not in shown]
        for name in hidden[: max(0, len(hidden) - STALE_NODES)]:
            self._nodes.pop(name).handle.remove()
