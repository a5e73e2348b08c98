"""A mesh with a colour and an opacity for each vertex, as binary glTF 2.0.

About 36 bytes a vertex and 12 a triangle. The format's unit is the metre, its y axis points up; the viewer of scenes,
which takes meshes of many colours in this form only, has its own.
"""

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["glb"]

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


def _normals(vertices: NDArray[np.float32], faces: NDArray[np.uint32]) -> NDArray[np.float64]:
    """Return a unit normal (n, 3) for each vertex: the mean of its triangles', weighted by their areas."""
    corners = vertices[faces].astype(np.float64)
    of_faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.stack(
        [np.bincount(faces.reshape(-1), np.repeat(of_faces[:, axis], 3), minlength=len(vertices)) for axis in range(3)],
        axis=1,
    )
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(lengths > 0.0, normals / np.where(lengths > 0.0, lengths, 1.0), (0.0, 0.0, 1.0))
