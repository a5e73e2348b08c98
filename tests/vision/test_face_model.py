"""The face: its model, the surface of the head about it, and where it looks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.geometry import rotation
from pftrack.vision import face as faces
from pftrack.vision.face import FEATURES, FaceModel, HeadSurface, fit_similarity, gaze, mean_model, person, place
from tests.vision.refusing import refuse

ANGLES = st.lists(st.floats(-1.4, 1.4), min_size=3, max_size=3)


@given(ANGLES, st.floats(0.1, 10))
def test_similarity_is_recovered(angles: list[float], scale: float) -> None:
    """Points that were mapped by a similarity are mapped back onto by the fitted one."""
    points = person(1).points_mm
    known = faces.Similarity(scale, rotation(np.array(angles)), np.array([10.0, -200, 30]))
    fitted = fit_similarity(points, known(points))
    assert fitted.scale == pytest.approx(scale)
    assert np.allclose(fitted.rotation, known.rotation, atol=1e-9)
    assert np.allclose(fitted(points), known(points), atol=1e-6)


def test_what_determines_no_similarity_is_refused() -> None:
    """Points at one place; a mirror image is fitted by a rotation."""
    points = person(1).points_mm
    drawn = np.random.default_rng(0).normal(size=(20, 3))
    assert np.linalg.det(fit_similarity(drawn, drawn * (-1, 1, 1)).rotation) == pytest.approx(1)
    refuse("all at one place", fit_similarity, np.ones((3, 2)), points[:3, :2])


def test_people_vary_as_the_statistics_say() -> None:
    """Over many people the mean and spread of the points are those of table 9.1, with asymmetry and size added."""
    people = np.array([person(seed).points_mm for seed in range(2000)])
    mouth, other = (people[:, FEATURES.index(name)] for name in ("lmou", "rmou"))
    assert np.allclose(mouth.mean(axis=0), (26, 67, 2), atol=0.3)
    expected = np.sqrt(np.array([1.8, 3.5, 2.5]) ** 2 + 0.5**2 + (0.03 * np.array([26, 67, 2])) ** 2)
    assert np.allclose(mouth.std(axis=0), expected, rtol=0.06)
    unlike = np.std(mouth[:, 0] + other[:, 0]), np.std(mouth[:, 1] - other[:, 1])
    assert unlike == pytest.approx((0.5 * np.sqrt(2),) * 2, rel=0.1)


def test_mean_of_turned_copies_is_the_face() -> None:
    """The mean of copies of one face, turned, moved and scaled, is that face again up to a similarity."""
    points = person(3).points_mm
    turns = [
        faces.Similarity(1 + 0.1 * k, rotation(np.array([0.2 * k, -0.1 * k, 0.3])), np.full(3, 9.0 * k))
        for k in range(4)
    ]
    mean = faces.average([FaceModel(turn(points)) for turn in turns]).points_mm
    assert np.allclose(fit_similarity(mean, points)(mean), points, atol=1e-6)


def test_points_are_placed_by_the_eyes() -> None:
    """Two eyes place all points of a frontal face; more points share the error."""
    model = mean_model()
    eyes = {"leye": (400.0, 200.0), "reye": (300.0, 200.0)}
    points = place(model, eyes)
    assert np.allclose([points[FEATURES.index(name)] for name in eyes], list(eyes.values()))
    scale = 100 / np.hypot(*(model["leye"] - model["reye"])[:2])
    assert points[FEATURES.index("nose"), 1] == pytest.approx(200 + 38 * scale, abs=1.5)
    with_nose = place(model, {**eyes, "nose": (350.0, 280.0)})
    assert not np.allclose(with_nose[FEATURES.index("nose")], (350, 280), atol=0.1)
    for wrong in ({"leye": (1.0, 2.0)}, {**eyes, "chin": (3.0, 4.0)}):
        refuse("expected at least two of nose, leye", place, model, wrong)


def test_a_face_may_have_other_points() -> None:
    """A model that has grown beyond the features is fitted and placed by all its points, under their own names."""
    mean = mean_model()
    grown = FaceModel(np.vstack([mean.points_mm, [[0.0, 90.0, 10.0]]]), (*FEATURES, "chin"))
    assert (grown["chin"].tolist(), grown["nose"].tolist()) == ([0.0, 90.0, 10.0], mean["nose"].tolist())
    placed = place(grown, {"leye": (10.0, 0.0), "chin": (0.0, 20.0)})
    assert placed.shape == (12, 2)
    assert np.allclose(placed[-1], (0.0, 20.0))
    assert faces.average([grown, grown]).names == grown.names
    refuse(r"expected at least two of .*, chin, got brow", place, grown, {"brow": (0.0, 0.0)})
    refuse("a name for each point", FaceModel, mean.points_mm[:2], ("nose", "nose"))


def test_equal_faces_are_one_key() -> None:
    """Models of the same points are equal and find each other in caches; another point or name makes another face."""
    mean = mean_model()
    again = FaceModel(mean.points_mm.copy())
    assert {mean: 1}[again] == 1
    assert mean not in [FaceModel(mean.points_mm + 1e-9), FaceModel(mean.points_mm, tuple(reversed(FEATURES)))]


@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))
def test_gaze_is_the_direction_in_which_the_face_looks(x: float, y: float, z: float) -> None:
    """Yaw and pitch are those of R (0, 0, -1), the roll is that of R (1, 0, 0) in the picture."""
    theta = np.array([x, y, z])
    ahead, across = rotation(theta) @ [0.0, 0.0, -1.0], rotation(theta) @ [1.0, 0.0, 0.0]
    yaw, pitch, roll = gaze(theta)
    assert (yaw, pitch) == pytest.approx((np.arctan2(ahead[0], -ahead[2]), np.arcsin(-ahead[1])), abs=1e-9)
    assert np.cos(roll - np.arctan2(across[1], across[0])) == pytest.approx(1.0, abs=1e-9)


@given(ANGLES)
def test_theta_is_found_again(pose: list[float]) -> None:
    """The two ways of writing a pose are inverse to each other within a quarter of a turn."""
    assert gaze(faces.theta_of(np.array(pose))) == pytest.approx(pose, abs=1e-9)


@pytest.mark.parametrize("seed", [99, 101, 102])
def test_surface_passes_through_the_features(seed: int) -> None:
    """At every feature the surface has the feature's depth, to the softness of the correction (section 15, test 11)."""
    model = person(seed)
    x, y, z = model.points_mm.T
    assert np.abs(HeadSurface(model).depth(x, y) - z).max() < 0.2


