import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.geometry import rotation
from pftrack.vision.face import FEATURES, FaceModel, Similarity, average, fit_similarity, mean_model, person, place

ANGLES = st.lists(st.floats(-1.4, 1.4), min_size=3, max_size=3)


def rms_mm(first: FaceModel, second: FaceModel) -> float:
    aligned = fit_similarity(first.points_mm, second.points_mm)(first.points_mm)
    return float(np.sqrt(((aligned - second.points_mm) ** 2).sum(axis=1).mean()))


@given(ANGLES, st.floats(0.1, 10))
def test_similarity_is_recovered(angles: list[float], scale: float) -> None:
    """Points that were mapped by a similarity are mapped back onto by the fitted one."""
    points = person(1).points_mm
    known = Similarity(scale, rotation(np.array(angles)), np.array([10.0, -200, 30]))
    fitted = fit_similarity(points, known(points))
    assert fitted.scale == pytest.approx(scale)
    assert np.allclose(fitted.rotation, known.rotation, atol=1e-9)
    assert np.allclose(fitted(points), known(points), atol=1e-6)


def test_similarity_never_mirrors() -> None:
    """Of a mirror image the best proper rotation is found, not the mirror."""
    points = np.random.default_rng(0).normal(size=(20, 3))
    assert np.linalg.det(fit_similarity(points, points * (-1, 1, 1)).rotation) == pytest.approx(1)


def test_what_determines_no_similarity_is_refused() -> None:
    """Points at one place, of another number than the targets, or not finite are refused."""
    points = person(1).points_mm
    for source, target in ((np.ones((3, 2)), points[:3, :2]), (points[:3, :2], np.ones((3, 2)))):
        with pytest.raises(ValueError, match="all at one place"):
            fit_similarity(source, target)
    with pytest.raises(ValueError, match="as many points as targets"):
        fit_similarity(points, points[:3])
    with pytest.raises(ValueError, match="expected finite points"):
        fit_similarity(points, np.full_like(points, np.nan))


@pytest.mark.parametrize(("seed", "distance_mm"), [(99, 2.2), (101, 3.9), (102, 3.6)])
def test_drivers_are_as_far_from_the_mean_as_the_reference_s(seed: int, distance_mm: float) -> None:
    """Root mean square distances of the three drivers to the mean model are the reference's to 0.2 mm."""
    assert rms_mm(person(seed), mean_model()) == pytest.approx(distance_mm, abs=0.2)


def test_people_vary_as_the_statistics_say() -> None:
    """Over many people the mean and spread of the points are those of table 9.1, with asymmetry and size added."""
    people = np.array([person(seed).points_mm for seed in range(2000)])
    mouth = people[:, FEATURES.index("lmou")]
    assert np.allclose(mouth.mean(axis=0), (26, 67, 2), atol=0.3)
    expected = np.sqrt(np.array([1.8, 3.5, 2.5]) ** 2 + 0.5**2 + (0.03 * np.array([26, 67, 2])) ** 2)
    assert np.allclose(mouth.std(axis=0), expected, rtol=0.06)
    other = people[:, FEATURES.index("rmou")]
    assert np.std(mouth[:, 0] + other[:, 0]) == pytest.approx(0.5 * np.sqrt(2), rel=0.1)
    assert np.std(mouth[:, 1] - other[:, 1]) == pytest.approx(0.5 * np.sqrt(2), rel=0.1)


def test_mean_of_turned_copies_is_the_face() -> None:
    """The mean of copies of one face, turned, moved and scaled, is that face again up to a similarity."""
    face = person(3)
    turns = [
        Similarity(1 + 0.1 * k, rotation(np.array([0.2 * k, -0.1 * k, 0.3])), np.full(3, 9.0 * k)) for k in range(4)
    ]
    assert rms_mm(average([FaceModel(turn(face.points_mm)) for turn in turns]), face) < 1e-6


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
        with pytest.raises(ValueError, match="expected at least two of nose, leye"):
            place(model, wrong)


def test_a_face_has_eleven_finite_points() -> None:
    """Anything else is refused, and what is taken cannot be changed."""
    for wrong in (np.zeros((10, 3)), np.full((11, 3), np.nan)):
        with pytest.raises(ValueError, match="expected 11 finite points"):
            FaceModel(wrong)
    with pytest.raises(ValueError, match="read-only"):
        mean_model().points_mm[0] = 0


def test_a_face_may_have_other_points() -> None:
    """A model that has grown beyond the features is fitted and placed by all its points, under their own names."""
    mean = mean_model()
    grown = FaceModel(np.vstack([mean.points_mm, [[0.0, 90.0, 10.0]]]), (*FEATURES, "chin"))
    assert grown["chin"].tolist() == [0.0, 90.0, 10.0]
    assert grown["nose"].tolist() == mean["nose"].tolist()
    placed = place(grown, {"leye": (10.0, 0.0), "chin": (0.0, 20.0)})
    assert placed.shape == (12, 2)
    assert np.allclose(placed[-1], (0.0, 20.0))
    with pytest.raises(ValueError, match=r"expected at least two of .*, chin, got brow"):
        place(grown, {"brow": (0.0, 0.0)})
    assert average([grown, grown]).names == grown.names
    with pytest.raises(ValueError, match="a name for each point"):
        FaceModel(mean.points_mm[:2], ("nose", "nose"))


def test_equal_faces_are_one_key() -> None:
    """Models of the same points are equal and find each other in caches; another point or name makes another face."""
    mean = mean_model()
    again = FaceModel(mean.points_mm.copy())
    assert again == mean
    assert hash(again) == hash(mean)
    assert {mean: 1}[again] == 1
    assert FaceModel(mean.points_mm + 1e-9) != mean
    assert FaceModel(mean.points_mm, tuple(reversed(FEATURES))) != mean
