"""Drag particles and the estimate in the scene: Shift and the left button; without Shift the camera turns.

viser can drag one instance of a batched mesh but not a point of a cloud. Once a frame has been shown for a moment, each
visible particle and the estimate therefore get a grip: an invisible instance that viser outlines under the pointer. On
release, the line of sight through the pointer is intersected with the plane at the height of the grip.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import Drawing, Points
from pftrack_server.viewer import shapes
from pftrack_server.viewer.scene import Scene
from pftrack_server.viewer.shapes import Stance

ESTIMATE_SIZE = 3.0
"""Size of the estimate's grip relative to that of a particle."""
SMALLEST_PX = 2.0
"""Smallest size of a grip, px."""

CORNERS = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], np.float32)
FACES = np.array(
    [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)], dtype=np.uint32
)
"""A grip is an octahedron, of few faces since there are thousands."""


class Grips:
    """The grips of the shown frame.

    Args:
        server: The session's viser server.
        on_command: Takes a command, not yet validated.
    """

    def __init__(self, server: viser.ViserServer, on_command: Callable[[dict[str, Any]], None]) -> None:
        self._server, self._on_command = server, on_command
        self._node: viser.BatchedMeshHandle | None = None

    def remove(self) -> None:
        """Remove the grips, which ends a drag without a move."""
        node, self._node = self._node, None
        if node is not None:
            node.remove()

    def place(self, scene: Scene, drawing: Drawing, frame: int, relief: float) -> None:
        """Place grips on the visible particles of a drawing and on its estimate, if these can be moved.

        Args:
            scene: The scene, which knows the shown layers.
            drawing: The shown drawing.
            frame: Its frame number.
            relief: 0 for a flat scene to 1 for full height.
        """
        self.remove()
        if drawing.grip is None or not np.isfinite(drawing.grip).all():
            return
        seen = (each for each in drawing.primitives.values() if isinstance(each, Points) and each.stems)
        cloud = next((each for each in seen if scene.is_seen(each, relief)), None)
        places, size = (np.empty((0, 3), np.float32), 0.0) if cloud is None else (cloud.positions, cloud.size)
        size = max(size, SMALLEST_PX)
        positions = shapes.to_scene(np.concatenate([places, drawing.grip[None]]), Stance(relief, relief * size))
        scales = np.full(len(positions), size, np.float32)
        scales[-1] *= ESTIMATE_SIZE
        self._node = node = self._server.scene.add_batched_meshes_simple(
            "/grips",
            CORNERS,
            FACES,
            np.tile(np.array((1.0, 0.0, 0.0, 0.0), np.float32), (len(positions), 1)),
            positions,
            batched_scales=scales,
            opacity=0.0,
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )

        @node.on_drag("left", modifier="shift")
        async def _(event: viser.SceneNodeDragEvent[viser.BatchedMeshHandle]) -> None:
            # Removing the node also ends a drag; nothing was released then.
            index, through = event.instance_index, np.asarray(event.end_position, np.float64)
            if event.phase != "end" or self._node is not node or index is None:
                return
            if not 0 <= index < len(positions) or through.shape != (3,):  # a browser may send anything
                return
            place = intersect(event.client.camera.position, through, float(positions[index, 2]))
            if place is not None:
                particle = index if index < len(places) else None
                self._on_command({"kind": "move", "frame": frame, "particle": particle, "place": place})


def intersect(eye: Floats, through: Floats, height: float) -> tuple[float, float] | None:
    """Return where a line of sight meets a plane parallel to the picture, px of the drawing; None if it never does.

    Args:
        eye: (3,) position of the camera, px of the scene.
        through: (3,) another point of the line, px of the scene.
        height: Height of the plane above the picture, px.
    """
    with np.errstate(all="ignore"):
        reach = (height - eye[2]) / (through[2] - eye[2])
        x, y, _ = eye + reach * (through - eye)
    return (float(x), -float(y)) if reach > 0.0 and np.isfinite((x, y)).all() else None
