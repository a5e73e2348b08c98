"""The simulated driver: motion, face and pictures."""

import cv2
import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, History
from pftrack.experiments.head import scene
from pftrack.experiments.head.painting import blur
from pftrack.experiments.head.scene import HeadSceneParameters, HeadSource, angles_rad, eased_amplitude, script_time
from pftrack.vision.face import FEATURES, person

LEFT, RIGHT = FEATURES.index("leye"), FEATURES.index("reye")
TURNED_LEFT, TURNED_RIGHT = 75, 135


def shown(index: int, seed: int = 0, **values: object) -> Frame:
    parameters = revise(HeadSceneParameters(), values)
    return HeadSource(seed, parameters).frame(index, History(((0, parameters),)))


def grey(index: int, **values: object) -> np.ndarray:
    """Return the grey levels of a frame without noise."""
    return shown(index, **{"image_noise_sd": 0, **values}).image_rgb[:, :, 0].astype(float)


def hidden(frame: Frame) -> set[str]:
    return {name for name, visible in zip(FEATURES, frame.target.landmarks.visible, strict=True) if not visible}


@pytest.mark.parametrize("driver", [99, 101, 102])
def test_pupils_are_at_the_true_eyes(driver: int) -> None:
    """In the frontal frame the dark of each pupil is centred within 1 px of the true eye (section 15, test 11)."""
    image, points = grey(0, person=driver), shown(0, person=driver).target.landmarks.points_px
    for x, y in points[[LEFT, RIGHT]]:
        column, row = round(x), round(y)
        patch = image[row - 6 : row + 7, column - 6 : column + 7]
        rows, columns = np.nonzero(patch < patch.min() + 25)
        # The glint on the upper right eats a little of the pupil.
        assert np.hypot(columns.mean() + column - 6 - x, rows.mean() + row - 6 - y) < 1.0


def test_truth_is_the_projection_of_the_model() -> None:
    """The points are those of the driver's face, turned about the neck and seen by the reference camera.

    A positive yaw moves the nose to image left, a positive pitch moves it down, a positive roll is clockwise.
    """
    target, start, nodded, rolled = (shown(index).target for index in (TURNED_LEFT, 0, 345, 615))
    line = rolled.landmarks.points_px[LEFT] - rolled.landmarks.points_px[RIGHT]
    assert min(nodded.position[0], rolled.position[2]) > np.deg2rad(20)
    assert np.arctan2(line[1], line[0]) == pytest.approx(rolled.position[2], abs=0.05)
    nose = FEATURES.index("nose")
    assert (target.landmarks.points_px - start.landmarks.points_px)[nose, 0] < -50
    assert (nodded.landmarks.points_px - start.landmarks.points_px)[nose, 1] > 50
    pivot = np.array([0.0, 90, 100])
    turned = (person(99).points_mm - pivot) @ rotation(target.position).T + pivot + (0, -15, 700)
    assert np.allclose(turned, person(99).points_mm @ rotation(target.position).T + target.translation_mm)
    expected = 1200 * turned[:, :2] / turned[:, 2:] + (320, 240)
    assert np.allclose(target.landmarks.points_px, expected)
    assert np.array_equal(target.landmarks.model_mm, person(99).points_mm)


def test_a_head_turned_away_hides_its_far_side() -> None:
    """With the nose to image left the right eye's outer corner is behind the head, to image right the left one's."""
    assert np.rad2deg(shown(TURNED_LEFT).target.position[1]) > 30
    assert hidden(shown(TURNED_LEFT)) == {"rlc"}
    assert np.rad2deg(shown(TURNED_RIGHT).target.position[1]) < -30
    assert "llc" in hidden(shown(TURNED_RIGHT))
    assert hidden(shown(0)) == set()


def test_noise_has_the_spread_asked_for() -> None:
    """Pixels differ from those without noise by the standard deviation of the parameter."""
    assert (grey(5, image_noise_sd=3) - grey(5)).std() == pytest.approx(np.sqrt(9 + 1 / 6), rel=0.02)


def test_a_pillar_hides_what_is_behind_it() -> None:
    """The pillar covers its columns, and exactly the features behind it count as hidden."""
    pillar = {"pillar_width_px": 60, "pillar_offset_px": 50}
    marks = shown(0, **pillar).target.landmarks
    column = np.floor(marks.points_px[:, 0] + 0.5)
    assert np.array_equal(~marks.visible, (column >= 340) & (column < 400))
    changed = (grey(0, **pillar) != grey(0)).any(axis=0)
    assert np.array_equal(changed[[339, 340, 399, 400]], [0, 1, 1, 0])
    assert shown(0, pillar_width_px=640).target.hidden


