"""What people drag in the scene: a particle or the estimate, with Shift held so that all else turns the camera.

viser lets one instance of a batched mesh be dragged, and no point of a cloud. So once a frame is shown for a while each
particle that is seen, and the estimate, is given a grip: an instance that nobody sees and that viser outlines under the
pointer. Where it is let go is looked at along the line of sight, at its own height above the picture.
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
"""Of the grip of the estimate, in those of a particle's."""
SMALLEST_PX = 2.0

CORNERS = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], np.float32)
FACES = np.array(
    [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)], dtype=np.uint32
)
"""A grip is an octahedron, of few faces since there are thousands."""


class Grips:
    """The grips of the frame that is shown.

    Args:
        server: The session's viser server.
        on_command: Takes a command, not yet validated.
    """

    def __init__(self, server: viser.ViserServer, on_command: Callable[[dict[str, Any]], None]) -> None:
        self._server, self._on_command = server, on_command
        self._node: viser.BatchedMeshHandle | None = None

    def remove(self) -> None:
        """Let go of whatever is held, since another frame or another view comes."""
        node, self._node = self._node, None
        if node is not None:
            node.remove()

    def place(self, scene: Scene, drawing: Drawing, frame: int, relief: float) -> None:
        """Give grips to what is seen of a drawing, if it lets itself be moved."""
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
            # A drag also ends where its node goes: nothing was let go then.
            if event.phase != "end" or self._node is not node or event.instance_index is None:
                return
            height, eye = positions[event.instance_index, 2], event.client.camera.position
            place = sight(eye, np.array(event.end_position), float(height))
            if place is not None:
                particle = event.instance_index if event.instance_index < len(places) else None
                self._on_command({"kind": "move", "frame": frame, "particle": particle, "place": place})


def sight(eye: Floats, through: Floats, height: float) -> tuple[float, float] | None:
    """Return where a line of sight comes to a height above the picture, px of the drawing; None if it never does."""
    with np.errstate(all="ignore"):
        reach = (height - eye[2]) / (through[2] - eye[2])
        x, y, _ = eye + reach * (through - eye)
    return (float(x), -float(y)) if reach > 0.0 and np.isfinite((x, y)).all() else None
