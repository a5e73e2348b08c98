import cv2
import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, History
from pftrack.experiments.head.painting import blur
from pftrack.experiments.head.scene import HeadSceneParameters, HeadSource
from pftrack.vision.face import FEATURES, person

LEFT, RIGHT = FEATURES.index("leye"), FEATURES.index("reye")
TURNED_LEFT, TURNED_RIGHT = 75, 135


def shown(index: int, seed: int = 0, **values: object) -> Frame:
    parameters = revise(HeadSceneParameters(), values)
    return HeadSource(seed, parameters).frame(index, History(((0, parameters),)))


def seen(frame: Frame) -> set[str]:
    return {name for name, visible in zip(FEATURES, frame.target.landmarks.visible, strict=True) if visible}


@pytest.mark.parametrize("driver", [99, 101, 102])
def test_pupils_are_where_the_truth_says(driver: int) -> None:
    """In the frontal frame the dark of each pupil is centred within 1 px of the true eye (section 15, test 11)."""
    frame = shown(0, person=driver, image_noise_sd=0)
    for eye in (LEFT, RIGHT):
        x, y = frame.target.landmarks.points_px[eye]
        column, row = round(x), round(y)
        patch = frame.image_rgb[row - 6 : row + 7, column - 6 : column + 7, 0].astype(float)
        rows, columns = np.nonzero(patch < patch.min() + 25)
        # The glint on the upper right eats a little of the pupil.
        assert np.hypot(columns.mean() + column - 6 - x, rows.mean() + row - 6 - y) < 1.0


def test_truth_is_the_projection_of_the_model() -> None:
    """The points are those of the driver's face, turned about the neck and seen by the reference camera."""
    frame = shown(TURNED_LEFT)
    target = frame.target
    pivot = np.array([0.0, 90, 100])
    turned = (person(99).points_mm - pivot) @ rotation(target.position).T + pivot + (0, -15, 700)
    assert np.allclose(turned, person(99).points_mm @ rotation(target.position).T + target.translation_mm)
    expected = 1200 * turned[:, :2] / turned[:, 2:] + (320, 240)
    assert np.allclose(target.landmarks.points_px, expected)
    assert np.array_equal(target.landmarks.model_mm, person(99).points_mm)


def test_a_head_turned_away_hides_its_far_side() -> None:
    """With the nose to image left the right eye's outer corner is behind the head, to image right the left one's."""
    assert np.rad2deg(shown(TURNED_LEFT).target.position[1]) > 30
    assert set(FEATURES) - seen(shown(TURNED_LEFT)) == {"rlc"}
    assert np.rad2deg(shown(TURNED_RIGHT).target.position[1]) < -30
    assert "llc" not in seen(shown(TURNED_RIGHT))
    assert seen(shown(0)) == set(FEATURES)


def test_signs_of_the_motions() -> None:
    """Positive theta moves the nose down, to image left, and rolls the head clockwise."""
    nose = FEATURES.index("nose")
    start = shown(0).target.landmarks.points_px
    assert shown(TURNED_LEFT).target.landmarks.points_px[nose, 0] < start[nose, 0] - 50
    assert shown(345).target.position[0] > np.deg2rad(20)
    assert shown(345).target.landmarks.points_px[nose, 1] > start[nose, 1] + 50
    rolled = shown(615).target
    assert rolled.position[2] > np.deg2rad(20)
    line = rolled.landmarks.points_px[LEFT] - rolled.landmarks.points_px[RIGHT]
    assert np.arctan2(line[1], line[0]) == pytest.approx(rolled.position[2], abs=0.05)


def test_noise_has_the_spread_asked_for() -> None:
    """Pixels differ from those without noise by the standard deviation asked for."""
    clean, noisy = (shown(5, image_noise_sd=sd).image_rgb[:, :, 0].astype(float) for sd in (0, 3))
    assert (noisy - clean).std() == pytest.approx(np.sqrt(9 + 1 / 6), rel=0.02)


