import numpy as np
import pytest

from pftrack.vision.face import ANCHORS_MM, HeadSurface, egg_depth, head_mesh, mean_model, person


@pytest.mark.parametrize("seed", [99, 101, 102])
def test_surface_passes_through_the_features(seed: int) -> None:
    """At every feature the surface has the feature's depth, to the softness of the correction (section 15, test 11)."""
    model = person(seed)
    x, y, z = model.points_mm.T
    assert np.abs(HeadSurface(model).depth(x, y) - z).max() < 0.2


def test_surface_keeps_to_the_egg_elsewhere() -> None:
    """At forehead and cheeks the surface is the egg's; at the chin it is 14 mm nearer."""
    x, y = np.array(ANCHORS_MM).T
    added = HeadSurface(mean_model()).correction(x, y)
    assert np.allclose(added, [0, 0, 0, 0, 0, 0, 0, 0, -14], atol=0.1)


def test_mesh_lies_on_the_surface() -> None:
    """In front, vertices have the depth of the surface at their x and y; all normals are unit vectors outwards."""
    model = mean_model()
    mesh = head_mesh(model)
    assert len(mesh.vertices_mm) == 200 * 220
    assert len(mesh.triangles) == 2 * 199 * 219
    x, y, z = mesh.vertices_mm.T
    front = (z < 60) & (np.abs(x) < 40) & (np.abs(y) < 60)
    assert np.allclose(HeadSurface(model).depth(x, y)[front], z[front], atol=1e-6)
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1)
    outwards = mesh.vertices_mm - (0, 8, 95)
    assert ((mesh.normals * outwards).sum(axis=1) > 0).mean() > 0.99
    assert mesh.normals[np.argmin(z)][2] < -0.8


def test_triangles_run_clockwise_to_the_camera() -> None:
    """Seen by a camera in front, the triangles of the face have a positive area with y down."""
    mesh = head_mesh(mean_model(), 60, 60)
    a, b, c = (mesh.vertices_mm[mesh.triangles[:, corner]] for corner in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    facing = mesh.normals[mesh.triangles].mean(axis=1)[:, 2] < -0.3
    assert (area[facing] > 0).all()


def test_egg_has_its_half_axes() -> None:
    """The egg is nearest at its middle, and at its outline as deep as its widest section."""
    assert egg_depth(np.array([0.0, 75.0, 0.0, 90.0]), np.array([8.0, 8.0, 123.0, 8.0])).tolist() == [0, 95, 95, 95]
