"""Chunks: every run is in one chunk, in order, and they are computed evenly over the grid."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.sweep import Plan
from pftrack.sweep.axis import Axis
from pftrack.sweep.table import Chunks


def plan_of(widths: int, radii: int, trackers: int, trials: int) -> Plan:
    axes = (
        Axis("occlusion_width_px", tuple(float(width) for width in range(widths))),
        Axis("distracter_radius_px", tuple(float(radius) for radius in range(radii))),
    )
    return Plan("ball", axes, ("h-spf", "s-spf", "apf")[:trackers], trials=trials)


@given(st.integers(1, 7), st.integers(1, 7), st.integers(1, 3), st.integers(1, 9), st.floats(0.1, 500))
def test_chunks_cover_the_plan_once_and_in_order(
    widths: int, radii: int, trackers: int, trials: int, wanted: float
) -> None:
    """Chunks are contiguous ranges of runs, one after the other, of whole trials, and none is much too large."""
    plan = plan_of(widths, radii, trackers, trials)
    chunks = Chunks.of(plan, wanted)
    expected = 0
    for number, chunk in enumerate(chunks):
        assert (chunk.number, chunk.first) == (number, expected)
        assert chunk.runs == sum((piece.stop - piece.start) * trackers for piece in chunk.pieces)
        assert chunk.runs <= max(wanted, trackers)
        piece = chunk.pieces[0]
        assert chunk.first == (piece.condition * trials + piece.start) * trackers
        expected += chunk.runs
    assert expected == plan.runs
    assert sorted(chunks.spread()) == list(range(len(chunks)))


@pytest.mark.parametrize("part", [0.1, 0.25, 0.5])
def test_a_map_fills_evenly(part: float) -> None:
    """At any time every row, column and quarter of the map has about its share of the cells."""
    plan = plan_of(20, 20, 1, 1)
    chunks = Chunks.of(plan, 1)
    done = np.zeros((20, 20))
    done.ravel()[chunks.spread()[: int(400 * part)]] = 1
    for axis in (0, 1):
        assert np.abs(done.mean(axis=axis) - part).max() <= 0.11
    quarters = done.reshape(2, 10, 2, 10).mean(axis=(1, 3))
    assert np.abs(quarters - part).max() <= 0.05


def test_there_is_no_chunk_beyond_the_last() -> None:
    """Numbers out of range are refused."""
    chunks = Chunks.of(plan_of(2, 2, 1, 1), 1)
    with pytest.raises(IndexError, match="there are 4 chunks, got 4"):
        chunks[4]
