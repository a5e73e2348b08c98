"""The simulated driver: his motion, his face, and how pictures of it are drawn."""

import cv2
import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, History
from pftrack.experiments.head.painting import LEFT_MM, STEP_MM, TOP_MM, albedo, blur, lit, project, rasterise
from pftrack.experiments.head.scene import (
    SCRIPT_FRAMES,
    HeadSceneParameters,
    HeadSource,
    angles_rad,
    eased_amplitude,
    script_time,
)
from pftrack.vision.face import FEATURES, FaceModel, person

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
def test_pupils_are_where_the_truth_says(driver: int) -> None:
    """In the frontal frame the dark of each pupil is centred within 1 px of the true eye (section 15, test 11)."""
    image, points = grey(0, person=driver), shown(0, person=driver).target.landmarks.points_px
    for x, y in points[[LEFT, RIGHT]]:
        column, row = round(x), round(y)
        patch = image[row - 6 : row + 7, column - 6 : column + 7]
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
    assert hidden(shown(TURNED_LEFT)) == {"rlc"}
    assert np.rad2deg(shown(TURNED_RIGHT).target.position[1]) < -30
    assert "llc" in hidden(shown(TURNED_RIGHT))
    assert hidden(shown(0)) == set()


def test_signs_of_the_motions() -> None:
    """Positive theta moves the nose down, to image left, and rolls the head clockwise."""
    start, left, nodded, rolled = (shown(index).target for index in (0, TURNED_LEFT, 345, 615))
    nose = FEATURES.index("nose")
    assert (left.landmarks.points_px - start.landmarks.points_px)[nose, 0] < -50
    assert min(nodded.position[0], rolled.position[2]) > np.deg2rad(20)
    assert (nodded.landmarks.points_px - start.landmarks.points_px)[nose, 1] > 50
    line = rolled.landmarks.points_px[LEFT] - rolled.landmarks.points_px[RIGHT]
    assert np.arctan2(line[1], line[0]) == pytest.approx(rolled.position[2], abs=0.05)


def test_noise_has_the_spread_asked_for() -> None:
    """Pixels differ from those without noise by the standard deviation asked for."""
    assert (grey(5, image_noise_sd=3) - grey(5)).std() == pytest.approx(np.sqrt(9 + 1 / 6), rel=0.02)


def test_a_pillar_hides_what_is_behind_it() -> None:
    """The pillar covers its columns, and the features behind it count as hidden, no others."""
    pillar = {"pillar_width_px": 60, "pillar_offset_px": 50}
    marks = shown(0, **pillar).target.landmarks
    column = np.floor(marks.points_px[:, 0] + 0.5)
    assert np.array_equal(~marks.visible, (column >= 340) & (column < 400))
    changed = (grey(0, **pillar) != grey(0)).any(axis=0)
    assert np.array_equal(changed[[339, 340, 399, 400]], [0, 1, 1, 0])
    assert shown(0, pillar_width_px=640).target.hidden


def test_a_hand_comes_up_and_hides_from_below() -> None:
    """The more the hand is up, the more features it hides: first the mouth, at last the eyes."""
    none, low, half, whole = (hidden(shown(0, hand_cover=cover)) for cover in (0, 0.3, 0.6, 1))
    assert none == low == set()
    assert half <= whole
    assert half & {"lmou", "rmou"}
    assert {"nose", "lmc", "rmc", "lmou", "rmou"} <= whole


def test_sunglasses_hide_the_eyes_and_turn_with_the_head() -> None:
    """Behind sunglasses centres and corners of the eyes are hidden and dark, on a turned head too."""
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
    """At half the width all points have half the coordinates, and the picture is the same one made smaller."""
    large, small = (shown(50, image_width_px=width).target.landmarks.points_px for width in (640, 320))
    assert np.allclose(small, large / 2)
    assert np.abs(grey(50)[::2, ::2] - grey(50, image_width_px=320)).mean() < 3


