"""Likelihoods of places in pictures: colour, edges, measured points, and windows in parts."""

import cv2
import numpy as np
import pytest
from scipy.stats import median_abs_deviation

from pftrack.core.numerics.random import log_density
from pftrack.vision.likelihoods import chromaticity, histogram, points
from pftrack.vision.likelihoods.chromaticity import ColourModel
from pftrack.vision.likelihoods.counting import BINS, bin_table
from pftrack.vision.likelihoods.edges import log_likelihood
from pftrack.vision.likelihoods.histogram import Background, Window, background_of, fit, roots_of, shares, similarity
from tests.vision.refusing import refuse

REDNESS = ColourModel((2 / 3, 1 / 6), (0.05, np.inf))


def picture() -> np.ndarray:
    image = np.full((20, 30, 3), 100, dtype=np.uint8)
    image[5:10, 8:14] = (200, 50, 50)
    return image


def test_likelihood_is_eleven_to_one() -> None:
    """On the target the likelihood is 1.1, elsewhere and outside the picture 0.1.

    Away from the mean the kernel falls as the product of two Gaussians.
    """
    states = np.array([[10, 7], [0, 0], [-5, 7], [10, 400], [np.nan, 1], [np.inf, 1]])
    values = np.exp(chromaticity.log_likelihood(picture(), np.pad(states, ((0, 0), (0, 2))), REDNESS, 0.1))
    assert np.allclose(values, [1.1, 0.1, 0.1, 0.1, 0.1, 0.1], atol=1e-6)
    image, model = np.array([[[120, 60, 20]]], dtype=np.uint8), ColourModel((0.5, 0.2), (0.1, 0.2))
    expected = 0.05 + np.exp(-0.5 * ((0.6 - 0.5) / 0.1) ** 2 - 0.5 * ((0.3 - 0.2) / 0.2) ** 2)
    assert np.exp(chromaticity.log_likelihood(image, np.zeros((1, 2)), model, 0.05)) == pytest.approx(expected)


def test_pixels_are_rounded_half_up() -> None:
    """The pixel of a position is that of floor(u + 0.5), floor(v + 0.5)."""
    states = np.array([[7.4999, 7], [7.5, 7], [13.4999, 7], [13.5, 7], [10, 4.5], [10, 4.4999], [-0.5, 0], [-0.51, 0]])
    values = np.exp(chromaticity.log_likelihood(picture(), states, REDNESS, 0.1))
    assert (values > 1).tolist() == [False, True, True, False, True, False, False, False]


