"""Pictures: how far they have moved, what is found in them again, and films of them."""

import errno
from pathlib import Path
from unittest.mock import Mock

import av
import cv2
import numpy as np
import pytest

from pftrack.vision.film import FilmWriter
from pftrack.vision.matching import LARGEST_TEMPLATE_PX, Cost, camera_shift, cost_map, cut, match, small_grey
from tests.vision.refusing import refuse

REACH = 6
COSTS: list[Cost] = ["difference", "correlation"]


def texture(seed: int = 0, size: tuple[int, int] = (60, 80)) -> np.ndarray:
    smooth = cv2.GaussianBlur(np.random.default_rng(seed).normal(0, 1, size), (0, 0), 1.5)
    return np.clip(128 + 50 * smooth / smooth.std(), 0, 255).astype(np.uint8)


def brute(grey: np.ndarray, template: np.ndarray, x: int, y: int, cost: Cost) -> float:
    half = len(template) // 2
    piece = grey[max(y - half, 0) : y + half + 1, max(x - half, 0) : x + half + 1].astype(np.float64)
    if x < half or y < half or piece.shape != template.shape:
        return np.inf
    if cost == "difference":
        return float(np.abs(piece - template).mean())
    if piece.std() == 0 or template.std() == 0:
        return 1.0
    return 1.0 - float(np.corrcoef(piece.ravel(), template.ravel())[0, 1])


@pytest.mark.parametrize("cost", COSTS)
@pytest.mark.parametrize("size", [1, LARGEST_TEMPLATE_PX])
def test_costs_are_those_of_the_definition(cost: Cost, size: int) -> None:
    """Map, least and second least cost are those of a search by NumPy, at the edges of the picture too."""
    earlier, later = texture(), texture(2)
    around = np.random.default_rng(1).integers(0, (80, 60), (6, 2))
    around[:2] = [[1, 2], [79, 57]]
    templates = cut(earlier, around, size)
    found, steps = match(later, templates, around, REACH, cost), np.arange(-REACH, REACH + 1)
    for k, (x, y) in enumerate(around):
        full = np.array([[brute(later, templates[k], x + dx, y + dy, cost) for dx in steps] for dy in steps])
        dx, dy = found.places[k] - around[k]
        away = np.maximum(np.abs(steps - dx), np.abs(steps - dy)[:, None])
        assert cost_map(later, templates[k], (x, y), REACH, cost) == pytest.approx(full, abs=1e-9)
        assert [found.costs[k], full[REACH + dy, REACH + dx]] == pytest.approx([full.min()] * 2, abs=1e-9)
        assert found.seconds[k] == pytest.approx(full[away >= 3].min(), abs=1e-9)


def test_of_equally_near_places_the_upper_left_is_taken() -> None:
    """A tie at equal distances is settled by the order of the pixels; a flat template does not wander."""
    flat, around = np.full((40, 40), 90, np.uint8), np.array([[20, 20]])
    found = match(flat, cut(flat, around, 11), around, REACH, "correlation")
    assert (found.places.tolist(), found.costs[0]) == (around.tolist(), found.seconds[0])
    assert not found.offsets.any()
    grey = np.zeros((40, 40), np.uint8)
    for x, y in ((16, 20), (24, 20), (20, 16), (20, 24)):
        grey[y, x] = 200
    found = match(grey, np.full((1, 1, 1), 200, np.uint8), np.array([[20, 20]]), REACH)
    assert found.places.tolist() == [[20, 16]]


@pytest.mark.parametrize("shift", [0.25, -0.4])
def test_the_place_between_pixels_is_found(shift: float) -> None:
    """A picture that has moved by a part of a pixel is matched to about a tenth of one."""
    grey, around = texture(), np.array([[x, y] for x in (20, 35, 50, 62) for y in (18, 30, 42)])
    move = np.array([[1.0, 0.0, shift], [0.0, 1.0, -shift]])
    moved = cv2.warpAffine(grey, move, (80, 60), flags=cv2.INTER_CUBIC)
    found = match(moved, cut(grey, around, 11), around, 4)
    off = np.abs(found.places + found.offsets - around - [shift, -shift])
    assert np.median(off) < 0.06
    assert off.max() < 0.3


