"""Kalman filter and smoothed disturbances are those of the joint distribution, and noises are fitted by them."""

import itertools

import numpy as np
import pytest
from scipy.linalg import block_diag

from pftrack.core.model.model import LinearChain, LinearStep, NoiseScale
from pftrack.core.numerics.random import Gaussian, log_density
from pftrack.filters import kalman
from pftrack.filters.disturbances import Disturbances, smooth_disturbances
from pftrack.filters.dynamics import LinearDynamics, random_walk
from pftrack.filters.learning.online_em import fit_noise


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


def joint(it: LinearChain) -> tuple[np.ndarray, ...]:
    """Return mean and covariance of all measurements, their covariance with the start and all noises of the motion.

    Beside them are the mean of the last state and its slopes by these.
    """
    frames, size, kicks = it.noises.shape
    mean, rows, means = it.mean, np.hstack([np.eye(size), np.zeros((size, frames * kicks))]), []
    slopes = []
    for t in range(frames):
        mean, rows = it.transitions[t] @ mean + it.offsets[t], it.transitions[t] @ rows
        rows[:, size + t * kicks : size + (t + 1) * kicks] += it.noises[t]
        means.append(it.observations[t] @ mean)
        slopes.append(it.observations[t] @ rows)
    prior, slope = block_diag(it.covariance, np.eye(frames * kicks)), np.vstack(slopes)
    spread = slope @ prior @ slope.T + block_diag(*it.covariances)
    return np.concatenate(means), spread, slope @ prior, mean, rows


@pytest.mark.parametrize("spread", [0.0, 0.7])
def test_noises_are_those_of_the_joint_distribution(spread: float) -> None:
    """Conditioned on all that was measured at once, by one large matrix; frames without a measurement add nothing.

    The Kalman filter, step by step, has the evidence and the last state of this as well.
    """
    it = chain(spread=spread)
    seen = np.isfinite(it.measurements).ravel()
    mean, covariance, cross, last, rows = joint(it)
    off, covariance, cross = it.measurements.ravel()[seen] - mean[seen], covariance[np.ix_(seen, seen)], cross[seen]
    kicks = cross[:, 4:]
    expected = kicks.T @ np.linalg.solve(covariance, off)
    left = np.eye(len(expected)) - kicks.T @ np.linalg.solve(covariance, kicks)
    noise = block_diag(*it.covariances)[np.ix_(seen, seen)]
    errors = noise @ np.linalg.solve(covariance, off)
    doubt = noise - noise @ np.linalg.solve(covariance, noise)

    found = smooth_disturbances(it)
    assert found.log_evidence.sum() == pytest.approx(float(log_density(off, np.zeros(len(off)), covariance)))
    assert found.log_evidence[[2, 3]].tolist() == [0.0, 0.0]
    belief, evidence = Gaussian(it.mean, it.covariance), []
    for measured, observation, noises, *model in zip(
        it.measurements, it.observations, it.covariances, it.transitions, it.offsets, it.noises, strict=True
    ):
        belief, log_evidence = kalman.predict(belief, LinearDynamics(*model)), 0.0
        if np.isfinite(measured).all():
            belief, log_evidence = kalman.update(belief, measured, observation, noises)
        evidence.append(log_evidence)
    assert evidence == pytest.approx(found.log_evidence)
    assert belief.mean == pytest.approx(last + rows @ cross.T @ np.linalg.solve(covariance, off))
    prior = block_diag(it.covariance, np.eye(21))
    spread_left = rows @ (prior - cross.T @ np.linalg.solve(covariance, cross)) @ rows.T
    assert belief.covariance == pytest.approx(spread_left)
    assert (found.process_count, found.observation_count) == (21, 10)
    assert found.process == pytest.approx((expected @ expected + np.trace(left)) / 21)
    assert found.observation == pytest.approx(np.trace(np.linalg.solve(noise, np.outer(errors, errors) + doubt)) / 10)