def test_centroid_of_the_target() -> None:
    """The centroid is the mean of the target's pixels and ignores brightness; without any there is none."""
    centre = chromaticity.centroid(picture(), REDNESS)
    assert np.allclose(centre, [10.5, 7.0], atol=1e-4)
    assert np.allclose(chromaticity.centroid(picture() // 2, REDNESS), centre, atol=1e-2)
    assert chromaticity.centroid(np.full((9, 9, 3), 100, dtype=np.uint8), REDNESS) is None


def test_fit_finds_mean_and_spread() -> None:
    """Mean and spread are fitted to the ellipse in the box, whatever lies in its corners or on a fifth of it."""
    rng = np.random.default_rng(0)
    rows, columns = np.mgrid[:60, :60]
    disc = np.hypot(rows - 29.5, columns - 29.5) <= 20
    green = np.array([60, 140, 50]) + rng.normal(0, 6, size=(60, 60, 3))
    image = np.where(disc[..., None], np.clip(green, 0, 255), 200).astype(np.uint8)
    image[25:31, 10:50] = (220, 170, 140)  # a finger
    model = chromaticity.fit(image, (9.5, 9.5, 40, 40))
    assert np.allclose(model.mean, (0.24, 0.56), atol=0.01)
    assert all(0.01 <= spread <= 0.05 for spread in model.spread)
    assert chromaticity.median_colour(image, (9.5, 9.5, 40, 40)).startswith("#3")
    for box in ((100, 100, 5, 5), (0, 0, 4, 4)):  # outside the picture, and on black
        refuse("at least one pixel", chromaticity.fit, np.zeros((20, 20, 3), dtype=np.uint8), box)


def test_the_spread_is_that_of_a_gaussian_with_this_median_deviation() -> None:
    """It is the median absolute deviation, scaled as for a Gaussian."""
    rng = np.random.default_rng(8)
    image = np.clip(rng.normal([150, 60, 60], [25, 12, 12], (60, 80, 3)), 1, 255).astype(np.uint8)
    box = (0.0, 0.0, 80.0, 60.0)
    pixels = chromaticity._pixels(image, box)
    expected = median_abs_deviation(pixels[:, :2] / pixels.sum(axis=1, keepdims=True), axis=0, scale="normal")
    assert chromaticity.fit(image, box).spread == pytest.approx(expected, rel=1e-4)


# Outlines beside edges: the best place, the cap, what is outside, and what is refused.

ANGLES = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
CIRCLE = 12.0 * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
IMAGE = np.zeros((80, 100, 3), np.uint8)
cv2.circle(IMAGE, (40, 30), 12, (255, 255, 255), -1)


def test_the_outline_is_most_likely_where_the_disc_is() -> None:
    """The best place on a lattice is the middle of the disc, and it is within a pixel of its edges."""
    across, down = np.meshgrid(np.arange(15.0, 80.0), np.arange(15.0, 65.0))
    states = np.column_stack([across.ravel(), down.ravel(), np.zeros(across.size)])
    found = log_likelihood(IMAGE, states, CIRCLE)
    assert np.abs(states[found.argmax(), :2] - (40.0, 30.0)).max() <= 1.0
    assert found.max() > -0.5 * (1.0 / 3.0) ** 2 - 1e-6


def test_no_point_costs_more_than_the_cap() -> None:
    """Far from all edges, outside the picture and at NaN every point has the cap; so has a picture without edges.

    A wrong outline is refused, and so is a spread of nothing.
    """
    worst = -0.5 * (10.0 / 3.0) ** 2
    beside, nothing = np.zeros_like(IMAGE), np.zeros_like(IMAGE)
    beside[:, :2] = 255  # the nearest pixels of the picture are edges, and the outline is not in it
    for image, states in (
        (IMAGE, [[-500.0, 20.0], [np.nan, 3.0], [np.inf, -np.inf], [87.0, 65.0]]),
        (beside, [[-20.0, 40.0]]),
        (nothing, [[40.0, 30.0]]),
    ):
        assert log_likelihood(image, np.array(states), CIRCLE) == pytest.approx(worst)
    refuse("outline_px must", log_likelihood, IMAGE, np.zeros((3, 2)), np.zeros(4))
    refuse("spread must be above 0 px, got 0", log_likelihood, IMAGE, np.zeros((3, 2)), CIRCLE, spread_px=0.0)


def test_each_point_has_its_own_noise() -> None:
    """Up to a constant for each point, the score is the log density of its measurement.

    Forty standard deviations away, where the density would be zero, the scores still differ (eq. 4.7).
    """
    far = points.log_likelihood(np.array([[[40.0, 0.0], [41.0, 0.0]]]), np.zeros((1, 2)), np.ones(1))
    assert far.tolist() == [[-800.0, -840.5]]
    rng = np.random.default_rng(0)
    positions, measured, noise = rng.normal(size=(3, 20, 2)), rng.normal(size=(3, 2)), np.array([0.5, 1.0, 100.0])
    scores = points.log_likelihood(positions, measured, noise)
    for n in range(3):
        exact = log_density(positions[n], measured[n], noise[n] ** 2 * np.eye(2))
        assert np.ptp(scores[n] - exact) < 1e-12


# Windows in parts, and what their surroundings tell.

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
    assert np.array_equal(roots_of(model, histogram.NO_BACKGROUND), np.sqrt(model))


def test_contrast_tells_the_size() -> None:
    """The first window lacks nothing; one that is larger, smaller or beside loses what contrast it lacks."""
    window = Window(10, 12)
    model = fit(scene(), MIDDLE, window, "hsv")
    background = background_of(scene(), MIDDLE, (10, 12), "hsv", model, weigh=False, contrast=0.5)
    assert background.inside > 0.9
    assert background.around < 0.1

    def cost(seen: Window, place: np.ndarray = MIDDLE, known: Background = background) -> float:
        return similarity(scene(), place, seen, "hsv", model) - similarity(scene(), place, seen, "hsv", model, known)

    assert cost(window) == pytest.approx(0.0, abs=1e-9)
    assert min(cost(Window(15, 18)), cost(Window(6, 7)), cost(window, MIDDLE + np.array([12.0, 0.0]))) > 0.05
