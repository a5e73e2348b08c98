"""Lesson 10: combs, darts and what they leave of a cloud's past."""

import numpy as np
import pytest

from pftrack.teaching.lessons.course.resampling import (
    WEIGHTS,
    ResamplingParameters,
    Scheme,
    copies,
    effective_sizes,
    exact_variance,
    marks,
    sample_copies,
    show,
)

SCHEMES: tuple[Scheme, ...] = "systematic", "stratified", "multinomial"


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("count", [2, 7, 20, 60])
def test_marks_pick_the_copies_that_are_shown(scheme: Scheme, count: int) -> None:
    """Counting the teeth or darts on each particle's piece comes to what the resampler draws."""
    for offset, seed in ((0.0, 1), (0.37, 2), (0.99, 3)):
        places = marks(scheme, count, offset, seed)
        hit = np.searchsorted(count * np.cumsum(WEIGHTS), places, side="right")
        assert np.bincount(hit, minlength=len(WEIGHTS)).tolist() == copies(scheme, count, offset, seed).tolist()


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("count", [3, 20, 100])
def test_the_exact_variance_is_that_of_many_redraws(scheme: Scheme, count: int) -> None:
    """Within five standard errors of 4,000 redraws."""
    squared = np.square(sample_copies(scheme, count, 4000, 5) - count * WEIGHTS).sum(axis=1)
    assert squared.mean() == pytest.approx(exact_variance(scheme, count), abs=5 * squared.std() / 4000**0.5 + 1e-9)


def test_all_descend_from_few() -> None:
    """The tree's strong lines end in the ancestors that the number counts, and each step has all its particles."""
    shown = show(ResamplingParameters(particles=60), 2)
    tree = next(panel for panel in shown.figure.panels if panel.id == "tree").traces[0]
    assert np.isnan(tree.parents[0]).all()
    assert (tree.weights[-1] == 1.0).all()
    assert (tree.weights[0] == 1.0).sum() == shown.numbers[1].value < 20
    for step in range(1, len(tree.parents)):
        strong = tree.parents[step, tree.weights[step] == 1.0].astype(int)
        assert set(strong) == set(np.flatnonzero(tree.weights[step - 1] == 1.0))


def test_weights_degenerate_without_redrawing() -> None:
    """The effective size falls for good if particles are never redrawn."""
    kept, again = effective_sizes("systematic", 1)
    assert kept[-1] < 0.05 * kept[0]
    assert again[-1] > 0.5 * again[0]
