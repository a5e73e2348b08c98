"""A surface as OBJ or PLY, and turned upright for other programs.

A head's own frame has y down and z away from the camera, as pictures have it. Other programs have y up and look along
-z, so a surface is turned by half a turn about x before it is written. Its triangles run counterclockwise as seen from
outside, as both formats have it. Numbers have four decimals, a ten-thousandth of a mm.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.vision.model_files.gltf import glb

__all__ = ["Surface", "as_glb", "as_obj", "as_ply", "upright"]

MM_IN_M = 1000.0
HALF_TURN: NDArray[np.float64] = np.array([1.0, -1.0, -1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A triangle mesh with colours.

    Attributes:
        title: What it is, one line.
        vertices_mm: (n, 3).
        faces: (m, 3) numbers of vertices, counterclockwise as seen from outside.
        colours: (n, 3) RGB, 0..255.

    Raises:
        ValueError: There is not one colour for each vertex, a vertex is not finite, or a face has one that is not.
    """

    title: str
    vertices_mm: NDArray[np.float64]
    faces: NDArray[np.int32]
    colours: NDArray[np.uint8]

    def __post_init__(self) -> None:
        """Refuse what no program could read back."""
        count = len(self.vertices_mm)
        if self.colours.shape != (count, 3):
            raise ValueError(f"expected colours of shape {(count, 3)}, got {self.colours.shape}")
        if not np.isfinite(self.vertices_mm).all():
            raise ValueError("expected finite vertices, got one that is not")
        if len(self.faces) and not 0 <= self.faces.min() <= self.faces.max() < count:
            raise ValueError(f"expected faces of vertices 0 to {count - 1}, got {self.faces.min()}, {self.faces.max()}")


def upright(points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points (n, 3) of a head's frame as other programs have them, x to the right, y up, z to the viewer."""
    turned: NDArray[np.float64] = HALF_TURN * points_mm
    return turned


def as_obj(surface: Surface) -> bytes:
    """Return a surface as OBJ, in mm, with a colour after each vertex, which not all programs read."""
    lines = [f"# {surface.title}", "# unit: mm"]
    rows = zip(surface.vertices_mm.tolist(), (surface.colours / 255.0).tolist(), strict=True)
    lines += [f"v {x:.4f} {y:.4f} {z:.4f} {r:.4f} {g:.4f} {b:.4f}" for (x, y, z), (r, g, b) in rows]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in surface.faces.tolist()]
    return ("\n".join(lines) + "\n").encode()


def as_ply(surface: Surface) -> bytes:
    """Return a surface as PLY 1.0 in text, in mm, with a colour for each vertex."""
    lines = ["ply", "format ascii 1.0", f"comment {surface.title}", "comment unit: mm"]
    lines.append(f"element vertex {len(surface.vertices_mm)}")
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"property uchar {colour}" for colour in ("red", "green", "blue")]
    lines += [f"element face {len(surface.faces)}", "property list uchar int vertex_indices", "end_header"]
    rows = zip(surface.vertices_mm.tolist(), surface.colours.tolist(), strict=True)
    lines += [f"{x:.4f} {y:.4f} {z:.4f} {r} {g} {b}" for (x, y, z), (r, g, b) in rows]
    lines += [f"3 {a} {b} {c}" for a, b, c in surface.faces.tolist()]
    return ("\n".join(lines) + "\n").encode()


def as_glb(surface: Surface) -> bytes:
    """Return a surface as binary glTF, in m."""
    rgba = np.ones((len(surface.colours), 4), np.float32)
    rgba[:, :3] = surface.colours / np.float32(255.0)
    vertices = (surface.vertices_mm / MM_IN_M).astype(np.float32)
    return glb(vertices, surface.faces.astype(np.uint32), rgba)