def test_a_hand_comes_up_and_hides_from_below() -> None:
    """The higher the hand, the more features it hides: first the mouth, at last the eyes."""
    none, low, half, whole = (hidden(shown(0, hand_cover=cover)) for cover in (0, 0.3, 0.6, 1))
    assert none == low == set()
    assert half <= whole
    assert half & {"lmou", "rmou"}
    assert {"nose", "lmc", "rmc", "lmou", "rmou"} <= whole


def test_sunglasses_hide_the_eyes_and_turn_with_the_head() -> None:
    """Centres and corners of the eyes are hidden and dark, on a turned head too."""
    for index in (0, TURNED_LEFT):
        frame = shown(index, sunglasses=True)
        assert hidden(frame) == {name for name in FEATURES if name.endswith(("eye", "mc", "lc"))}
        column, row = np.rint(frame.target.landmarks.points_px[LEFT]).astype(int)
        assert grey(index, sunglasses=True)[row, column] < 30


def test_sun_and_lamp_light_the_face() -> None:
    """Without the lamp the face is dark; the sun makes it brighter where it shines."""
    lights = ({"sun_strength": 1}, {"sun_strength": 0}, {"sun_strength": 0, "lamp_strength": 0})
    both, lamp, none = (grey(60, **values)[140:400, 230:410].mean() for values in lights)
    assert both > lamp + 10 > none + 50


def test_a_larger_picture_shows_the_same_view() -> None:
    """At half the width all coordinates are half as large, and the picture is a reduced one."""
    large, small = (shown(50, image_width_px=width).target.landmarks.points_px for width in (640, 320))
    assert np.allclose(small, large / 2)
    assert np.abs(grey(50)[::2, ::2] - grey(50, image_width_px=320)).mean() < 3


def test_a_lens_out_of_focus_blurs_like_a_gaussian() -> None:
    """It equals OpenCV's Gaussian of that width; at 0 the picture stays."""
    sharp = np.random.default_rng(0).uniform(0, 255, (60, 80)).astype(np.float32)
    assert blur(sharp, 0.0) is sharp
    expected = cv2.GaussianBlur(sharp, (0, 0), 1.5, borderType=cv2.BORDER_REPLICATE)
    assert np.abs(blur(sharp, 1.5) - expected).max() < 0.5
    assert blur(np.full((60, 80), 7.0, np.float32), 2.0) == pytest.approx(7.0, abs=1e-4)


def moved(**values: float) -> HeadSceneParameters:
    return revise(HeadSceneParameters(), values)


def test_script_has_its_motions_in_order() -> None:
    """It has two turns of 35 degrees, then two nods and two rolls of 25, with rests between them.

    As many frames as the reference counts have an axis beyond 20 degrees, and from frame to frame, also from the end
    of the script to its beginning, the head turns by less than 4 degrees.
    """
    twice = np.rad2deg([angles_rad(k / scene.SCRIPT_FRAMES, 1.0) for k in range(2 * scene.SCRIPT_FRAMES)])
    degrees = twice[: scene.SCRIPT_FRAMES]
    assert degrees[0].tolist() == [0, 0, 0]
    for first, axis, peak in ((45, 1, 35), (315, 0, 25), (585, 2, 25)):
        part = degrees[first : first + 240, axis]
        assert (part.max(), part.min()) == pytest.approx((peak, -peak), abs=5)
        assert np.abs(np.delete(degrees[first : first + 240], axis, axis=1)).max() < 5
        # Two cycles, each first to the positive side.
        assert part[30] > 0.7 * peak
        assert part[90] < -0.7 * peak
    assert np.abs(degrees[840:]).max() < 5
    assert (np.abs(degrees) > 20).any(axis=1).sum() == pytest.approx(330, abs=5)
    assert np.abs(np.diff(twice, axis=0)).max() < 4


def test_changes_of_speed_and_amplitude_do_not_jump() -> None:
    """After a change of speed or amplitude in mid-run the pose continues."""
    before, after = moved(speed=1, amplitude=1), moved(speed=0.2, amplitude=0.2)
    path = []
    for frame in range(200):
        spans = [(min(frame, 80), before), (frame - 80, after)] if frame > 80 else [(frame, before)]
        path.append(angles_rad(script_time(spans), eased_amplitude(spans, 1.0)))
    assert np.rad2deg(np.abs(np.diff(path, axis=0)).max()) < 4
    assert np.abs(path[-1]).max() < np.abs(path[80]).max()


def test_speed_is_summed_and_amplitude_lags() -> None:
    """At twice the speed the script takes half the frames; the amplitude approaches its new value."""
    assert script_time([(450, moved(speed=2))]) == pytest.approx(1)
    assert script_time([(100, moved(speed=0)), (90, moved())]) == pytest.approx(0.1)
    assert eased_amplitude([(15, moved(amplitude=0))], 1.0) == pytest.approx(np.exp(-1))
    assert eased_amplitude([(500, moved(amplitude=0.5))], 1.0) == pytest.approx(0.5)
    assert not angles_rad(0.3, 0.0).any()