def test_a_lens_out_of_focus_blurs_like_a_gaussian() -> None:
    """The same as OpenCV's Gaussian of that width, in px of a picture 640 px wide; at 0 nothing is done."""
    sharp = np.random.default_rng(0).uniform(0, 255, (60, 80)).astype(np.float32)
    assert blur(sharp, 0.0) is sharp
    expected = cv2.GaussianBlur(sharp, (0, 0), 1.5, borderType=cv2.BORDER_REPLICATE)
    assert np.abs(blur(sharp, 1.5) - expected).max() < 0.5
    assert blur(np.full((60, 80), 7.0, np.float32), 2.0) == pytest.approx(7.0, abs=1e-4)
    plain, soft, coarse = (
        np.abs(np.diff(grey(0, image_width_px=width, blur_px=sd))).mean()
        for width, sd in ((640, 0), (640, 3), (320, 3))
    )
    assert soft < 0.7 * plain
    assert coarse > soft  # twice as coarse, and blurred by half as many px


def at(texture: np.ndarray, x: float, y: float) -> float:
    return float(texture[round((y - TOP_MM) / STEP_MM), round((x - LEFT_MM) / STEP_MM)])


def test_face_has_the_albedos_of_the_reference_scene() -> None:
    """Skin, iris, pupil, nostril, mouth, brow and hair have the albedos of the reference scene where they belong."""
    face = person(99)
    texture, mouth = albedo(face, 99), (face["lmou"] + face["rmou"]) / 2
    about = {"leye": [(-1, 0, 0.08), (-4, 0, 0.38)], "nose": [(7, 9, 0.12)], "lbro": [(8, -2, 0.22)]}
    places = [(face[name][0] + x, face[name][1] + y, shade) for name, those in about.items() for x, y, shade in those]
    for x, y, expected in [*places, (30, 40, 0.62), (mouth[0], mouth[1] + 0.6, 0.15), (0, -100, 0.15)]:
        assert abs(at(texture, x, y) - expected) < 0.09, (x, y)


def test_eyes_open_between_their_corners() -> None:
    """The bright of the eye ends at the corners, inner and outer."""
    face, texture = person(99), albedo(person(99), 99)
    for side in "lr":
        inner, outer = face[side + "mc"][:2], face[side + "lc"][:2]
        assert at(texture, *outer + 0.2 * (inner - outer)) > 0.66 > at(texture, *outer + 0.15 * (outer - inner))


def test_albedo_is_between_black_and_white() -> None:
    """Whatever the face, albedo stays within 0..1 and is finite."""
    for face in (FaceModel(person(5).points_mm * (1.5, 0.7, 2)), person(6)):
        texture = albedo(face, 1)
        assert ((texture > 0) & (texture <= 1)).all()


FOCAL, CENTRE = 100.0, (32.0, 24.0)
RAMP = np.tile(np.linspace(0, 1, 101, dtype=np.float32), (101, 1))
"""Albedo x / 100 for x in 0..100 mm."""


