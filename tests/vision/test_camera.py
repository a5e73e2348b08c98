"""How far a picture has moved."""

import cv2
import numpy as np
import pytest

from pftrack.vision.matching import camera_shift, small_grey


def textured(height: int, width: int, seed: int = 0) -> np.ndarray:
    noise = np.random.default_rng(seed).uniform(0, 255, (height, width, 3)).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), 6)
    return cv2.normalize(smooth, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)


@pytest.mark.parametrize(("across", "down"), [(0, 0), (7, -3), (-24, 18), (30, 0)])
@pytest.mark.parametrize("scale", [1, 2, 4])
def test_a_moved_picture_is_found_out(across: int, down: int, scale: int) -> None:
    """What lies `across` and `down` further in the next picture is so far off, to half a small pixel."""
    whole = textured(120 * scale + 80, 160 * scale + 80)
    before = whole[40 : 40 + 120 * scale, 40 : 40 + 160 * scale]
    after = whole[40 - down : 40 - down + 120 * scale, 40 - across : 40 - across + 160 * scale]
    found = camera_shift(small_grey(before.copy()), after.copy(), small_grey(after.copy()))
    assert np.allclose(found, (across, down), atol=0.5 * scale)


def test_what_moves_on_a_plain_ground_is_not_moved_out_of_sight() -> None:
    """A picture of nothing has not moved; a square alone moves as the square does, or stays, but nothing else."""
    plain = np.full((90, 120, 3), 90, np.uint8)
    assert camera_shift(small_grey(plain), plain, small_grey(plain)).tolist() == [0.0, 0.0]
    before, after = plain.copy(), plain.copy()
    before[30:50, 40:60], after[30:50, 44:64] = 200, 200
    found = camera_shift(small_grey(before), after, small_grey(after))
    assert -0.5 <= found[0] <= 4.5
    assert abs(found[1]) <= 0.5


def test_small_pictures_are_means_in_grey() -> None:
    """A small picture is about 160 px long, and a pixel of it the mean of a square."""
    picture = textured(240, 320)
    small = small_grey(picture)
    assert small.shape == (120, 160)
    grey = picture[:2, :2].astype(float) @ (77 / 256, 150 / 256, 29 / 256)
    assert abs(float(small[0, 0]) - grey.mean()) <= 1.0
    assert camera_shift(small[:-1], picture, small).tolist() == [0.0, 0.0]