def test_surface_keeps_to_the_egg_elsewhere() -> None:
    """At forehead and cheeks the surface is the egg's; at the chin it is 14 mm nearer."""
    x, y = np.array(faces.ANCHORS_MM).T
    added = HeadSurface(mean_model()).correction(x, y)
    assert np.allclose(added, [0, 0, 0, 0, 0, 0, 0, 0, -14], atol=0.1)


def test_mesh_lies_on_the_surface() -> None:
    """In front, vertices have the depth of the surface at their x and y; all normals are unit vectors outwards."""
    model = mean_model()
    mesh = faces.head_mesh(model)
    assert (len(mesh.vertices_mm), len(mesh.triangles)) == (200 * 220, 2 * 199 * 219)
    x, y, z = mesh.vertices_mm.T
    front = (z < 60) & (np.abs(x) < 40) & (np.abs(y) < 60)
    assert np.allclose(HeadSurface(model).depth(x, y)[front], z[front], atol=1e-6)
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1)
    outwards = mesh.vertices_mm - (0, 8, 95)
    assert ((mesh.normals * outwards).sum(axis=1) > 0).mean() > 0.99
    assert mesh.normals[np.argmin(z)][2] < -0.8


def test_egg_has_its_half_axes() -> None:
    """The egg is nearest at its middle, and at its outline as deep as its widest section."""
    assert faces.egg_depth(np.array([0.0, 75, 0, 90]), np.array([8.0, 8, 123, 8])).tolist() == [0, 95, 95, 95]
