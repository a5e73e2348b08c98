import numpy as np

from pftrack.experiments.head.painting import LEFT_MM, STEP_MM, TOP_MM, albedo
from pftrack.vision.face import FaceModel, person


def at(texture: np.ndarray, x: float, y: float) -> float:
    return float(texture[round((y - TOP_MM) / STEP_MM), round((x - LEFT_MM) / STEP_MM)])


def test_face_has_the_albedos_of_the_reference_scene() -> None:
    """Skin, iris, pupil, nostril, mouth, brow and hair have the albedos of the reference scene where they belong."""
    face = person(99)
    texture = albedo(face, 99)
    eye, nose, brow = face["leye"], face["nose"], face["lbro"]
    mouth = (face["lmou"] + face["rmou"]) / 2
    places = {
        (30, 40): 0.62,
        (eye[0] - 1, eye[1]): 0.08,
        (eye[0] - 4, eye[1]): 0.38,
        (nose[0] + 7, nose[1] + 9): 0.12,
        (mouth[0], mouth[1] + 0.6): 0.15,
        (brow[0] + 8, brow[1] - 2): 0.22,
        (0, -100): 0.15,
    }
    for (x, y), expected in places.items():
        assert abs(at(texture, x, y) - expected) < 0.09, (x, y)


def test_eyes_open_between_their_corners() -> None:
    """The bright of the eye ends at the corners, inner and outer."""
    face = person(99)
    texture = albedo(face, 99)
    for side in "lr":
        inner, outer = face[side + "mc"], face[side + "lc"]
        within = outer + 0.2 * (inner - outer)
        assert at(texture, *within[:2]) > 0.66
        beyond = outer + 0.15 * (outer - inner)
        assert at(texture, *beyond[:2]) < 0.66


def test_albedo_is_between_black_and_white() -> None:
    """Whatever the face, albedo stays within 0..1 and is finite."""
    odd = FaceModel(person(5).points_mm * (1.5, 0.7, 2))
    for face in (odd, person(6)):
        texture = albedo(face, 1)
        assert np.isfinite(texture).all()
        assert texture.min() > 0
        assert texture.max() <= 1