def test_a_pillar_hides_what_is_behind_it() -> None:
    """The pillar covers its columns, and the features behind it count as hidden, no others."""
    frame = shown(0, pillar_width_px=60, pillar_offset_px=50, image_noise_sd=0)
    x = frame.target.landmarks.points_px[:, 0]
    assert np.array_equal(~frame.target.landmarks.visible, (np.floor(x + 0.5) >= 340) & (np.floor(x + 0.5) < 400))
    bare = shown(0, image_noise_sd=0)
    assert np.array_equal((frame.image_rgb != bare.image_rgb).any(axis=(0, 2))[[339, 340, 399, 400]], [0, 1, 1, 0])
    assert shown(0, pillar_width_px=640).target.hidden


def test_a_hand_comes_up_and_hides_from_below() -> None:
    """The more the hand is up, the more features it hides: first the mouth, at last the eyes."""
    hidden = [set(FEATURES) - seen(shown(0, hand_cover=cover)) for cover in (0, 0.3, 0.6, 1)]
    assert hidden[0] == hidden[1] == set()
    assert hidden[2] <= hidden[3]
    assert hidden[2] & {"lmou", "rmou"}
    assert {"nose", "lmc", "rmc", "lmou", "rmou"} <= hidden[3]


def test_sunglasses_hide_the_eyes_and_turn_with_the_head() -> None:
    """Behind sunglasses centres and corners of the eyes are hidden and dark, on a turned head too."""
    eyes = {name for name in FEATURES if name.endswith(("eye", "mc", "lc"))}
    for index in (0, TURNED_LEFT):
        frame = shown(index, sunglasses=True, image_noise_sd=0)
        assert set(FEATURES) - seen(frame) == eyes
        column, row = np.rint(frame.target.landmarks.points_px[LEFT]).astype(int)
        assert frame.image_rgb[row, column, 0] < 30


def test_sun_and_lamp_light_the_face() -> None:
    """Without the lamp the face is dark; the sun makes it brighter where it shines."""
    rows, columns = slice(140, 400), slice(230, 410)
    mean = {
        name: shown(60, image_noise_sd=0, **values).image_rgb[rows, columns].mean()
        for name, values in {
            "both": {"sun_strength": 1},
            "lamp": {"sun_strength": 0},
            "none": {"sun_strength": 0, "lamp_strength": 0},
        }.items()
    }
    assert mean["both"] > mean["lamp"] + 10 > mean["none"] + 50


def test_a_larger_picture_shows_the_same_view() -> None:
    """At half the width all points have half the coordinates, and the picture is the same one made smaller."""
    large, small = shown(50, image_noise_sd=0), shown(50, image_noise_sd=0, image_width_px=320)
    assert np.allclose(small.target.landmarks.points_px, large.target.landmarks.points_px / 2)
    halved = large.image_rgb[::2, ::2, 0].astype(float)
    assert np.abs(halved - small.image_rgb[:, :, 0]).mean() < 3


def test_a_lens_out_of_focus_blurs_like_a_gaussian() -> None:
    """The same as OpenCV's Gaussian of that width, in px of a picture 640 px wide; at 0 nothing is done."""
    sharp = np.random.default_rng(0).uniform(0, 255, (60, 80)).astype(np.float32)
    assert blur(sharp, 0.0) is sharp
    expected = cv2.GaussianBlur(sharp, (0, 0), 1.5, borderType=cv2.BORDER_REPLICATE)
    assert np.abs(blur(sharp, 1.5) - expected).max() < 0.5
    assert blur(np.full((60, 80), 7.0, np.float32), 2.0) == pytest.approx(7.0, abs=1e-4)
    rough = {
        width: np.abs(
            np.diff(shown(0, image_noise_sd=0, image_width_px=width, blur_px=sd).image_rgb[:, :, 0].astype(int))
        )
        for width, sd in ((640, 0), (640, 3), (320, 3))
    } | {"sharp": np.abs(np.diff(shown(0, image_noise_sd=0).image_rgb[:, :, 0].astype(int)))}
    assert rough[640].mean() < 0.7 * rough["sharp"].mean()
    assert rough[320].mean() > rough[640].mean()  # twice as coarse, and blurred by half as many px
