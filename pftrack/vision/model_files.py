"""Files of models, for other programs: surfaces (OBJ, PLY, glTF), and named points (JSON).

All units are stated: in OBJ, PLY and JSON they are mm, in glTF the metre, as that format demands.
"""

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats

# Binary glTF 2.0 has about 36 bytes a vertex and 12 a triangle. Its unit is the metre, its y axis points up; the viewer
# of scenes, which takes meshes of many colours in this form only, has its own.

MAGIC, VERSION = 0x46546C67, 2
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
FLOAT, UNSIGNED_SHORT, UNSIGNED_INT = 5126, 5123, 5125


def glb(vertices: NDArray[np.float32], faces: NDArray[np.uint32], rgba: NDArray[np.float32]) -> bytes:
    """Return a mesh as a file.

    Args:
        vertices: (n, 3), finite.
        faces: (m, 3), counterclockwise seen from outside; the other side is not shown.
        rgba: (n, 4) sRGB colours and opacities, 0..1.
    """
    colours = np.rint(65535.0 * np.column_stack((_linear(rgba[:, :3]), rgba[:, 3]))).astype("<u2")
    views = (
        (vertices.astype("<f4"), FLOAT, "VEC3", ARRAY_BUFFER),
        (_normals(vertices, faces).astype("<f4"), FLOAT, "VEC3", ARRAY_BUFFER),
        (colours, UNSIGNED_SHORT, "VEC4", ARRAY_BUFFER),
        (faces.astype("<u4").reshape(-1), UNSIGNED_INT, "SCALAR", ELEMENT_ARRAY_BUFFER),
    )
    accessors: list[dict[str, Any]] = [
        {"bufferView": number, "componentType": component, "count": len(array), "type": shape}
        for number, (array, component, shape, _) in enumerate(views)
    ]
    accessors[0] |= {"min": vertices.min(axis=0).tolist(), "max": vertices.max(axis=0).tolist()}
    accessors[2]["normalized"] = True
    offsets = np.cumsum([0, *(array.nbytes for array, *_ in views)]).tolist()
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 0, "NORMAL": 1, "COLOR_0": 2}, "indices": 3, "material": 0},
                ]
            }
        ],
        "materials": [
            {
                "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0},
                "alphaMode": "OPAQUE" if rgba[:, 3].min() >= 1.0 else "BLEND",
            }
        ],
        "accessors": accessors,
        "bufferViews": [
            {"buffer": 0, "byteOffset": offset, "byteLength": array.nbytes, "target": target}
            for offset, (array, _, _, target) in zip(offsets, views, strict=False)
        ],
        "buffers": [{"byteLength": offsets[-1]}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary = b"".join(array.tobytes() for array, *_ in views)  # each is a multiple of 4 bytes long
    total = 12 + 8 + len(text) + 8 + len(binary)
    header = struct.pack("<III", MAGIC, VERSION, total)
    chunks = struct.pack("<II", len(text), JSON_CHUNK) + text + struct.pack("<II", len(binary), BINARY_CHUNK) + binary
    return header + chunks


def _linear(srgb: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return sRGB values, 0..1, as glTF wants them: in proportion to light (IEC 61966-2-1)."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _normals(vertices: NDArray[np.float32], faces: NDArray[np.uint32]) -> Floats:
    """Return a unit normal (n, 3) for each vertex: the mean of its triangles', weighted by their areas."""
    corners = vertices[faces].astype(np.float64)
    of_faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.stack(
        [np.bincount(faces.reshape(-1), np.repeat(of_faces[:, axis], 3), minlength=len(vertices)) for axis in range(3)],
        axis=1,
    )
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(lengths > 0.0, normals / np.where(lengths > 0.0, lengths, 1.0), (0.0, 0.0, 1.0))


# Named points as JSON say what a model is, with unit and standard deviations, and can be read back as one:
#
#     {"format": "pftrack points", "version": 1, "unit": "mm", "points": {"nose": [0.0, 38.1, -26.2], ...}, ...}
#
# What is read comes from strangers. It must be small, of the present format, in mm, and have the names that are asked
# for, each with three finite numbers of a size that a body can have; anything beyond that is passed over.

FORMAT, POINTS_VERSION, UNIT = "pftrack points", 1, "mm"
LONGEST_CHARACTERS = 100_000
LARGEST_MM = 10_000.0
DECIMALS = 4


def as_json(names: Sequence[str], points_mm: Floats, **said: Any) -> bytes:  # noqa: ANN401 - JSON
    """Return points (n, 3) by name, and what else is said of them, as a JSON object.

    Args:
        names: (n,).
        points_mm: (n, 3).
        said: Further entries, JSON values.
    """
    head = {"format": FORMAT, "version": POINTS_VERSION, "unit": UNIT}
    points = dict(zip(names, np.round(points_mm, DECIMALS).tolist(), strict=True))
    return (json.dumps({**head, "points": points, **said}, indent=1, ensure_ascii=False) + "\n").encode()


def read_points(text: str | bytes, names: Sequence[str]) -> Floats:
    """Return the points (n, 3) of these names, mm.

    Raises:
        ValueError: It is too large, no such file, has other points than these, or a number is not finite or too large.
    """
    if len(text) > LONGEST_CHARACTERS:
        raise ValueError(f"expected a file of at most {LONGEST_CHARACTERS} characters, got {len(text)}")
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise ValueError("expected a JSON file of points, got something else") from None
    if not isinstance(found, Mapping) or found.get("format") != FORMAT or not isinstance(found.get("points"), Mapping):
        raise ValueError(f"expected a JSON object of the format {FORMAT!r} with points, got another one")
    if found.get("version") != POINTS_VERSION or found.get("unit") != UNIT:
        raise ValueError(f"expected version {POINTS_VERSION} in {UNIT}, got another version or unit")
    points = found["points"]
    if len(points) != len(names):
        raise ValueError(f"expected a model of {len(names)} points, got {len(points)}")
    missing = [name for name in names if name not in points]
    if missing:
        raise ValueError(f"expected the points {', '.join(names)}, got none for {', '.join(missing)}")
    return np.array([_point(name, points[name]) for name in names])


def _point(name: str, raw: object) -> tuple[float, ...]:
    numbers = raw if isinstance(raw, list) else []
    if len(numbers) != 3 or not all(isinstance(one, int | float) and not isinstance(one, bool) for one in numbers):
        raise ValueError(f"expected three numbers (x, y, z) for {name}")
    # A whole number of JSON may be too large to be a float; comparisons with NaN are false.
    if not all(-LARGEST_MM <= one <= LARGEST_MM for one in numbers):
        raise ValueError(f"expected numbers of -{LARGEST_MM:g} to {LARGEST_MM:g} mm for {name}")
    return tuple(float(one) for one in numbers)


# A head's own frame has y down and z away from the camera, as pictures have it. Other programs have y up and look along
# -z, so a surface is turned by half a turn about x before it is written as OBJ or PLY. Its triangles run
# counterclockwise as seen from outside, as both formats have it. Numbers have four decimals, a ten-thousandth of a mm.

MM_IN_M = 1000.0
HALF_TURN: Floats = np.array([1.0, -1.0, -1.0])


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
    vertices_mm: Floats
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


def upright(points_mm: Floats) -> Floats:
    """Return points (n, 3) of a head's frame as other programs have them, x to the right, y up, z to the viewer."""
    turned: Floats = HALF_TURN * points_mm
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