# How far a picture has moved.


def textured(height: int, width: int, seed: int = 0) -> np.ndarray:
    noise = np.random.default_rng(seed).uniform(0, 255, (height, width, 3)).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), 6)
    return cv2.normalize(smooth, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)


@pytest.mark.parametrize(("across", "down", "scale"), [(0, 0, 1), (7, -3, 1), (-24, 18, 2), (30, 0, 4)])
def test_a_moved_picture_is_found_out(across: int, down: int, scale: int) -> None:
    """What lies `across` and `down` further in the next picture is so far off, to half a small pixel."""
    wide = textured(120 * scale + 80, 160 * scale + 80)
    before, after = (wide[40 - y :, 40 - x :][: 120 * scale, : 160 * scale].copy() for x, y in ((0, 0), (across, down)))
    assert np.allclose(camera_shift(small_grey(before), after, small_grey(after)), (across, down), atol=0.5 * scale)


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


# Films hold the pictures that were written, appear whole or not at all, and play everywhere.


def grey(level: int, width: int = 64, height: int = 48) -> np.ndarray:
    return np.full((height, width, 3), level, np.uint8)


def write(path: Path, pictures: list[np.ndarray], frame_rate_hz: float = 30.0) -> None:
    with FilmWriter(path, frame_rate_hz) as film:
        for picture in pictures:
            film.write(picture)


def test_a_film_holds_its_pictures_in_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was written is read again: H.264 in yuv420p, the same number, order, rate and nearly the same levels.

    A relative name such as a time of day is the name of a file in the current folder.
    """
    monkeypatch.chdir(tmp_path)
    write(Path("2026-11-28T13:49.mp4"), [grey(level) for level in range(20, 220, 20)], 29.97)
    (path,) = tmp_path.iterdir()
    assert path.name == "2026-11-28T13:49.mp4"
    with av.open(path) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert float(stream.average_rate or 0) == pytest.approx(29.97, abs=1e-3)
        levels = [frame.to_ndarray(format="rgb24").mean() for frame in container.decode(stream)]
    np.testing.assert_allclose(levels, np.arange(20, 220, 20), atol=3)


@pytest.mark.parametrize(("width", "height"), [(65, 48), (64, 47), (1, 1)])
def test_odd_sides_are_made_even(tmp_path: Path, width: int, height: int) -> None:
    """An odd picture is not refused and loses nothing: it gets one more row or column."""
    write(tmp_path / "film.mp4", [grey(100, width, height)] * 3)
    with av.open(tmp_path / "film.mp4") as container:
        stream = container.streams.video[0]
        assert (stream.width, stream.height) == (width + width % 2, height + height % 2)
        assert sum(1 for _ in container.decode(stream)) == 3


def test_what_fails_leaves_no_film(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where writing breaks off the old file stays; no pictures make no film, nor does a full disk or no folder."""
    path = tmp_path / "film.mp4"
    write(path, [])
    with pytest.raises(OSError, match="No such file"):
        FilmWriter(tmp_path / "nowhere" / "film.mp4", 30.0)
    monkeypatch.setattr(av, "open", Mock(side_effect=OSError(errno.ENOSPC, "no space left")))
    with pytest.raises(OSError, match="no space left"):
        FilmWriter(path, 30.0)
    assert list(tmp_path.iterdir()) == []
    monkeypatch.undo()
    path.write_bytes(b"old")
    refuse("got one of", write, path, [grey(0), grey(0, width=32)])
    assert [(each, each.read_bytes()) for each in tmp_path.iterdir()] == [(path, b"old")]
