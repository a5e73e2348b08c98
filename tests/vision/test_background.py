"""Windows in parts, and what their surroundings tell."""

import numpy as np
import pytest

from pftrack.vision.likelihoods.counting import BINS, bin_table
from pftrack.vision.likelihoods.histogram import (
    NO_BACKGROUND,
    Background,
    Window,
    background_of,
    fit,
    roots_of,
    shares,
    similarity,
)

RED, GREEN, BLUE = (200, 30, 30), (30, 160, 40), (30, 40, 200)
MIDDLE = np.array([40.0, 30.0])


def scene(upper: tuple[int, int, int] = RED, lower: tuple[int, int, int] = BLUE) -> np.ndarray:
    """A target of 21 x 24 px in two colours on green."""
    picture = np.empty((64, 90, 3), np.uint8)
    picture[:] = GREEN
    picture[18:30, 30:51], picture[30:42, 30:51] = upper, lower
    return picture


def bin_of(colour: tuple[int, int, int]) -> int:
    return int(bin_table("hsv")[colour[0] << 16 | colour[1] << 8 | colour[2]])


@pytest.mark.parametrize("kernel", [False, True])
def test_parts_are_counted_where_they_are(kernel: bool) -> None:
    """Each part counts its own pixels; all parts together are the whole window, also of one that is clipped."""
    for place in (MIDDLE, np.array([5.0, 60.0])):
        whole = shares(scene(), place, Window(10, 12, kernel), "hsv")
        parts = shares(scene(), place, Window(10, 12, kernel, (2, 3)), "hsv")
        assert parts.shape == (6 * BINS,)
        assert np.allclose(parts.reshape(6, BINS).sum(axis=0), whole, rtol=0, atol=1e-12)
    upper = shares(scene(), MIDDLE, Window(10, 12, kernel, (1, 5)), "hsv").reshape(5, BINS)
    assert upper[0, bin_of(BLUE)] == upper[1, bin_of(BLUE)] == upper[4, bin_of(RED)] == 0.0


def test_a_layout_tells_upside_down() -> None:
    """The same colours the other way round are as like as before to one histogram, and much less to parts."""
    upright, turned = scene(), scene(BLUE, RED)
    for parts, least, most in (((1, 1), 0.99, 1.0), ((1, 2), 0.0, 0.3)):
        window = Window(10, 11, False, parts)
        model = fit(upright, MIDDLE, window, "hsv")
        assert least <= similarity(turned, MIDDLE, window, "hsv", model) <= most


def test_weights_make_light_of_what_is_around() -> None:
    """A window that holds the surroundings' colour in part is a perfect match when that colour counts little."""
    window = Window(14, 16)
    model = fit(scene(), MIDDLE, window, "hsv")
    background = background_of(scene(), MIDDLE, (14, 16), "hsv", model, weigh=True, contrast=0.0)
    assert background.weights[bin_of(RED)] > 0.95
    assert background.weights[bin_of(GREEN)] < 0.4
    bare = np.full((64, 90, 3), GREEN, np.uint8)
    assert similarity(bare, MIDDLE, window, "hsv", model, background) < similarity(bare, MIDDLE, window, "hsv", model)
    assert similarity(scene(), MIDDLE, window, "hsv", model, background) == pytest.approx(1.0)
    assert np.square(roots_of(model, background)).sum() == pytest.approx(1.0)
    assert np.array_equal(roots_of(model, NO_BACKGROUND), np.sqrt(model))


def test_contrast_tells_the_size() -> None:
    """The first window lacks nothing; one that is larger, smaller or beside loses what contrast it lacks."""
    window = Window(10, 12)
    model = fit(scene(), MIDDLE, window, "hsv")
    background = background_of(scene(), MIDDLE, (10, 12), "hsv", model, weigh=False, contrast=0.5)
    assert background.inside > 0.9
    assert background.around < 0.1

    def cost(seen: Window, place: np.ndarray, known: Background = background) -> float:
        return similarity(scene(), place, seen, "hsv", model) - similarity(scene(), place, seen, "hsv", model, known)

    assert cost(window, MIDDLE) == pytest.approx(0.0, abs=1e-9)
    larger, smaller, beside = (
        cost(Window(15, 18), MIDDLE),
        cost(Window(6, 7), MIDDLE),
        cost(window, MIDDLE + np.array([12.0, 0.0])),
    )
    assert min(larger, smaller, beside) > 0.05
    # By hand: a part of the frame around the small window is the target's.
    sides = (2 * 6 + 1) * (2 * 7 + 1)
    frame = (2 * 10 + 1) * (2 * 11 + 1) - sides
    chance = background.chances / 65536
    around = chance[[bin_of(RED), bin_of(BLUE)]]
    counted = shares(scene(), MIDDLE, Window(10, 11), "hsv") * (frame + sides)
    within = shares(scene(), MIDDLE, Window(6, 7), "hsv") * sides
    expected = float(((counted - within) * chance).sum()) / frame
    assert around.min() > 0.9
    assert smaller == pytest.approx(0.5 * (expected - background.around), abs=1e-6)
