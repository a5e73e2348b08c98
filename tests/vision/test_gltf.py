"""Meshes with colours of their own are valid glTF that says what was drawn."""

import json
import struct
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.vision.model_files import glb

TETRAHEDRON = np.array(((0, 0, 0), (4, 0, 0), (0, 4, 0), (0, 0, 4)), dtype=np.float32)
OUTWARDS = np.array(((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)), dtype=np.uint32)
TYPES = {5126: "<f4", 5123: "<u2", 5125: "<u4"}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


def read(file: bytes) -> tuple[dict[str, Any], list[NDArray[Any]]]:
    """Return a file's document and its accessors' arrays, as glTF's standard says that they are found."""
    magic, version, total = struct.unpack_from("<4sII", file)
    assert (magic, version, total) == (b"glTF", 2, len(file))
    length, kind = struct.unpack_from("<I4s", file, 12)
    assert (length % 4, kind) == (0, b"JSON")
    document = json.loads(file[20 : 20 + length])
    size, kind = struct.unpack_from("<I4s", file, 20 + length)
    assert (size % 4, kind, size) == (0, b"BIN\0", document["buffers"][0]["byteLength"])
    binary = file[28 + length :]
    arrays = []
    for accessor in document["accessors"]:
        view = document["bufferViews"][accessor["bufferView"]]
        assert view["byteOffset"] % 4 == 0
        data = binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        arrays.append(np.frombuffer(data, TYPES[accessor["componentType"]]).reshape(-1, WIDTHS[accessor["type"]]))
        assert len(arrays[-1]) == accessor["count"]
    return document, arrays


def test_places_and_triangles_are_as_given() -> None:
    """The bounds that the format demands are those of the places."""
    document, (places, _, _, indices) = read(glb(TETRAHEDRON, OUTWARDS, np.ones((4, 4), dtype=np.float32)))
    np.testing.assert_array_equal(places, TETRAHEDRON)
    np.testing.assert_array_equal(indices.reshape(-1, 3), OUTWARDS)
    assert (document["accessors"][0]["min"], document["accessors"][0]["max"]) == ([0, 0, 0], [4, 4, 4])


def test_normals_point_outwards() -> None:
    """The corner that three equal triangles share looks along their mean; all are of unit length."""
    _, (_, normals, *_) = read(glb(TETRAHEDRON, OUTWARDS, np.ones((4, 4), dtype=np.float32)))
    np.testing.assert_allclose(normals[0], -np.ones(3) / np.sqrt(3.0), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-6)
    assert ((normals * (TETRAHEDRON - TETRAHEDRON.mean(axis=0))).sum(axis=1) > 0).all()


def test_a_vertex_of_no_triangle_has_a_normal_all_the_same() -> None:
    """A mesh that grows may hold points that are not joined yet."""
    lonely = np.concatenate((TETRAHEDRON, np.full((1, 3), 9, dtype=np.float32)))
    _, (_, normals, *_) = read(glb(lonely, OUTWARDS, np.ones((5, 4), dtype=np.float32)))
    np.testing.assert_array_equal(normals[4], (0, 0, 1))


@pytest.mark.parametrize(
    ("srgb", "linear"), [(0.0, 0.0), (0.04, 0.04 / 12.92), (0.5, 0.2140411), (0.735357, 0.5), (1.0, 1.0)]
)
def test_colours_are_in_proportion_to_light(srgb: float, linear: float) -> None:
    """Half of the light is 188 of 255; opacity stays as it is."""
    rgba = np.full((4, 4), srgb, dtype=np.float32)
    document, (_, _, colours, _) = read(glb(TETRAHEDRON, OUTWARDS, rgba))
    assert document["accessors"][2]["normalized"] is True
    np.testing.assert_allclose(colours[:, :3] / 65535.0, linear, atol=2e-5)
    np.testing.assert_allclose(colours[:, 3] / 65535.0, srgb, atol=2e-5)


def test_what_is_opaque_is_drawn_as_such() -> None:
    """Only a mesh through which something is seen has to be blended."""
    rgba = np.ones((4, 4), dtype=np.float32)
    assert read(glb(TETRAHEDRON, OUTWARDS, rgba))[0]["materials"][0]["alphaMode"] == "OPAQUE"
    rgba[2, 3] = 0.5
    assert read(glb(TETRAHEDRON, OUTWARDS, rgba))[0]["materials"][0]["alphaMode"] == "BLEND"
