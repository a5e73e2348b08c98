import numpy as np
import pytest
from scipy.stats import median_abs_deviation

from pftrack.vision.likelihoods import chromaticity
from pftrack.vision.likelihoods.chromaticity import ColourModel

REDNESS = ColourModel((2 / 3, 1 / 6), (0.05, np.inf))


def picture() -> np.ndarray:
    image = np.full((20, 30, 3), 100, dtype=np.uint8)
    image[5:10, 8:14] = (200, 50, 50)
    return image


def test_likelihood_is_eleven_to_one() -> None:
    """On the target the likelihood is 1.1, elsewhere and outside the picture 0.1."""
    states = np.array(
        [[10, 7, 0, 0], [0, 0, 0, 0], [-5, 7, 0, 0], [10, 400, 0, 0], [np.nan, 1, 0, 0], [np.inf, 1, 0, 0]]
    )
    values = np.exp(chromaticity.log_likelihood(picture(), states, REDNESS, 0.1))
    assert np.allclose(values, [1.1, 0.1, 0.1, 0.1, 0.1, 0.1], atol=1e-6)


def test_pixels_are_rounded_half_up() -> None:
    """The pixel of a position is that of floor(u + 0.5), floor(v + 0.5)."""
    states = np.array([[7.4999, 7], [7.5, 7], [13.4999, 7], [13.5, 7], [10, 4.5], [10, 4.4999], [-0.5, 0], [-0.51, 0]])
    values = np.exp(chromaticity.log_likelihood(picture(), states, REDNESS, 0.1))
    assert (values > 1).tolist() == [False, True, True, False, True, False, False, False]


def test_kernel_is_gaussian_in_both_coordinates() -> None:
    """Away from the mean the kernel falls as the product of two Gaussians."""
    image = np.array([[[120, 60, 20]]], dtype=np.uint8)
    model = ColourModel((0.5, 0.2), (0.1, 0.2))
    expected = 0.05 + np.exp(-0.5 * ((0.6 - 0.5) / 0.1) ** 2 - 0.5 * ((0.3 - 0.2) / 0.2) ** 2)
    value = chromaticity.log_likelihood(image, np.zeros((1, 2)), model, 0.05)
    assert np.exp(value[0]) == pytest.approx(expected)


def test_black_has_no_colour() -> None:
    """A black picture is background everywhere, and with rho = 0 impossible, without a warning."""
    black = np.zeros((4, 4, 3), dtype=np.uint8)
    assert np.exp(chromaticity.log_likelihood(black, np.zeros((1, 2)), REDNESS, 0.1)) == pytest.approx(0.1)
    assert chromaticity.log_likelihood(black, np.zeros((1, 2)), REDNESS, 0.0)[0] == -np.inf
    assert chromaticity.centroid(black, REDNESS) is None


def test_centroid_of_the_target() -> None:
    """The centroid is the mean of the target's pixels and ignores brightness; without any there is none."""
    centre = chromaticity.centroid(picture(), REDNESS)
    assert np.allclose(centre, [10.5, 7.0], atol=1e-4)
    assert np.allclose(chromaticity.centroid(picture() // 2, REDNESS), centre, atol=1e-2)
    assert chromaticity.centroid(np.full((9, 9, 3), 100, dtype=np.uint8), REDNESS) is None


def test_fit_finds_mean_and_spread() -> None:
    """Mean and spread are fitted to the ellipse in the box, whatever lies in its corners or on a fifth of it."""
    rng = np.random.default_rng(0)
    image = np.full((60, 60, 3), 200, dtype=np.uint8)
    rows, columns = np.mgrid[:60, :60]
    disc = np.hypot(rows - 29.5, columns - 29.5) <= 20
    green = np.array([60, 140, 50]) + rng.normal(0, 6, size=(60, 60, 3))
    image[disc] = np.clip(green, 0, 255).astype(np.uint8)[disc]
    image[25:31, 10:50] = (220, 170, 140)  # a finger
    model = chromaticity.fit(image, (9.5, 9.5, 40, 40))
    assert np.allclose(model.mean, (0.24, 0.56), atol=0.01)
    assert all(0.01 <= spread <= 0.05 for spread in model.spread)
    assert chromaticity.median_colour(image, (9.5, 9.5, 40, 40)).startswith("#3")


def test_fit_refuses_what_it_cannot_see() -> None:
    """A box outside the picture or on black is refused."""
    for box in ((100, 100, 5, 5), (0, 0, 4, 4)):
        with pytest.raises(ValueError, match="at least one pixel"):
            chromaticity.fit(np.zeros((20, 20, 3), dtype=np.uint8), box)


def test_the_spread_is_that_of_a_gaussian_with_this_median_deviation() -> None:
    """It is the median absolute deviation, scaled as for a Gaussian."""
    rng = np.random.default_rng(8)
    image = np.clip(rng.normal([150, 60, 60], [25, 12, 12], (60, 80, 3)), 1, 255).astype(np.uint8)
    box = (0.0, 0.0, 80.0, 60.0)
    pixels = chromaticity._pixels(image, box)
    shares = pixels[:, :2] / pixels.sum(axis=1, keepdims=True)
    expected = median_abs_deviation(shares, axis=0, scale="normal")
    assert chromaticity.fit(image, box).spread == pytest.approx(expected, rel=1e-4)
