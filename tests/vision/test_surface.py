"""Surfaces that are written are read back by another program, with the same vertices, faces and colours."""

from io import BytesIO

import numpy as np
import pytest

from pftrack.experiments.head.experiment import front
from pftrack.vision.face import person
from pftrack.vision.model_files import Surface, as_obj, upright


def test_another_program_reads_it_back() -> None:
    """Trimesh finds the same vertices and faces of the front of a head, and a colour for the place of each vertex."""
    trimesh = pytest.importorskip("trimesh")
    shape = front(person(102))
    colours = (np.arange(len(shape.vertices_mm))[:, None] * (1, 3, 7) % 256).astype(np.uint8)
    surface = Surface("a head", upright(shape.vertices_mm), shape.triangles[:, ::-1].copy(), colours)
    read = trimesh.load(BytesIO(as_obj(surface)), file_type="obj", process=False, force="mesh")
    np.testing.assert_allclose(read.vertices, surface.vertices_mm, atol=1e-4)
    assert np.array_equal(read.faces, surface.faces)
    assert np.abs(read.visual.vertex_colors[:, :3].astype(int) - surface.colours).max() <= 1