def test_factors_scale_the_noises() -> None:
    """A chain with matrices multiplied beforehand gives the same; a spread of zero has no density."""
    it = chain()
    scaled = it._replace(noises=2.0 * it.noises, covariances=0.25 * it.covariances)
    assert same(smooth_disturbances(it, 4.0, 0.25), smooth_disturbances(scaled))
    with pytest.raises(np.linalg.LinAlgError, match="Singular"):
        smooth_disturbances(it, 0.0, 0.0)


def same(*found: Disturbances) -> bool:
    one, other = ((each.log_evidence.tolist(), each.process, each.observation) for each in found)
    return one == other


# Expectation maximisation of noises: it never goes down, and ends where no other values are more probable.

WIDE = {"process": (1e-6, 1e6), "observation": (1e-6, 1e6)}


def walk(seed: int = 1, frames: int = 200, process_sd: float = 0.5, observation_sd: float = 1.0) -> LinearChain:
    """Return a random walk seen through noise, with the model of noises of 1 and 1."""
    rng = np.random.default_rng(seed)
    places = np.cumsum(process_sd * rng.normal(size=frames))
    measurements = places + observation_sd * rng.normal(size=frames)
    measurements[frames // 3 : frames // 3 + 5] = np.nan
    it = random_walk(1, 1.0)
    steps = [LinearStep(it, one, np.eye(1), np.eye(1)) for one in measurements[:, None]]
    return LinearChain.of(np.zeros(1), np.zeros((1, 1)), steps)


def evidence(chains: list[LinearChain], process: float, observation: float) -> float:
    return float(sum(smooth_disturbances(it, process, observation).log_evidence.sum() for it in chains))


@pytest.mark.parametrize("begin", [(1e-4, 1e3), (1e4, 1e-3)])
def test_it_never_goes_down(begin: tuple[float, float]) -> None:
    """From wherever it begins the evidence rises with each place that is kept, to the same end."""
    chains = [walk(seed) for seed in (1, 2)]
    found = fit_noise(chains, WIDE, begin=dict(zip(WIDE, begin, strict=True)))
    assert found.converged
    assert all(after >= before - 1e-9 for before, after in itertools.pairwise(found.log_evidence))
    assert found.log_evidence[0] == pytest.approx(evidence(chains, *begin))
    assert found.log_evidence[-1] == pytest.approx(evidence(chains, *found.factors.values()))
    assert list(found.factors.values()) == pytest.approx(list(fit_noise(chains, WIDE).factors.values()), rel=1e-3)


def test_one_noise_alone_is_fitted_within_its_bounds() -> None:
    """The other stays as it is; where the best lies beyond, the bound itself comes out."""
    assert fit_noise([walk()], {"process": (1e-6, 1e6)}).factors["process"] < 0.5
    assert fit_noise([walk()], {"process": (0.5, 2.0)}).factors == {"process": pytest.approx(0.5)}
    assert fit_noise([walk()], {"process": (0.5, 2.0)}, most_steps=1).converged is False


@pytest.mark.parametrize(("chains", "bounds"), [((), WIDE), ((walk(),), {}), ((walk(),), {"process": (0.0, 1.0)})])
def test_nothing_to_fit_is_refused(chains: tuple[LinearChain, ...], bounds: dict[str, tuple[float, float]]) -> None:
    """Without a chain, without a noise, and with a bound of zero."""
    with pytest.raises(ValueError, match="are needed"):
        fit_noise(chains, bounds)  # type: ignore[arg-type]


def test_a_number_follows_its_covariance() -> None:
    """A standard deviation by the root, a variance as it is."""
    assert NoiseScale("process").factor(0.5, 1.0) == 4.0
    assert NoiseScale("process").scale(0.5, 4.0) == 1.0
    assert NoiseScale("process", is_variance=True).scale(0.5, 4.0) == 2.0
