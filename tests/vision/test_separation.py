"""Separation: likelihood on a target against that around it, by cases small enough to count."""

import numpy as np
import pytest

from pftrack.vision.likelihoods import chromaticity
from pftrack.vision.likelihoods.separation import contrast, separation

BOX = (40.0, 40.0, 20.0, 20.0)
COLUMNS, ROWS = np.meshgrid(np.arange(100) + 0.5 - 50, np.arange(100) + 0.5 - 50)
RADIUS = np.hypot(COLUMNS, ROWS)
TARGET = RADIUS <= 10


def test_contrast_is_what_is_missing_around() -> None:
    """Surroundings as likely as the target, or more, leave none; impossible ones leave all."""
    for around, expected in ((0.0, 1.0), (0.25, 0.75), (1.0, 0.0), (2.0, 0.0)):
        assert (contrast(1.0, around), contrast(0.0, around)) == (expected, 0.0)


def test_means_are_taken_on_the_target_and_around_it() -> None:
    """1 on the disc, 0.25 around it: that is what is found; beyond three times its size nothing counts as around.

    What lies between the disc and the circle through the corners of the box may be anything.
    """
    picture = np.where(TARGET, 1.0, 0.25)
    picture[RADIUS > 30] = 1.0
    found = separation(picture, (), BOX)
    assert (found.on, found.around, found.contrast) == pytest.approx((1.0, 0.25, 0.75))
    assert found.alike == 1.0  # all the rest of the picture looks like it
    picture = np.where(TARGET, 1.0, 0.2)
    picture[(RADIUS > 10) & (RADIUS <= 14.1)] = 0.9
    assert separation(picture, (), BOX).around == pytest.approx(0.2)


def test_what_comes_by_later_counts() -> None:
    """The surroundings are those of the first picture, or of all of them if these are more alike."""
    first = np.where(TARGET, 1.0, 0.1)
    for later, around in ((0.7, 0.4), (0.0, 0.1)):
        assert separation(first, [np.full((100, 100), later)], BOX).around == pytest.approx(around)


def test_a_box_that_fills_the_picture_has_its_corners_around_it() -> None:
    """There is nothing else, and one pixel has nothing at all."""
    picture = np.where(TARGET, 1.0, 0.5)[40:60, 40:60]
    assert separation(picture, (), (0.0, 0.0, 20.0, 20.0)).around == pytest.approx(0.5)
    assert separation(np.ones((1, 1)), (), (0.0, 0.0, 1.0, 1.0)).contrast == 1.0


def test_the_map_is_the_likelihood_of_every_pixel() -> None:
    """It is what particles on the pixels weigh, but for the constant that makes its peak 1."""
    picture = np.random.default_rng(5).integers(0, 256, (12, 9, 3)).astype(np.uint8)
    picture[3, 4] = 0  # black has no colour
    model = chromaticity.ColourModel((0.4, 0.3), (0.1, 0.2))
    rows, columns = np.mgrid[:12, :9]
    states = np.column_stack([columns.ravel(), rows.ravel()]).astype(np.float64)
    weighed = np.exp(chromaticity.log_likelihood(picture, states, model, 0.05)).reshape(12, 9)
    np.testing.assert_allclose(chromaticity.likelihood_map(picture, model, 0.05), weighed / 1.05, rtol=1e-12)
    picture = np.array([[[100, 100, 0], [100, 0, 100]]], np.uint8)
    redness = chromaticity.ColourModel((0.5, 0.9), (0.1, np.inf))  # alone, as green counts for nothing
    np.testing.assert_allclose(chromaticity.likelihood_map(picture, redness, 0.0), 1.0)
