import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.filters.particles import ParticleSet, normalise
from pftrack.filters.resampling import RESAMPLERS, Resampler, decide, residual, systematic, systematic_parents

ALL = pytest.mark.parametrize("resample", RESAMPLERS.values(), ids=RESAMPLERS)


@ALL
def test_expected_copies(resample: Resampler) -> None:
    """Each parent is drawn count * weight times on average, within four standard errors."""
    weights = np.array([0.05, 0.5, 0.0, 0.25, 0.2])
    with np.errstate(divide="ignore"):
        log_weights = np.log(weights)
    repeats, count = 1000, 12
    copies = np.zeros(5)
    for seed in range(repeats):
        copies += np.bincount(resample(np.random.default_rng(seed), log_weights, count), minlength=5)
    error = 4 * np.sqrt(count * weights * (1 - weights) / repeats)
    assert (np.abs(copies / repeats - count * weights) <= error + 1e-12).all()


@ALL
@given(st.data())
def test_ancestors_are_valid(resample: Resampler, data: st.DataObject) -> None:
    """Ancestors are ascending, exist, and none has a weight of zero, whatever the constant of the logarithms."""
    size = data.draw(st.integers(1, 40))
    zero = st.just(-np.inf)
    log_weights = np.array(data.draw(st.lists(zero | st.floats(-700, 700), min_size=size, max_size=size)))
    log_weights[data.draw(st.integers(0, size - 1))] = 0.5
    count = data.draw(st.integers(1, 60))
    ancestors = resample(np.random.default_rng(data.draw(st.integers(0, 1000))), log_weights, count)
    assert ancestors.shape == (count,)
    assert (np.diff(ancestors) >= 0).all()
    assert ((ancestors >= 0) & (ancestors < size)).all()
    assert np.isfinite(log_weights[ancestors]).all()


@given(st.integers(0, 10_000), st.integers(1, 100))
def test_systematic_copies_are_floor_or_ceil(seed: int, count: int) -> None:
    """Systematic resampling draws each parent floor or ceil of its expectation."""
    rng = np.random.default_rng(seed)
    log_weights, _ = normalise(rng.normal(size=30))
    copies = np.bincount(systematic(rng, log_weights, count), minlength=30)
    expected = count * np.exp(log_weights)
    assert (copies >= np.floor(expected - 1e-9)).all()
    assert (copies <= np.ceil(expected + 1e-9)).all()


def test_residual_keeps_whole_parts() -> None:
    """Residual resampling leaves only fractions to chance."""
    weights = np.array([0.6, 0.3, 0.1])
    for seed in range(50):
        copies = np.bincount(residual(np.random.default_rng(seed), np.log(weights), 5), minlength=3)
        assert (copies >= [3, 1, 0]).all()


def test_it_waits_until_the_effective_sample_size_falls() -> None:
    """Resampling happens below the threshold, at threshold one always, and whenever the number changes."""
    rng = np.random.default_rng(0)
    even = ParticleSet.uniform(np.zeros((10, 1)))
    uneven = ParticleSet(np.zeros((10, 1)), normalise(np.array([5.0] + [0.0] * 9))[0], np.arange(10))
    assert decide(systematic, 0.5, rng, even, 10) is None
    assert decide(systematic, 0.5, rng, uneven, 10) is not None
    assert decide(systematic, 1.0, rng, even, 10) is not None
    assert decide(systematic, 0.5, rng, even, 20) is not None


@pytest.mark.parametrize("count", [1, 7, 1000])
@pytest.mark.parametrize("offset", [0.0, 0.5, np.nextafter(1.0, 0.0)])
def test_offsets_at_both_ends_draw_by_weight(count: int, offset: float) -> None:
    """At either end of its range the one offset draws each parent floor or ceil of its share."""
    weights = np.array([0.0, 0.3, 0.0, 0.5, 0.2, 0.0])
    copies = np.bincount(systematic_parents(weights, offset, count), minlength=6)
    assert copies.sum() == count
    assert (copies >= np.floor(count * weights - 1e-9)).all()
    assert (copies <= np.ceil(count * weights + 1e-9)).all()
