"""Where a face is when a recording begins: looked for in a bounded number of pictures, or in a box."""

import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.core.refusal import RefusedError
from pftrack.experiments.head.recording import FINDER, MOST_SEARCHED, FaceBox, first_face, to_search
from pftrack.experiments.head.scene import HeadSceneParameters, HeadSource
from pftrack.vision.face import FEATURES
from tests.experiments.head.heads import Picture, Pictures, empty, marked, pictures


class Counted(Pictures):
    """Pictures that count how often one was asked for."""

    asked = 0

    def picture(self, index: int) -> Picture:
        self.asked += 1
        return super().picture(index)


@pytest.mark.parametrize("count", [1, 49, 50, 51, 400, 20_000])
def test_so_many_pictures_are_looked_into(count: int) -> None:
    """The first ones one by one, later ones evenly, and of a long recording no more than of a short one."""
    frames = list(to_search(3, 3 + count - 1))
    assert frames == sorted(set(frames))
    assert frames[:50] == list(range(3, 3 + min(count, 50)))
    assert frames[-1] < 3 + count
    assert len(frames) <= MOST_SEARCHED
    assert max(np.diff(frames), default=0) <= max(5, count / 100)


def test_a_long_recording_of_nobody_is_given_up() -> None:
    """A recording without a face is refused after a bounded number of pictures, with what was wrong with the first."""
    nobody = Counted([empty(pictures(1)[0])] * 5000)
    with pytest.raises(RefusedError, match="found none in the picture; mark its features or its box"):
        first_face(nobody, 10)
    assert nobody.asked <= MOST_SEARCHED


def test_sightings_are_told_one_by_one() -> None:
    """Each picture is told of, with a reason for the first only, and a face with what was placed by the model."""
    face = pictures(1)
    told = list(FINDER.search(Pictures([empty(face[0])] * 2 + face), [0, 1, 2]))
    assert [sighting.frame for sighting in told] == [0, 1, 2]
    assert [bool(sighting.remarks) for sighting in told] == [True, False, False]
    assert [sighting.sure for sighting in told] == [False, False, True]
    assert told[2].placed == ("points.lmc", "points.rmc")
    for name, place in marked().items():
        assert np.hypot(*np.subtract(told[2].mark.points[name], place)) < 6


def turning(*frames: int) -> list[Picture]:
    """Return pictures of a driver who turns to the front, by the script's frames; at 104 the yaw is 6 degrees."""
    scene = revise(HeadSceneParameters(), {"person": 101})
    shown = [HeadSource(0, scene).frame(frame, History(((0, scene),))).image_rgb for frame in frames]
    return [picture for picture in shown if picture is not None]


def test_a_face_from_the_front_is_a_better_start() -> None:
    """A face that looks aside at first is begun with where it looks into the camera, and it is said that it did not."""
    shown = turning(96, 98, 100, 102, 104, 106)
    first, points = first_face(Pictures(shown, frame_rate_hz=15.0), 0)
    assert 2 <= first <= 4
    assert points.shape == (11, 2)
    aside, *_, frontal = FINDER.search(Pictures(shown), range(6))
    assert "looks aside" in aside.remarks[-1]
    assert frontal.remarks == ()


def test_a_face_that_goes_on_looking_aside_is_taken() -> None:
    """Nobody has to look into the camera: without such a picture within a second the first one will do."""
    shown = turning(96)
    assert first_face(Pictures(shown * 8 + turning(106), frame_rate_hz=6.0), 0)[0] == 0


def test_hidden_eyes_are_not_sure() -> None:
    """Behind sunglasses points are proposed, all of them placed, so that nobody takes them for found."""
    (sighting,) = FINDER.search(Pictures(pictures(1, width=640, sunglasses=True)), [0])
    assert sighting.placed == tuple(f"points.{name}" for name in FEATURES)
    assert not sighting.sure
    assert "drag them" in sighting.remarks[0]


def test_a_box_without_a_face_is_filled_with_a_mean_one() -> None:
    """Where nothing is recognised the points of a mean face fill the box and stay within the picture."""
    nobody = Pictures([empty(pictures(1)[0])])
    sighting = FINDER.within(nobody, 0, FaceBox.of(240.0, 60.0, 80.0, 180.0))
    points = np.array([sighting.mark.points[name] for name in FEATURES])
    assert (points >= (240, 60)).all()
    assert (points <= (319, 239)).all()
    assert points[FEATURES.index("reye"), 0] < points[FEATURES.index("nose"), 0] < points[FEATURES.index("leye"), 0]
    with pytest.raises(ValueError, match="within the picture of"):
        FINDER.within(nobody, 0, FaceBox.of(300.0, 0.0, 100.0, 50.0))
