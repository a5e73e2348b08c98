"""Surfaces that are written are read back by another program, with the same vertices, faces and colours."""

from io import BytesIO

import numpy as np
import pytest

from pftrack.experiments.head.experiment import front
from pftrack.vision.face import mean_model, person
from pftrack.vision.model_files import Surface, as_obj, upright
from tests.vision.refusing import refuse


@pytest.fixture(scope="module")
def surface() -> Surface:
    """The front of a head, coloured by the place of the vertex."""
    shape = front(person(102))
    colours = (np.arange(len(shape.vertices_mm))[:, None] * (1, 3, 7) % 256).astype(np.uint8)
    return Surface("a head", upright(shape.vertices_mm), shape.triangles[:, ::-1].copy(), colours)


def test_another_program_reads_it_back(surface: Surface) -> None:
    """Trimesh finds the same vertices and faces, and the colours beside them."""
    trimesh = pytest.importorskip("trimesh")
    read = trimesh.load(BytesIO(as_obj(surface)), file_type="obj", process=False, force="mesh")
    np.testing.assert_allclose(read.vertices, surface.vertices_mm, atol=1e-4)
    assert np.array_equal(read.faces, surface.faces)
    assert np.abs(read.visual.vertex_colors[:, :3].astype(int) - surface.colours).max() <= 1


def test_it_stands_upright(surface: Surface) -> None:
    """The nose looks to the viewer, the brows are above the mouth, and faces turn their outside outwards."""
    mean = dict(zip(mean_model().names, upright(mean_model().points_mm), strict=True))
    assert mean["nose"][2] == max(place[2] for place in mean.values())
    assert mean["lbro"][1] > mean["lmou"][1]
    a, b, c = (surface.vertices_mm[surface.faces[:, corner]] for corner in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).mean() > 0.9


def test_what_cannot_be_read_back_is_refused() -> None:
    """A colour that is missing, a vertex that is nowhere, a face of a vertex that is not there."""
    for level, last, count, words in (
        (0.0, 2, 2, r"expected colours of shape \(3, 3\), got \(2, 3\)"),
        (np.nan, 2, 3, "finite"),
        (0.0, 3, 3, "vertices 0 to 2"),
    ):
        faces, colours = np.array([[0, 1, last]], np.int32), np.zeros((count, 3), np.uint8)
        refuse(words, Surface, "none", np.full((3, 3), level), faces, colours)
