"""Smoothing disturbances: the moments of the noises are those of the joint distribution of all frames."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.model import LinearChain
from pftrack.core.numerics.compiled import FUNCTIONS
from pftrack.core.numerics.random import log_density
from pftrack.filters import disturbances
from pftrack.filters.disturbances import smooth_disturbances


def chain(frames: int = 7, *, missing: tuple[int, ...] = (2, 3), spread: float = 0.0) -> LinearChain:
    """A model of two measured values and a state of four, another one in each frame, that begins without any doubt."""
    rng = np.random.default_rng(8)
    measurements = rng.normal(size=(frames, 2))
    measurements[list(missing)] = np.nan
    roots = rng.normal(size=(frames, 2, 2))
    return LinearChain(
        rng.normal(size=4),
        spread * np.eye(4),
        rng.normal(size=(frames, 4, 4)) / 2,
        rng.normal(size=(frames, 4)),
        rng.normal(size=(frames, 4, 3)),
        measurements,
        rng.normal(size=(frames, 2, 4)),
        roots @ np.swapaxes(roots, 1, 2) + 0.5 * np.eye(2),
    )


def joint(it: LinearChain) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return mean and covariance of all measurements, and their slopes by the start and by all noises of the motion."""
    frames, size, kicks = it.noises.shape
    mean, rows, means = it.mean, np.hstack([np.eye(size), np.zeros((size, frames * kicks))]), []
    slopes = []
    for t in range(frames):
        mean, rows = it.transitions[t] @ mean + it.offsets[t], it.transitions[t] @ rows
        rows[:, size + t * kicks : size + (t + 1) * kicks] += it.noises[t]
        means.append(it.observations[t] @ mean)
        slopes.append(it.observations[t] @ rows)
    prior = np.eye(size + frames * kicks)
    prior[:size, :size] = it.covariance
    slope = np.vstack(slopes)
    covariance = slope @ prior @ slope.T
    for t in range(frames):
        covariance[2 * t : 2 * t + 2, 2 * t : 2 * t + 2] += it.covariances[t]
    return np.concatenate(means), covariance, slope @ prior


@pytest.mark.parametrize("spread", [0.0, 0.7])
def test_noises_are_those_of_the_joint_distribution(spread: float) -> None:
    """Conditioned on all that was measured at once, by one large matrix; frames without a measurement add nothing."""
    it = chain(spread=spread)
    seen = np.isfinite(it.measurements).ravel()
    mean, covariance, cross = joint(it)
    off, covariance, cross = it.measurements.ravel()[seen] - mean[seen], covariance[np.ix_(seen, seen)], cross[seen]
    kicks = cross[:, 4:]
    expected = kicks.T @ np.linalg.solve(covariance, off)
    left = np.eye(len(expected)) - kicks.T @ np.linalg.solve(covariance, kicks)
    noise = np.zeros((14, 14))
    for t in range(7):
        noise[2 * t : 2 * t + 2, 2 * t : 2 * t + 2] = it.covariances[t]
    noise = noise[np.ix_(seen, seen)]
    errors = noise @ np.linalg.solve(covariance, off)
    doubt = noise - noise @ np.linalg.solve(covariance, noise)

    found = smooth_disturbances(it)
    assert found.log_evidence.sum() == pytest.approx(float(log_density(off, np.zeros(len(off)), covariance)))
    assert found.log_evidence[[2, 3]].tolist() == [0.0, 0.0]
    assert (found.process_count, found.observation_count) == (21, 10)
    assert found.process == pytest.approx((expected @ expected + np.trace(left)) / 21)
    assert found.observation == pytest.approx(np.trace(np.linalg.solve(noise, np.outer(errors, errors) + doubt)) / 10)


def test_factors_scale_the_noises() -> None:
    """A chain whose matrices were multiplied beforehand comes to the same."""
    it = chain()
    scaled = it._replace(noises=2.0 * it.noises, covariances=0.25 * it.covariances)
    first, second = smooth_disturbances(it, 4.0, 0.25), smooth_disturbances(scaled)
    assert first.log_evidence.tolist() == second.log_evidence.tolist()
    assert (first.process, first.observation) == (second.process, second.observation)


def test_nothing_is_compiled_again_for_another_order_in_memory() -> None:
    """Read-only arrays and such in Fortran's order come to the same numbers by what is compiled already."""
    it = chain()
    arrays = [np.array(array, order="F") for array in it]
    for array in arrays:
        array.flags.writeable = False
    first = smooth_disturbances(it)
    known = [len(function.signatures) for function in compiled_functions()]
    second = smooth_disturbances(LinearChain(*arrays))
    assert [len(function.signatures) for function in compiled_functions()] == known
    assert first.log_evidence.tolist() == second.log_evidence.tolist()
    assert (first.process, first.observation) == (second.process, second.observation)


def compiled_functions() -> list[Any]:
    """What this module compiles."""
    found = [function for function in FUNCTIONS if function.py_func.__module__ == disturbances.__name__]
    assert len(found) == 2
    return found


def test_a_measurement_without_noise_is_refused() -> None:
    """Where neither state nor measurement has any spread there is no density."""
    it = chain()
    with pytest.raises(np.linalg.LinAlgError, match="Singular"):
        smooth_disturbances(it, 0.0, 0.0)
