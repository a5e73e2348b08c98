"""Windows in cells: what tells a target where histograms do not, and what a score depends on."""

import numpy as np
import pytest

from pftrack.core.arrays import Floats
from pftrack.vision.likelihoods import cells

MIDDLE, HALF = np.array([80.0, 60.0]), np.array([16.5, 12.5])


def stripes(grey: int = 0) -> np.ndarray:
    """Upright stripes on lying ones, so that all places have the same histogram; some lines may be grey."""
    rows, columns = np.mgrid[:120, :160]
    inside = (abs(columns - 80) <= 16) & (abs(rows - 60) <= 12)
    bright = 70 + 100 * np.where(inside, (columns - 80) // 4 % 2, rows // 4 % 2)
    bright[50 : 50 + grey, 64:97] = 120
    image = np.repeat(bright[..., None], 3, axis=2).astype(np.uint8)
    image.flags.writeable = False
    return image


KNOWN = cells.begin(stripes(), MIDDLE, HALF)


def scores(image: np.ndarray, offsets: Floats, known: cells.Cells = KNOWN) -> Floats:
    return np.asarray(cells.scores(image, cells.windows_around(MIDDLE, HALF, offsets), known))


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
