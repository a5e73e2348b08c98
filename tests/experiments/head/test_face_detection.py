"""The detection of faces and their features in a picture."""

import cv2
import numpy as np
import pytest

from pftrack.core.model.parameters import Value
from pftrack.core.refusal import RefusedError
from pftrack.experiments.head import detection as cascades
from pftrack.experiments.head.detection import detect, find_again
from pftrack.vision.face import FEATURES, FaceModel, mean_model, place
from tests.experiments.head.heads import simulated

LEFT, RIGHT = FEATURES.index("leye"), FEATURES.index("reye")


def picture(**values: Value) -> tuple[np.ndarray, np.ndarray]:
    """Return the grey picture of a simulated driver, and where the features truly are."""
    (frame,) = simulated(1, width=640, **values)
    return np.ascontiguousarray(frame.image_rgb[:, :, 0]), frame.target.landmarks.points_px


def test_points_of_frontal_faces_are_found() -> None:
    """On drivers' first frames points are found to 10 px and irises, 105 px apart, to 2 px.

    The search for features reduces the errors of a mean face laid onto the true eyes to 60 %.
    """
    chosen = [FEATURES.index(name) for name in ("nose", "llc", "rlc", "lmou", "rmou")]
    refined, placed = [], []
    for person in (1, 3, 102):
        grey, truth = picture(person=person)
        face = detect(grey)
        off = np.hypot(*(face.points_px - truth).T)
        assert off.max() < 10
        assert off[[LEFT, RIGHT]].max() < 2
        assert (face.eyes_seen, face.warnings) == (2, ())
        apart = np.hypot(*(truth[LEFT] - truth[RIGHT]))
        assert cascades.eye_distance(face.points_px) == pytest.approx(apart, rel=0.03)
        by_eyes = place(mean_model(), {name: tuple(truth[FEATURES.index(name)]) for name in ("leye", "reye")})
        refined.append(off[chosen])
        placed.append(np.hypot(*(by_eyes - truth).T)[chosen])
    assert (np.mean(refined, axis=0) < 0.6 * np.mean(placed, axis=0)).all()


def test_size_of_the_picture_does_not_matter() -> None:
    """The same face is found in a small and in a large picture."""
    grey, truth = picture()
    for factor in (0.25, 2.0):
        resized = cv2.resize(grey, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
        face = detect(resized)
        assert np.hypot(*((face.points_px + 0.5) / factor - 0.5 - truth).T).max() < 10


def test_the_largest_of_two_faces_is_chosen() -> None:
    """A warning reports both faces."""
    grey, truth = picture()
    smaller = cv2.resize(grey, None, fx=0.7, fy=0.7, interpolation=cv2.INTER_AREA)
    both = np.hstack([np.pad(smaller, ((144, 0), (0, 0)), mode="edge"), grey])
    face = detect(both)
    assert np.hypot(*(face.points_px - truth - (448, 0)).T).max() < 9
    assert face.warnings == ("2 faces were found; the largest was taken, draw a box around another one to have that",)


def test_pictures_without_a_face_are_refused() -> None:
    """Noise, nothing, part of a face, an inverted face, one on its side and a tiny picture are refused by name."""
    grey, _ = picture()
    noise = np.random.default_rng(0).integers(0, 255, (240, 320), dtype=np.uint8)
    cases = [(it, "found none in the picture") for it in (noise, np.full_like(noise, 90), grey[:, :320], grey[:250])]
    cases += [(np.rot90(grey, turn), "an upright face, found one on its side") for turn in (1, 3)]
    for shown, words in (*cases, (grey[::-1, ::-1], "found one upside down"), (grey[:8, :8], "got 8 x 8")):
        with pytest.raises(RefusedError, match=words):
            detect(np.ascontiguousarray(shown))


def test_a_cut_off_face_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names the model's points beyond the picture."""
    grey, _ = picture()
    points = mean_model().points_mm.copy()
    points[FEATURES.index("lmou"), 1] = 190
    monkeypatch.setattr(cascades, "mean_model", lambda: FaceModel(points))
    with pytest.raises(RefusedError, match="but lmou would be outside"):
        detect(grey)


def test_a_lost_face_is_found_again() -> None:
    """A lost face is found near its last place or anywhere, and not in a picture without one."""
    grey, truth = picture()
    for last_seen in ((190.0, 100.0, 260.0, 260.0), (0.0, 0.0, 60.0, 60.0), (-500.0, 900.0, 60.0, 60.0), None):
        face = find_again(grey, last_seen)
        assert np.hypot(*(face.points_px - truth).T).max() < 9
    assert find_again(np.full((240, 320), 90, np.uint8), (100.0, 100.0, 50.0, 50.0)) is None
    assert find_again(grey[:8, :8]) is None
