"""Nodes that viser offers only in another form: pictures from JPEG files, and meshes with vertex colours.

viser's `add_image` takes pixels and encodes them itself. It takes a mesh with a colour and an opacity for each vertex
as a file, which is sent whole after any change; while its client reads the new file, it shows neither. Here the mesh is
a plain white viser mesh, and its colours are sent as those of hidden points; `client/colours.js` copies them to the
vertices. Only changes are sent: 12 bytes per moved vertex, 4 per changed colour.
"""

import numpy as np
import viser
from numpy.typing import NDArray
from viser import _messages

SUFFIX = " colours"
"""Suffix of the mesh's name for its hidden points; `client/colours.js` looks for it."""
WHITE = (255, 255, 255)


class ColouredMesh:
    """A node of the scene.

    Args:
        server: The session's viser server.
        name: Name of the node.
        vertices: (n, 3), finite.
        faces: (m, 3), counterclockwise seen from outside; the inside is not shown.
        rgba: (n, 4) sRGB colours and opacities, 0..1.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        vertices: NDArray[np.float32],
        faces: NDArray[np.uint32],
        rgba: NDArray[np.float32],
    ) -> None:
        packed = _pack(rgba)
        self._colours = server.scene.add_point_cloud(
            name + SUFFIX, np.zeros_like(packed, dtype=np.float32), packed, visible=False
        )
        self._mesh = server.scene.add_mesh_simple(
            name,
            vertices,
            faces,
            color=WHITE,
            opacity=_opacity(rgba),
            side="front",
            cast_shadow=False,
            receive_shadow=False,
        )
        self._vertices, self._faces, self._packed = vertices, faces, packed

    def update(self, vertices: NDArray[np.float32], faces: NDArray[np.uint32], rgba: NDArray[np.float32]) -> None:
        """Show other vertices, triangles or colours; unchanged arrays are not sent again."""
        packed = _pack(rgba)
        if len(packed) != len(self._packed):
            self._colours.points = np.zeros_like(packed, dtype=np.float32)
        if not np.array_equal(packed, self._packed):
            self._colours.colors = packed
        if not np.array_equal(vertices, self._vertices):
            self._mesh.vertices = vertices
        if not np.array_equal(faces, self._faces):
            self._mesh.faces = faces
        if self._mesh.opacity != _opacity(rgba):
            self._mesh.opacity = _opacity(rgba)
        self._vertices, self._faces, self._packed = vertices, faces, packed

    @property
    def visible(self) -> bool:
        """Whether the mesh is shown."""
        return self._mesh.visible

    @visible.setter
    def visible(self, shown: bool) -> None:
        self._mesh.visible = shown

    def remove(self) -> None:
        """Remove the mesh from the scene."""
        self._mesh.remove()
        self._colours.remove()


def _pack(rgba: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return colours (n, 4) as rows of three bytes: all colours as RGB, then all opacities."""
    values = np.rint(255.0 * np.clip(rgba, 0.0, 1.0)).astype(np.uint8)
    opacities = np.resize(values[:, 3], (len(values) + 2) // 3 * 3)
    return np.concatenate([values[:, :3], opacities.reshape(-1, 3)])


def _opacity(rgba: NDArray[np.float32]) -> float | None:
    """Return viser's opacity of the whole mesh; only a translucent mesh must be blended."""
    return None if rgba[:, 3].min() >= 1.0 else 1.0


def add_jpeg(
    server: viser.ViserServer,
    name: str,
    file: bytes,
    extent: tuple[float, float],
    *,
    wxyz: tuple[float, float, float, float],
    position: tuple[float, float, float],
) -> viser.ImageHandle:
    """Add a picture to the scene as `add_image` does, without shadows.

    Args:
        server: Server of the scene.
        name: Name of the node.
        file: The JPEG file.
        extent: Width and height in the scene.
        wxyz: Its rotation, a quaternion.
        position: Its centre.
    """
    width, height = extent
    props = _messages.ImageProps(
        _format="jpeg",
        _data=file,
        render_width=width,
        render_height=height,
        cast_shadow=False,
        receive_shadow=False,
        scale=1.0,
    )
    message = _messages.ImageMessage(name=name, props=props)
    return viser.ImageHandle._make(server.scene, message, name, wxyz, position, visible=True)


def replace_jpeg(handle: viser.ImageHandle, file: bytes) -> None:
    """Replace the file of a picture from `add_jpeg`."""
    handle._data = file  # noqa: SLF001 - there is no public way
