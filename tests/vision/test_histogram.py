"""The colour histogram beside a plain count, and the rules of its windows."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.vision.likelihoods import histogram
from pftrack.vision.likelihoods.counting import BINS, SPACES, bin_table
from pftrack.vision.likelihoods.histogram import Window, fit, rho_map, shares, similarity
from tests.vision.refusing import refuse

SIZE = (96, 64)
RNG = np.random.default_rng(5)
PICTURE = cv2.GaussianBlur(RNG.integers(0, 256, (SIZE[1], SIZE[0], 3)).astype(np.uint8), (0, 0), 1.0)
MIDDLE = np.array([40.0, 30.0])


def plain_bins() -> np.ndarray:
    """The bins by the words of docs/methods/colours.md."""
    hue, saturation, value = (cv2.cvtColor(PICTURE, cv2.COLOR_RGB2HSV)[:, :, k].astype(int) for k in range(3))
    h, s, v = np.floor(10 * hue / 180), np.floor(10 * saturation / 256), np.floor(10 * value / 256)
    return np.where((saturation > 25.5) & (value > 51), 10 * h + s, 100 + v).astype(int)


def plain_rho(column: int, row: int, window: Window, model: np.ndarray) -> float:
    """Rho by cutting out and counting."""
    across, down = window.reach_across_px, window.reach_down_px
    rows = slice(max(row - down, 0), max(row + down + 1, 0))
    columns = slice(max(column - across, 0), max(column + across + 1, 0))
    part = plain_bins()[rows, columns]
    if part.size < 0.25 * np.prod(window.size_px):
        return 0.0
    v, u = (np.mgrid[: SIZE[1], : SIZE[0]][k][rows, columns] for k in range(2))
    weights = np.ones(part.shape)
    if window.kernel:
        weights = 1 - ((u - column) / (across + 0.5)) ** 2 - ((v - row) / (down + 0.5)) ** 2
    counted = np.bincount(part.ravel(), np.maximum(weights, 0).ravel(), minlength=BINS)
    return float(np.sqrt(counted / counted.sum() * model).sum())


def weighed(places: np.ndarray, window: Window, model: np.ndarray, scales: np.ndarray | None = None) -> np.ndarray:
    scales = np.ones(len(places)) if scales is None else scales
    x, y = places.T.copy()
    reach = scales * window.reach_across_px, scales * window.reach_down_px
    known = bin_table("hsv"), np.sqrt(model), window.kernel, window.parts, histogram.NO_BACKGROUND
    return histogram.similarities(histogram.read_only(PICTURE), x, y, *reach, *known)


@pytest.mark.parametrize("kernel", [False, True])
@pytest.mark.parametrize("spread", [2.0, 60.0])
def test_all_windows_at_once_are_what_a_plain_count_gives(spread: float, kernel: bool) -> None:
    """Rho of clouds, narrow or all over the picture and beyond, is that of cutting out and counting each window."""
    window = Window(6, 9, kernel)
    model = fit(PICTURE, MIDDLE, window, "hsv")
    places = np.random.default_rng(1).normal(MIDDLE, spread, (150, 2))
    columns, rows = np.floor(places + 0.5).astype(int).T
    expected = [plain_rho(column, row, window, model) for column, row in zip(columns, rows, strict=True)]
    # The kernel's weights are whole numbers, 256 in the middle.
    assert np.allclose(weighed(places, window, model), expected, rtol=0, atol=4e-3 if kernel else 1e-12)


def test_windows_of_different_sizes_are_weighed_together() -> None:
    """Each window has the size it is given, rounded to pixels."""
    window = Window(5, 7)
    model = fit(PICTURE, MIDDLE, window, "hsv")
    rng = np.random.default_rng(2)
    places, scales = rng.normal(MIDDLE, 8, (80, 2)), np.exp(0.3 * rng.standard_normal(80))
    reach = np.floor(np.outer(scales, (5, 7)) + 0.5).astype(int)
    centres = np.floor(places + 0.5).astype(int)
    expected = [plain_rho(*centre, Window(*size), model) for centre, size in zip(centres, reach, strict=True)]
    assert np.allclose(weighed(places, window, model, scales), expected, rtol=0, atol=1e-12)


def test_a_quarter_of_a_window_must_lie_within_the_picture() -> None:
    """Clipped windows count what is there; under 25 % coverage, and at places that are none, rho is 0."""
    flat = np.full((40, 40, 3), (200, 40, 40), np.uint8)
    window = Window(4, 4)
    model = fit(flat, np.array([20.0, 20.0]), window, "hsv")
    # 9 columns: at -1 four are within, at -2 three of nine (a third), at -3 two (22 %).
    found = [similarity(flat, np.array([x, 20.0]), window, "hsv", model) for x in (-1, -2, -3, -30, 42, np.nan, np.inf)]
    assert found == pytest.approx([1, 1, 0, 0, 0, 0, 0])
    assert shares(flat, np.array([-30.0, 0.0]), window, "hsv").sum() == 0
    refuse("a quarter", fit, flat, np.array([-30.0, 0.0]), window, "hsv")


@given(st.integers(0, 255), st.integers(0, 255), st.integers(0, 255))
def test_bins_of_colours(red: int, green: int, blue: int) -> None:
    """Every colour has one of 110 bins in each space, that of HSV by A3; a grey has a bin of brightness."""
    colour = np.array([[[red, green, blue]]], np.uint8)
    hue, saturation, value = cv2.cvtColor(colour, cv2.COLOR_RGB2HSV)[0, 0].astype(int)
    coloured = saturation > 25.5 and value > 51
    bins = {space: bin_table(space)[65536 * red + 256 * green + blue] for space in SPACES}
    assert bins["hsv"] == (10 * (10 * hue // 180) + 10 * saturation // 256 if coloured else 100 + 10 * value // 256)
    assert max(bins.values()) < BINS
    if red == green == blue:
        assert min(bins["hsv"], bins["lab"]) >= 100


def test_a_map_has_a_value_for_each_cell() -> None:
    """A map of rho is that of windows in the middles of its cells, and highest at the target."""
    window = Window(6, 9)
    model = fit(PICTURE, MIDDLE, window, "hsv")
    found = rho_map(PICTURE, window, "hsv", model, 4)
    assert found.shape == (16, 24)
    assert found[7, 10] == similarity(PICTURE, np.array([42.0, 30.0]), window, "hsv", model)
    exact = rho_map(PICTURE, window, "hsv", model, 1)
    assert np.unravel_index(int(exact.argmax()), exact.shape) == (30, 40)
