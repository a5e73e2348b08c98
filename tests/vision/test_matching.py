import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.vision.matching import LARGEST_TEMPLATE_PX, Cost, cost_map, cut, match

REACH = 6
COSTS: list[Cost] = ["difference", "correlation"]


def texture(seed: int = 0, size: tuple[int, int] = (60, 80)) -> NDArray[np.uint8]:
    smooth = cv2.GaussianBlur(np.random.default_rng(seed).normal(0, 1, size), (0, 0), 1.5)
    return np.clip(128 + 50 * smooth / smooth.std(), 0, 255).astype(np.uint8)


def places(count: int, seed: int = 1) -> NDArray[np.int64]:
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.integers(0, 80, count), rng.integers(0, 60, count)])


def brute(grey: NDArray[np.uint8], template: NDArray[np.uint8], x: int, y: int, cost: Cost) -> float:
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
@pytest.mark.parametrize("size", [1, 11, LARGEST_TEMPLATE_PX])
def test_costs_are_those_of_the_definition(cost: Cost, size: int) -> None:
    """Map, least and second least cost are those of a search by NumPy, at the edges of the picture too."""
    earlier, later, around = texture(), texture(2), places(6)
    around[:2] = [[1, 2], [79, 57]]
    templates = cut(earlier, around, size)
    found = match(later, templates, around, REACH, cost)
    steps = range(-REACH, REACH + 1)
    for k, (x, y) in enumerate(around):
        full = np.array([[brute(later, templates[k], x + dx, y + dy, cost) for dx in steps] for dy in steps])
        assert cost_map(later, templates[k], (x, y), REACH, cost) == pytest.approx(full, abs=1e-9)
        assert found.costs[k] == pytest.approx(full.min(), abs=1e-9)
        dx, dy = found.places[k] - around[k]
        assert full[REACH + dy, REACH + dx] == pytest.approx(full.min(), abs=1e-9)
        away = np.maximum(np.abs(np.arange(-REACH, REACH + 1) - dx), np.abs(np.arange(-REACH, REACH + 1) - dy)[:, None])
        assert found.seconds[k] == pytest.approx(full[away >= 3].min(), abs=1e-9)


@pytest.mark.parametrize("cost", COSTS)
def test_a_shift_is_found(cost: Cost) -> None:
    """Templates are found where the picture has moved to, at no cost, and beside it anything costs more."""
    grey, around = texture(), np.array([[20, 20], [40, 30], [55, 35]])
    found = match(np.roll(grey, (3, -2), (0, 1)), cut(grey, around, 11), around, REACH, cost)
    assert (found.places == around + np.array([-2, 3])).all()
    assert found.costs == pytest.approx(0.0, abs=1e-12)
    assert (found.seconds > 0.05).all()


@pytest.mark.parametrize("cost", COSTS)
def test_what_has_no_structure_stays(cost: Cost) -> None:
    """Where all places are equally good the nearest is taken, so that a flat template does not wander."""
    grey = np.full((40, 40), 90, np.uint8)
    around = np.array([[20, 20]])
    found = match(grey, cut(grey, around, 11), around, REACH, cost)
    assert (found.places == around).all()
    assert found.costs[0] == found.seconds[0]
    assert (found.offsets == 0).all()


def test_of_equally_near_places_the_upper_left_is_taken() -> None:
    """A tie at equal distances is settled by the order of the pixels."""
    grey = np.zeros((40, 40), np.uint8)
    for x, y in ((16, 20), (24, 20), (20, 16), (20, 24)):
        grey[y, x] = 200
    found = match(grey, np.full((1, 1, 1), 200, np.uint8), np.array([[20, 20]]), REACH)
    assert found.places.tolist() == [[20, 16]]


def test_correlation_does_not_mind_the_light() -> None:
    """A picture of half the contrast and another brightness matches by correlation, where differences are misled."""
    lattice = np.full((60, 80), 170, np.uint8)
    lattice[::11] = lattice[:, ::11] = 95
    lattice = np.clip(lattice + 0.3 * (texture().astype(float) - 128), 0, 255).astype(np.uint8)
    around = np.array([[33, 22], [44, 33], [22, 33]])
    templates = cut(lattice, around, 11)
    darker = (0.5 * lattice + 5).astype(np.uint8)
    assert (match(darker, templates, around, 13, "correlation").places == around).all()
    assert (match(darker, templates, around, 13, "difference").costs > 30).all()


@pytest.mark.parametrize("shift", [0.0, 0.25, -0.4])
def test_the_place_between_pixels_is_found(shift: float) -> None:
    """A picture that has moved by a part of a pixel is matched to about a tenth of one."""
    grey, around = texture(), np.array([[x, y] for x in (20, 35, 50, 62) for y in (18, 30, 42)])
    move = np.array([[1.0, 0.0, shift], [0.0, 1.0, -shift]])
    moved = cv2.warpAffine(grey, move, (80, 60), flags=cv2.INTER_CUBIC)
    found = match(moved, cut(grey, around, 11), around, 4)
    off = np.abs(found.places + found.offsets - around - [shift, -shift])
    assert np.median(off) < 0.06
    assert off.max() < 0.3


def test_what_cannot_be_in_the_picture_is_not_found() -> None:
    """Beyond the picture, and in one smaller than a template, there is no place: infinite cost, and where it was."""
    template = cut(texture(), np.array([[20, 20]]), 11)
    for grey, place in ((texture(), [500, -300]), (texture()[:8, :8].copy(), [4, 4]), (texture(), [-2, 20])):
        found = match(grey, template, np.array([place]), REACH if place[0] > 0 else 4)
        assert found.places.tolist() == [place]
        assert found.costs.tolist() == found.seconds.tolist() == [np.inf]


def test_unusable_templates_are_refused() -> None:
    """A sentence names the size that is allowed, or the number of places."""
    for shape in ((1, 10, 10), (1, 17, 17), (1, 9, 11)):
        with pytest.raises(ValueError, match=r"odd squares of 1 to 15 px, got"):
            match(texture(), np.zeros(shape, np.uint8), np.zeros((1, 2), np.int64), 5)
    with pytest.raises(ValueError, match=r"each of 2 templates, got an array of \(1, 2\)"):
        match(texture(), np.zeros((2, 11, 11), np.uint8), np.zeros((1, 2), np.int64), 5)
