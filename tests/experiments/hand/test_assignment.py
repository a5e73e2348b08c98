"""Which finger is which protrusion."""

from itertools import product

import numpy as np
import pytest

from pftrack.experiments.hand.candidates import HIDDEN, MOST_PROTRUSIONS, assign


def by_trying_all(scores: np.ndarray, costs: np.ndarray) -> float:
    """Return the best sum over all ways of giving each finger a protrusion or none."""
    best = -np.inf
    for way in product(range(-1, len(costs)), repeat=len(scores)):
        taken = [p for p in way if p >= 0]
        if len(taken) == len(set(taken)):
            left = sum(costs[p] for p in range(len(costs)) if p not in taken)
            best = max(best, sum(scores[finger, p] for finger, p in enumerate(way)) - left)
    return best


@pytest.mark.parametrize("protrusions", range(5))
def test_it_is_the_best_of_all_ways(protrusions: int) -> None:
    """The table over sets finds what trying all ways finds, and the assignment has the score that is said."""
    draw = np.random.default_rng(protrusions)
    for _ in range(6):
        scores = draw.normal(-5.0, 5.0, (5, protrusions + 1))
        scores[draw.random(scores.shape) < 0.2] = -np.inf
        scores[:, -1] = draw.normal(-5.0, 5.0, 5)
        costs = draw.uniform(0.0, 30.0, protrusions)
        score, chosen = assign(scores, costs)
        assert score == pytest.approx(by_trying_all(scores, costs))
        taken = chosen[chosen != HIDDEN]
        assert len(set(taken)) == len(taken)
        said = sum(scores[finger, p] for finger, p in enumerate(chosen)) - np.delete(costs, taken).sum()
        assert said == pytest.approx(score)


def test_many_protrusions_leave_some_of_no_finger() -> None:
    """With as many as there may be, every finger has its own and the others are paid for."""
    scores = np.full((5, MOST_PROTRUSIONS + 1), -9.0)
    scores[np.arange(5), np.arange(5) + 2] = -1.0
    score, chosen = assign(scores, np.ones(MOST_PROTRUSIONS))
    assert chosen.tolist() == [2, 3, 4, 5, 6]
    assert score == -5.0 - (MOST_PROTRUSIONS - 5)
