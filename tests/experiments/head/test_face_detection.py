import csv
from pathlib import Path

import cv2
import numpy as np
import pytest

from pftrack.core.refusal import RefusedError
from pftrack.experiments.head import detection as cascades
from pftrack.experiments.head.detection import detect, eye_distance, find_again
from pftrack.vision.face import FEATURES, FaceModel, mean_model, place

CLIP = Path(__file__).parents[3] / ".." / "shared" / "data" / "face_turning"
LEFT, RIGHT = FEATURES.index("leye"), FEATURES.index("reye")

REFERENCE = {
    "nose": "nose_tip",
    "lmc": "subj_left_eye_inner",
    "rmc": "subj_right_eye_inner",
    "llc": "subj_left_eye_outer",
    "rlc": "subj_right_eye_outer",
    "lmou": "mouth_subj_left",
    "rmou": "mouth_subj_right",
}


def refused(grey: np.ndarray) -> RefusedError:
    with pytest.raises(RefusedError) as error:
        detect(np.ascontiguousarray(grey))
    return error.value


def test_eye_boxes_are_where_the_eyes_are(frontal: tuple) -> None:
    """The cascades' eye boxes on the simulated frontal frame are within 4 px of the true eye centres (section 8)."""
    grey, truth = frontal
    (face,) = cascades.faces(grey)
    centres = np.array([(x + (w - 1) / 2, y + (h - 1) / 2) for x, y, w, h in cascades.find_eyes(grey, face)])
    assert len(centres) == 2
    assert np.hypot(*(centres - truth[[LEFT, RIGHT]][:, None]).transpose(2, 0, 1)).min(axis=1).max() < 4


@pytest.mark.parametrize("person", [99, 101, 102])
def test_points_of_a_frontal_face_are_found(person: int, simulated: object) -> None:
    """On drivers' first frames every point is found within 10 px and the irises, 105 px apart, within 2 px."""
    grey, truth = simulated(person=person)
    face = detect(grey)
    off = np.hypot(*(face.points_px - truth).T)
    assert off.max() < 10
    assert off[[LEFT, RIGHT]].max() < 2
    assert (face.eyes_seen, face.warnings) == (2, ())
    assert cascades.eye_distance(face.points_px) == pytest.approx(np.hypot(*(truth[LEFT] - truth[RIGHT])), rel=0.03)


def test_refinement_helps(simulated: object) -> None:
    """Looking for what points stand for halves their errors against a mean face laid onto the true eyes."""
    chosen = [FEATURES.index(name) for name in ("nose", "llc", "rlc", "lmou", "rmou")]
    refined, placed = [], []
    for person in range(1, 4):
        grey, truth = simulated(person=person)
        by_eyes = place(mean_model(), {name: tuple(truth[FEATURES.index(name)]) for name in ("leye", "reye")})
        for errors, points in ((refined, detect(grey).points_px), (placed, by_eyes)):
            errors.append(np.hypot(*(points - truth).T)[chosen])
    assert (np.mean(refined, axis=0) < 0.6 * np.mean(placed, axis=0)).all()


def test_size_of_the_picture_does_not_matter(frontal: tuple) -> None:
    """The same face is found in a small and in a large picture."""
    grey, truth = frontal
    for factor in (0.25, 2.0):
        resized = cv2.resize(grey, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
        face = detect(resized)
        assert np.hypot(*((face.points_px + 0.5) / factor - 0.5 - truth).T).max() < 10


def test_the_largest_of_two_faces_is_chosen_and_said_so(frontal: tuple) -> None:
    """Of two faces the larger is tracked, and a warning says that there were two."""
    grey, truth = frontal
    smaller = cv2.resize(grey, None, fx=0.7, fy=0.7, interpolation=cv2.INTER_AREA)
    both = np.hstack([np.pad(smaller, ((144, 0), (0, 0)), mode="edge"), grey])
    face = detect(both)
    assert np.hypot(*(face.points_px - truth - (448, 0)).T).max() < 9
    assert face.warnings == ("2 faces were found; the largest was taken, draw a box around another one to have that",)


def test_pictures_without_a_face_are_refused(frontal: tuple) -> None:
    """Noise, nothing, half a face, an inverted face, one on its side and 8 x 8 px each get a message of their own."""
    grey, _ = frontal
    noise = np.random.default_rng(0).integers(0, 255, (240, 320), dtype=np.uint8)
    for nothing in (noise, np.full((240, 320), 90, np.uint8), grey[:, :320], grey[:250]):
        assert "found none in the picture" in str(refused(nothing))
    assert "found one upside down" in str(refused(grey[::-1, ::-1]))
    for turn in (1, 3):
        assert "an upright face, found one on its side" in str(refused(np.rot90(grey, turn)))
    assert "got 8 x 8" in str(refused(grey[:8, :8]))


def test_a_face_that_is_cut_off_is_refused_by_name(frontal: tuple, monkeypatch: pytest.MonkeyPatch) -> None:
    """If points of the model come to lie beyond the picture, the message names them."""
    grey, _ = frontal
    points = mean_model().points_mm.copy()
    points[FEATURES.index("lmou"), 1] = 190
    monkeypatch.setattr(cascades, "mean_model", lambda: FaceModel(points))
    with pytest.raises(RefusedError, match="but lmou would be outside"):
        detect(grey)


def test_hidden_eyes_are_placed_by_proportion(simulated: object) -> None:
    """Behind sunglasses the points are proposed by proportion, with a warning."""
    grey, truth = simulated(sunglasses=True)
    face = detect(grey)
    assert face.eyes_seen == 0
    assert "no eyes were found" in face.warnings[0]
    assert np.hypot(*(face.points_px - truth).T).max() < 30


def test_a_lost_face_is_found_again(frontal: tuple) -> None:
    """A lost face is found near where it was or anywhere, and not where there is none."""
    grey, truth = frontal
    for last_seen in ((190.0, 100.0, 260.0, 260.0), (0.0, 0.0, 60.0, 60.0), (-500.0, 900.0, 60.0, 60.0), None):
        face = find_again(grey, last_seen)
        assert np.hypot(*(face.points_px - truth).T).max() < 9
    assert find_again(np.full((240, 320), 90, np.uint8), (100.0, 100.0, 50.0, 50.0)) is None
    assert find_again(grey[:8, :8]) is None


@pytest.mark.skipif(not (CLIP / "clip.mp4").exists(), reason="the clip of a turning face is not beside the checkout")
def test_points_of_a_real_face_are_found() -> None:
    """On the real clip's first frame, eyes 47 px apart, every point with a reference is within 5 px of it."""
    video = cv2.VideoCapture(str(CLIP / "clip.mp4"))
    read, image_bgr = video.read()
    video.release()
    assert read
    with (CLIP / "reference_pose.csv").open() as file:
        row = next(csv.DictReader(file))
    face = detect(cv2.cvtColor(image_bgr, cv2.COLOR_BGR2GRAY))
    assert face.warnings == ()
    assert eye_distance(face.points_px) == pytest.approx(47, abs=2)
    for name, column in REFERENCE.items():
        known = float(row[f"{column}_x"]), float(row[f"{column}_y"])
        assert np.hypot(*(face.points_px[FEATURES.index(name)] - known)) < 5
