import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.experiments.linkage.sets.cells import cosine_range, link_cells, section
from pftrack.reproduce.linkage_regions import random_shape, values

NOTHING = (-1.0, 0.0, 0.0)


@given(st.floats(-10, 10), st.floats(0, 7))
def test_the_range_of_cosines_is_exact(first: float, wide: float) -> None:
    """It is that of a dense sample, within what the sample misses."""
    least, most = cosine_range(first, first + wide)
    sample = np.cos(np.linspace(first, first + wide, 4001))
    assert least - 1e-15 <= sample.min()
    assert sample.max() <= most + 1e-15
    assert sample.min() - least < 1e-5
    assert most - sample.max() < 1e-5


def test_a_section_is_the_extent_of_a_slice_of_the_ellipse() -> None:
    """Its ends are those of the ellipse's points between two values of x, the apex included."""
    rng = np.random.default_rng(0)
    circle = np.linspace(0, 2 * np.pi, 20001)
    for _ in range(300):
        shape = random_shape(rng, 2)
        x, y = np.linalg.cholesky(shape) @ np.array([np.cos(circle), np.sin(circle)])
        first, last = np.sort(rng.uniform(-1.2, 1.2, 2)) * np.sqrt(shape[0, 0])
        low, high = section(first, last, shape[0, 0], shape[0, 1], shape[1, 1])
        chosen = y[(x >= first) & (x <= last)]
        if len(chosen) < 50:
            continue
        assert low <= chosen.min() + 1e-9
        assert high >= chosen.max() - 1e-9
        assert low == pytest.approx(chosen.min(), abs=2e-2 * np.sqrt(shape[1, 1]))
        assert high == pytest.approx(chosen.max(), abs=2e-2 * np.sqrt(shape[1, 1]))
    assert section(3.0, 4.0, 4.0, 0.0, 1.0) == (1.0, -1.0)
    assert section(-1.0, 1.0, 0.0, 0.0, 4.0) == (-2.0, 2.0)


@pytest.mark.parametrize("count", [1, 7, 128])
def test_no_pose_that_fits_is_outside_the_cells(count: int) -> None:
    """Of random directions and lengths, all that are possible are in their cell, for any sign and bound."""
    rng = np.random.default_rng(count)
    for case in range(60):
        start = rng.uniform(-7, 7)
        angles, lengths = (start, start + rng.choice([1e-3, 0.3, 4.0])), (30.0, 80.0)
        theta, r = rng.uniform(*angles, 4000), rng.uniform(*lengths, 4000)
        truth = rng.integers(4000)
        bound = rng.choice([0.0, 0.5, 3.0, 30.0])
        seen = float(r[truth] * np.cos(theta[truth]))
        place, shape, ellipse = np.array([start, 55.0]), random_shape(rng, 2), NOTHING
        fits = abs(r * np.cos(theta) - seen) <= bound
        if case % 2:
            ellipse = (shape[0, 0], shape[0, 1], shape[1, 1])
            fits &= values(np.stack([theta, r], axis=1), place, shape) <= 1
        edges, low, high = link_cells(angles, lengths, seen, bound, (place[0], place[1]), ellipse, count)
        cell = np.clip(np.searchsorted(edges, theta, side="right") - 1, 0, count - 1)
        assert np.all(low[cell][fits] <= r[fits])
        assert np.all(r[fits] <= high[cell][fits])


def test_what_nothing_shows_has_no_cell() -> None:
    """A length beyond the longest link is shown by no direction, one above 0 by none that points away."""
    for angles, seen in (((-1.0, 1.0), 90.0), ((2.0, 3.0), 10.0), ((-1.0, 1.0), -1.0)):
        _, low, high = link_cells(angles, (50.0, 80.0), seen, 0.5, (0.0, 0.0), NOTHING, 64)
        assert np.all(low > high)
    _, low, high = link_cells((0.0, 1.0), (50.0, 80.0), 60.0, 3.0, (5.0, 60.0), (1.0, 0.0, 1.0), 8)
    assert np.all(low > high)


def test_cells_are_as_tight_as_they_are_many() -> None:
    """With ever more of them the least length that shows 60 px anywhere comes to 60 px, less the bound."""
    least = []
    for count in (4, 32, 256):
        _, low, high = link_cells((-0.5, 0.5), (40.0, 80.0), 60.0, 1.0, (0.0, 0.0), NOTHING, count)
        least.append(low[low <= high].min())
    assert least == pytest.approx([59, 59, 59], abs=1e-6)
    _, low, high = link_cells((0.4, 0.5), (40.0, 80.0), 60.0, 1.0, (0.0, 0.0), NOTHING, 256)
    assert low[0] == pytest.approx(59 / np.cos(0.4), abs=0.05)
    assert high[-1] == pytest.approx(61 / np.cos(0.5), abs=0.05)
