"""Beams: the best that differ are kept, and links to parents lead back through the frames."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.filters.beam import Beam, backtrack, select_best


def near(first: float, second: float) -> bool:
    """Numbers that differ by less than 1 are one."""
    return abs(first - second) < 1.0


def test_the_best_that_differ_are_kept() -> None:
    """The best comes first, what is near a better one is dropped, each has its own parent; equals keep their order."""
    beam = select_best((0.0, 5.0, 5.5, 9.0), np.log([0.1, 0.2, 0.4, 0.3]), np.array([0, 1, 2, -1]), 2, near)
    assert (beam.members, beam.parents.tolist()) == ((5.5, 9.0), [2, -1])
    assert np.allclose(beam.weights, [4 / 7, 3 / 7])
    assert (len(beam), beam.best) == (2, 0)
    assert select_best((3.0, 1.0, 2.0), np.zeros(3), np.arange(3), 2, near).members == (3.0, 1.0)


def test_the_impossible_is_kept_only_where_nothing_is_possible() -> None:
    """NaN and +inf count as impossible; where all is, members are equally probable instead of none."""
    scores = np.array([np.nan, np.inf, 2.0])
    assert select_best((1.0, 5.0, 9.0), scores, np.arange(3), 3, near).members == (9.0,)
    hopeless = select_best((1.0, 5.0, 9.0), np.full(3, np.nan), np.arange(3), 2, near)
    assert hopeless.members == (1.0, 5.0)
    assert np.allclose(hopeless.weights, 0.5)


@given(st.lists(st.tuples(st.floats(-20, 20), st.floats(-50, 50)), min_size=1, max_size=30), st.integers(1, 6))
def test_what_is_kept_differs_and_is_as_probable_as_it_was(found: list[tuple[float, float]], width: int) -> None:
    """No two that are kept are the same, ratios of weights stay, and what is dropped is worse or near a better one."""
    members, scores = [one for one, _ in found], np.array([score for _, score in found])
    beam = select_best(members, scores, np.arange(len(found)), width, near)
    assert 1 <= len(beam) <= width
    assert beam.weights.sum() == pytest.approx(1.0)
    assert not any(near(one, other) for place, one in enumerate(beam.members) for other in beam.members[:place])
    own = scores[beam.parents]
    assert np.allclose(beam.log_weights - beam.log_weights[0], own - own[0])
    for member, score in found:
        better = [one for one, its in zip(beam.members, own, strict=True) if its >= score]
        assert len(better) == width or any(near(one, member) for one in better)


def test_backtracking_follows_the_parents() -> None:
    """The path ends at the member asked for, and every step of it goes to the parent."""
    parents = [np.array([-1, -1]), np.array([1, 0, 1]), np.array([2, 0])]
    assert [backtrack(parents, end).tolist() for end in (0, 1)] == [[1, 2, 0], [1, 0, 1]]
    assert backtrack([], 0).tolist() == []


def test_a_beam_of_nothing_is_refused() -> None:
    """A beam has a member at least, and so has what it is made of."""
    with pytest.raises(ValueError, match="at least one"):
        Beam((), np.zeros(0), np.full(0, -1))
    for members, width in ((0, 4), (1, 0)):
        with pytest.raises(ValueError, match=f"got {members} and {width}"):
            select_best((1.0,) * members, np.zeros(members), np.full(members, -1), width, near)
