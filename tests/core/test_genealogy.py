"""Genealogies: lines that lead back, meet, and never cross."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pftrack.core.model.likelihood import count_descendants, trace

FAMILY = [np.array([0, 1, 2, 3]), np.array([0, 0, 2, 2]), np.array([1, 1, 1, 2])]
"""Four particles over three frames: the last three generations of frames 5 to 8."""


def test_particles_are_traced_to_their_ancestors() -> None:
    """Lines lead over parents of parents and are counted; each ancestor is in the middle of its descendants."""
    found = trace(8, FAMILY, 4)
    assert list(found.frames) == [5, 6, 7, 8]
    assert found.places.tolist() == [[0, 0, 0, 2], [0, 0, 0, 2], [1, 1, 1, 2], [0, 1, 2, 3]]
    assert found.counts.tolist() == [2, 2, 2, 4]
    assert found.coalesced is None
    assert found.heights[[0, -1]].tolist() == [[0.375, 0.375, 0.375, 0.875], [0.125, 0.375, 0.625, 0.875]]
    assert found.lines(2).tolist()[-1] == [0.125, 0.625]


def test_lines_coalesce_in_the_newest_frame_that_has_one_ancestor() -> None:
    """One particle of frame 6 is the ancestor of all of frame 8, and so is one of frame 5, which is older."""
    found = trace(8, [np.array([1, 1]), np.array([0, 0]), np.array([0, 0])], 2)
    assert (found.coalesced, trace(8, [], 1).coalesced) == (7, None)


def test_a_particle_without_a_parent_begins_a_line() -> None:
    """Its ancestors are none, it has no height before, and no one particle is the ancestor of all."""
    found = trace(8, [np.array([0, 0, 0]), np.array([1, -1, 1])], 3)
    assert found.places.tolist() == [[0, -1, 0], [1, -1, 1], [0, 1, 2]]
    assert found.counts.tolist() == [1, 1, 3]
    assert found.coalesced is None
    assert np.isnan(found.heights[:2, 1]).all()
    assert np.isfinite(found.heights[:, [0, 2]]).all()


def test_nobody_is_followed_to_before_all_lines_begin() -> None:
    """Where no present particle has an ancestor any more the genealogy ends; only those asked for are traced."""
    parents = [np.array([0, 1, 2, 3]), np.array([-1, -1, 2, 3]), np.array([0, 0, 2, 3])]
    assert list(trace(8, parents, 4).frames) == [5, 6, 7, 8]
    alone = trace(8, parents, 4, slice(0, 2))
    assert list(alone.frames) == [7, 8]
    assert alone.places.tolist() == [[0, 0], [0, 1]]
    assert alone.coalesced == 7


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 9), st.integers(1, 30))
def test_lines_never_cross(seed: int, frames: int, count: int) -> None:
    """A line that is higher than another in one frame is nowhere lower, and lines that have met stay together."""
    rng = np.random.default_rng(seed)
    found = trace(frames, [rng.integers(0, count, count) for _ in range(frames)], count)
    above = found.heights[:, :, None] - found.heights[:, None, :]
    assert not (((above > 1e-12).any(axis=0)) & ((above < -1e-12).any(axis=0))).any()
    same = np.abs(above) < 1e-12
    assert (same[:-1] | ~same[1:]).all()
    assert (np.diff(found.counts) >= 0).all()


def test_descendants_are_counted_in_each_frame() -> None:
    """Children, children's children and so on, none once a line has ended; parents of another number are refused."""
    assert [count_descendants(particle, FAMILY) for particle in (0, 3)] == [[1, 2, 3], [1, 0, 0]]
    with pytest.raises(ValueError, match="parents of 3 particles, got 4"):
        trace(8, FAMILY, 3)
