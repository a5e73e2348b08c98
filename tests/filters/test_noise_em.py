"""Expectation maximisation of noises: it never goes down, and ends where no other values are more probable."""

import itertools

import numpy as np
import pytest

from pftrack.analysis.search import maximise
from pftrack.core.model.model import LinearChain, LinearStep, NoiseScale
from pftrack.filters.disturbances import smooth_disturbances
from pftrack.filters.dynamics import autoregression, random_walk
from pftrack.filters.learning.online_em import fit_noise

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


def curve(process_sd: float) -> LinearChain:
    """Return a curve whose velocity wanders: a state that holds its own past, so that its covariance is singular."""
    rng = np.random.default_rng(2)
    one = np.eye(1)
    it = autoregression(2 * one, -one, np.zeros(1), process_sd * one)
    state, seen = np.zeros(2), []
    for _ in range(150):
        state = it.transition @ state + it.noise @ rng.normal(size=1)
        seen.append(state[0] + 0.1 * rng.normal())
    steps = [LinearStep(it, np.array([one]), np.eye(1, 2), 0.01 * np.eye(1)) for one in seen]
    return LinearChain.of(np.zeros(2), np.zeros((2, 2)), steps)


def evidence(chains: list[LinearChain], process: float, observation: float) -> float:
    return float(sum(smooth_disturbances(it, process, observation).log_evidence.sum() for it in chains))


@pytest.mark.parametrize("begin", [(1.0, 1.0), (1e-4, 1e3), (1e4, 1e-3)])
def test_it_never_goes_down(begin: tuple[float, float]) -> None:
    """From wherever it begins the evidence rises with each place that is kept, to the same end."""
    chains = [walk(seed) for seed in (1, 2)]
    found = fit_noise(chains, WIDE, begin=dict(zip(WIDE, begin, strict=True)))
    assert found.converged
    assert all(after >= before - 1e-9 for before, after in itertools.pairwise(found.log_evidence))
    assert found.log_evidence[0] == pytest.approx(evidence(chains, *begin))
    assert found.log_evidence[-1] == pytest.approx(evidence(chains, *found.factors.values()))
    assert list(found.factors.values()) == pytest.approx(list(fit_noise(chains, WIDE).factors.values()), rel=1e-3)


@pytest.mark.parametrize("chains", [[walk()], [walk(3), walk(4, frames=90)], [curve(0.002)], [curve(0.3)]])
def test_it_ends_at_the_largest_evidence(chains: list[LinearChain]) -> None:
    """Nothing that a search finds is more probable, and where it ends is the same place."""
    found = fit_noise(chains, WIDE)
    searched, value = maximise(lambda place: evidence(chains, *place), (1.0, 1.0), list(WIDE.values()), evaluations=300)
    assert found.log_evidence[-1] >= value - 1e-6
    assert list(found.factors.values()) == pytest.approx(searched, rel=0.05)
    again = fit_noise(chains, WIDE)
    assert again == found


def test_noises_that_were_there_are_found() -> None:
    """Of a long recording, within what it can tell."""
    found = fit_noise([walk(frames=3000)], WIDE)
    assert found.factors["process"] == pytest.approx(0.25, rel=0.1)
    assert found.factors["observation"] == pytest.approx(1.0, rel=0.1)


def test_one_noise_alone_is_fitted_within_its_bounds() -> None:
    """The other stays as it is; where the best lies beyond, the bound itself comes out."""
    free = fit_noise([walk()], {"process": (1e-6, 1e6)})
    assert set(free.factors) == {"process"}
    assert free.factors["process"] < 0.5
    bounded = fit_noise([walk()], {"process": (0.5, 2.0)})
    assert bounded.factors["process"] == pytest.approx(0.5)
    assert fit_noise([walk()], {"process": (0.5, 2.0)}, most_steps=1).converged is False


@pytest.mark.parametrize(("chains", "bounds"), [((), WIDE), ((walk(),), {}), ((walk(),), {"process": (0.0, 1.0)})])
def test_nothing_to_fit_is_refused(chains: tuple[LinearChain, ...], bounds: dict[str, tuple[float, float]]) -> None:
    """No chain, no noise, and a bound that is no scale."""
    with pytest.raises(ValueError, match="are needed"):
        fit_noise(chains, bounds)  # type: ignore[arg-type]


def test_a_number_follows_its_covariance() -> None:
    """A standard deviation by the root, a variance as it is."""
    assert NoiseScale("process").factor(0.5, 1.0) == 4.0
    assert NoiseScale("process").scale(0.5, 4.0) == 1.0
    assert NoiseScale("process", is_variance=True).scale(0.5, 4.0) == 2.0
