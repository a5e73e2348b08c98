"""Windows in cells: what tells a target where histograms do not, and what a score depends on."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.vision.likelihoods import cells, histogram

MIDDLE, HALF = np.array([80.0, 60.0]), np.array([16.5, 12.5])


def stripes(grey: int = 0) -> NDArray[np.uint8]:
    """Upright stripes on lying ones, so that all places have the same histogram; some lines may be grey."""
    rows, columns = np.mgrid[:120, :160]
    inside = (abs(columns - 80) <= 16) & (abs(rows - 60) <= 12)
    bright = 70 + 100 * np.where(inside, (columns - 80) // 4 % 2, rows // 4 % 2)
    bright[50 : 50 + grey, 64:97] = 120
    image = np.repeat(bright[..., None], 3, axis=2).astype(np.uint8)
    image.flags.writeable = False
    return image


KNOWN = cells.begin(stripes(), MIDDLE, HALF)


def scores(image: NDArray[np.uint8], offsets: Floats, known: cells.Cells = KNOWN) -> Floats:
    return np.asarray(cells.scores(image, cells.windows_around(MIDDLE, HALF, offsets), known))


def test_edges_tell_what_histograms_do_not() -> None:
    """Stripes that run the other way score much on the target and little beside it, where rho is near 1.

    A window that is too large or too small scores less, too.
    """
    found = scores(stripes(), cells.AROUND)
    assert found[0] > 0.6
    assert found[1:].mean() < 0.25
    assert found[1:].max() < found[0] - 0.15
    window = histogram.Window(16, 12)
    model = histogram.fit(stripes(), MIDDLE, window, "hsv")
    assert histogram.similarity(stripes(), MIDDLE + 30.0, window, "hsv", model) > 0.95
    small, right, large = scores(stripes(), np.array([(0, 0, size) for size in (-0.3, 0.0, 0.3)]))
    assert max(small, large) < right - 0.3


@pytest.mark.parametrize("step", [1, 3])
def test_a_score_is_that_of_the_window_alone(step: int) -> None:
    """What else is weighed at the same time changes no bit, also where pixels are averaged."""
    offsets = np.random.default_rng(0).uniform(-2, 2, (40, 3)) * (1, 1, 0.3)
    known = KNOWN._replace(step=step)
    together = scores(stripes(), offsets, known)
    assert together.tolist() == [scores(stripes(), offset[None], known)[0] for offset in offsets]


def test_windows_beside_the_picture_score_nothing() -> None:
    """A place that is not finite, and one outside the picture, has the score 0; one at the edge is finite."""
    places, zeros = np.array([np.nan, -500.0, np.inf, 0.0]), np.zeros(4)
    found = cells.scores(stripes(), (places, zeros, zeros + 16.5, zeros + 12.5), KNOWN)
    assert found[:3].tolist() == [0.0] * 3
    assert 0.0 <= found[3] <= 1.0


def test_what_is_seen_is_learned() -> None:
    """A target that looks different is worth more again once it was seen so."""
    before = scores(stripes(grey=12), cells.HERE)[0]
    known = KNOWN
    for _ in range(10):
        known = cells.learn(known, stripes(grey=12), MIDDLE, HALF, 0.1)
    assert scores(stripes(grey=12), cells.HERE, known)[0] > before + 0.1
    assert scores(stripes(), cells.HERE)[0] > 0.6