def drawn(*quads: np.ndarray, light: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Draw squares of four corners in the camera's frame; the model's x runs from 0 to 100 along each."""
    image, inverse_depth = np.full((48, 64), 7, np.float32), np.zeros((48, 64), np.float32)
    model = np.array([[0.0, 0, 0], [100, 0, 0], [100, 100, 0], [0, 100, 0]])
    triangles, shine = np.array([[0, 1, 2], [0, 2, 3]], np.int32), np.full(4, light)
    for quad in quads:
        seen = project(quad, FOCAL, CENTRE)
        rasterise(image, inverse_depth, triangles, *seen, model, shine, RAMP, (0.0, 0.0, 1.0), (1e9, 0.0))
    return image, inverse_depth


def square(left: float, right: float, half: float = 10.0) -> np.ndarray:
    return np.array([[-half, -half, left], [half, -half, right], [half, half, right], [-half, half, left]])


def test_texture_is_interpolated_in_perspective() -> None:
    """On a slanted square each pixel shows the albedo of the point that its ray meets, not of the share of pixels."""
    image, inverse_depth = drawn(square(60, 180))
    for column in range(20, 36):
        # The ray (t, 0, 1) z meets the square where -10 + 20 s = t z and z = 60 + 120 s.
        t = (column - CENTRE[0]) / FOCAL
        s = (10 + 60 * t) / (20 - 120 * t)
        assert image[24, column] == pytest.approx(255 * s, abs=0.01)
        assert 1 / inverse_depth[24, column] == pytest.approx(60 + 120 * s, rel=1e-5)


def test_only_the_square_s_own_pixels_are_touched() -> None:
    """Pixels inside the outline are drawn, all others keep what they had."""
    image, inverse_depth = drawn(square(100, 100))
    rows, columns = np.mgrid[:48, :64]
    inside = (np.abs(columns - 32) <= 10) & (np.abs(rows - 24) <= 10)
    assert np.array_equal(inverse_depth > 0, inside)
    assert (image[~inside] == 7).all()


def test_what_is_nearer_is_seen() -> None:
    """The nearer of two squares is seen, in whichever order they are drawn; one seen from behind leaves no pixel.

    A square larger than the picture fills it and writes nowhere else.
    """
    near, far = square(80, 80, 4), square(120, 120, 30)
    image, inverse_depth = drawn(near, far)
    assert np.array_equal(image, drawn(far, near)[0])
    assert inverse_depth[24, [32, 50]] == pytest.approx([1 / 80, 1 / 120])
    assert not drawn(square(100, 100)[::-1].copy())[1].any()
    assert (drawn(square(100, 100, 500))[1] > 0).all()


def test_light_adds_up() -> None:
    """Light is ambient, plus the lamp by how much the surface faces the camera, plus the sun likewise."""
    normals = np.array([[0.0, 0, -1], [1, 0, 0], [0, 0, 1]])
    light = lit(normals, np.array([1.0, 0, 0]), 0.18, 0.72, 0.3)
    assert light.tolist() == pytest.approx([0.9, 0.48, 0.18])
    assert drawn(square(100, 100), light=0.5)[0][24, 32] == pytest.approx(255 * 0.5 * 0.5, abs=0.5)


def script_deg(frames: int = SCRIPT_FRAMES) -> np.ndarray:
    return np.rad2deg([angles_rad(k / SCRIPT_FRAMES, 1.0) for k in range(frames)])


def moved(**values: float) -> HeadSceneParameters:
    return revise(HeadSceneParameters(), values)


def test_script_has_its_motions_in_order() -> None:
    """Turns of 35 degrees, then nods and rolls of 25, two of each, and rests between them.

    As many frames as the reference counts have an axis beyond 20 degrees, and from frame to frame, also from the end
    of the script to its beginning, the head turns by less than 4 degrees.
    """
    twice = script_deg(2 * SCRIPT_FRAMES)
    degrees = twice[:SCRIPT_FRAMES]
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
    """When speed or amplitude change in mid-run, the pose goes on from where it was."""
    before, after = moved(speed=1, amplitude=1), moved(speed=0.2, amplitude=0.2)
    path = []
    for frame in range(200):
        spans = [(min(frame, 80), before), (frame - 80, after)] if frame > 80 else [(frame, before)]
        path.append(angles_rad(script_time(spans), eased_amplitude(spans, 1.0)))
    assert np.rad2deg(np.abs(np.diff(path, axis=0)).max()) < 4
    assert np.abs(path[-1]).max() < np.abs(path[80]).max()


def test_speed_is_summed_and_amplitude_lags() -> None:
    """At twice the speed the script takes half the frames; the amplitude reaches what is asked for after a while."""
    assert script_time([(450, moved(speed=2))]) == pytest.approx(1)
    assert script_time([(100, moved(speed=0)), (90, moved())]) == pytest.approx(0.1)
    assert eased_amplitude([(15, moved(amplitude=0))], 1.0) == pytest.approx(np.exp(-1))
    assert eased_amplitude([(500, moved(amplitude=0.5))], 1.0) == pytest.approx(0.5)
    assert not angles_rad(0.3, 0.0).any()
