"""Signals, and their trackers against the posterior of the whole path, computed without recursion."""

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import multivariate_normal

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, History, Target
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.shared.reports import PointState
from pftrack.experiments.sine.experiment import TRACKERS, SignalSource, SignalTrackerParameters, SineParameters

START = 0.7
SPREAD, STEP, NOISE = 0.3, 0.05, 0.2
VALUES = {"process_noise_sd": STEP, "assumed_noise_sd": NOISE, "initial_sd": SPREAD}
PARAMETERS = revise(SignalTrackerParameters(), VALUES)


def frames(values: Sequence[Sequence[float]]) -> list[Frame]:
    return [Frame(index, index / 60, signal=np.array(value)) for index, value in enumerate(values, 1)]


def followed(
    tracker: str, seen: list[Frame], parameters: SignalTrackerParameters, seed: int = 0, start: float = START
) -> list[PointState]:
    chosen, target = TRACKERS[tracker], Target(np.full(len(seen[0].signal), start))  # type: ignore[arg-type]
    states = [chosen.start(target, Frame(0, 0.0), parameters, Stream(seed, 0, Purpose.START))]
    for frame in seen:
        states.append(chosen.step(states[-1], frame, parameters, Stream(seed, frame.index, Purpose.TRACK)))
    return states  # type: ignore[return-value] # of points, all of them


def path_moments(length: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the prior mean and covariance of the path (x_1, ..., x_L).

    X_0 = (x_0, x_-1) has independent coordinates; x_t = 2 x_{t-1} - x_{t-2} + b u_t is written out for all t as a
    linear map of X_0 and u_1, ..., u_L.
    """
    rows = np.eye(length + 2)[[1, 0, *range(2, length + 2)]] * np.repeat([1.0, STEP], [2, length])
    for t in range(2, length + 2):
        rows[t] += 2 * rows[t - 1] - rows[t - 2]
    scales = np.repeat([SPREAD**2, 1.0], [2, length])
    return rows[2:, :2].sum(axis=1) * START, (rows[2:] * scales) @ rows[2:].T


@pytest.fixture(scope="module")
def seen() -> list[Frame]:
    values = START + 0.3 * np.sin(np.arange(1, 13) / 4) + NOISE * np.random.default_rng(2).standard_normal(12)
    return frames(values[:, None].tolist())


def test_the_kalman_filter_is_the_conditional_of_the_whole_path(seen: list[Frame]) -> None:
    """Mean and deviation in each frame are those of the path given the observations, from their joint Gaussian.

    The product of the frames' evidences is the density of the observations as one Gaussian vector.
    """
    values, evidence = np.array([frame.signal for frame in seen])[:, 0], 0.0
    for length, state in enumerate(followed("kalman", seen, PARAMETERS)[1:], 1):
        mean, covariance = path_moments(length)
        observed = covariance + NOISE**2 * np.eye(length)
        gain = covariance[-1] @ np.linalg.inv(observed)
        assert state.estimate[0] == pytest.approx(mean[-1] + gain @ (values[:length] - mean), abs=1e-10)
        assert state.sigma[0] == pytest.approx(np.sqrt(covariance[-1, -1] - gain @ covariance[-1]), abs=1e-10)
        evidence += state.log_evidence
        assert evidence == pytest.approx(multivariate_normal(mean, observed).logpdf(values[:length]), abs=1e-9)


@pytest.mark.parametrize(("scales", "threshold", "off"), [([1.0], 1.0, 0.05), ([1.0, 1.1, 0.8], 0.3, 0.1)])
def test_the_particle_filter_approaches_the_exact_answer(
    seen: list[Frame], scales: list[float], threshold: float, off: float
) -> None:
    """With many particles mean, deviation and evidence are the Kalman filter's, in three dimensions too."""
    shown = frames((np.array([frame.signal for frame in seen]) * scales).tolist())[: 12 // len(scales)]
    many = revise(PARAMETERS, {"sample_count": 100_000, "resampling_threshold": threshold})
    exact, sampled = followed("kalman", shown, PARAMETERS), followed("condensation", shown, many)
    for known, state in zip(exact[1:], sampled[1:], strict=True):
        assert state.estimate == pytest.approx(known.estimate, abs=0.01)
        assert state.sigma == pytest.approx(known.sigma, rel=0.03)
        assert state.log_evidence == pytest.approx(known.log_evidence, abs=off)
    assert all(state.resampled for state in sampled[1:]) == (threshold == 1.0)


def test_the_estimated_evidence_is_not_biased(seen: list[Frame]) -> None:
    """Even with few particles, the mean of the estimated evidence (not of its logarithm) is exact."""
    few, short = revise(PARAMETERS, {"sample_count": 100}), seen[:4]
    exact = sum(state.log_evidence for state in followed("kalman", short, PARAMETERS))
    totals = [sum(s.log_evidence for s in followed("condensation", short, few, seed)[1:]) for seed in range(400)]
    ratios = np.exp(np.array(totals) - exact)
    assert ratios.mean() == pytest.approx(1.0, abs=4 * ratios.std() / np.sqrt(len(ratios)))
    assert np.mean(totals) < exact


def test_dimensions_are_copies(seen: list[Frame]) -> None:
    """In three dimensions the exact answer is that of each dimension alone, and the evidences multiply."""
    values = np.array([frame.signal for frame in seen]) * [[1.0, 1.1, 0.8]]
    together, *apart = (followed("kalman", frames(it.tolist()), PARAMETERS) for it in (values, *values.T[..., None]))
    for state, *ones in zip(together, *apart, strict=True):
        assert state.estimate == pytest.approx(np.concatenate([one.estimate for one in ones]))
        assert state.sigma == pytest.approx(np.concatenate([one.sigma for one in ones]))
        assert state.log_evidence == pytest.approx(sum(one.log_evidence for one in ones))


def test_the_kalman_filter_continues_exactly_after_particles(seen: list[Frame]) -> None:
    """It uses the exact posterior that the particle filter keeps beside its particles."""
    exact = followed("kalman", seen, PARAMETERS)
    state = followed("condensation", seen[:6], PARAMETERS)[-1]
    for frame, known in zip(seen[6:], exact[7:], strict=True):
        state = TRACKERS["kalman"].step(state, frame, PARAMETERS, Stream(0, frame.index, Purpose.TRACK))  # type: ignore[assignment]
        assert np.array_equal(state.posterior.mean, known.posterior.mean)
        assert np.array_equal(state.posterior.covariance, known.posterior.covariance)
        assert state.particles is None


def test_a_sample_that_is_not_a_number_is_ignored(seen: list[Frame]) -> None:
    """Both filters keep their prediction without evidence, and use the next sample."""
    broken = frames([[np.nan]])[0]
    for name in ("kalman", "condensation"):
        chosen, states = TRACKERS[name], followed(name, seen[:4], PARAMETERS)
        lost = chosen.step(states[-1], broken, PARAMETERS, Stream(0, 5, Purpose.TRACK))
        newest, older = states[-1].posterior.mean
        assert lost.estimate[0] == pytest.approx(2 * newest - older, abs=1e-9 if name == "kalman" else 0.05)
        assert lost.sigma[0] > states[-1].sigma[0]
        assert lost.log_evidence == pytest.approx(0.0, abs=1e-12)
        found = chosen.step(lost, seen[5], PARAMETERS, Stream(0, 6, Purpose.TRACK))
        assert np.isfinite([found.log_evidence, *found.estimate, *found.sigma]).all()
        assert found.sigma[0] < lost.sigma[0]


@pytest.mark.parametrize(("waveform", "function"), [("sine", np.sin), ("cosine", np.cos)])
def test_truth_turns_once_in_360_frames(waveform: str, function: np.ufunc) -> None:
    """The truth is the sine or cosine of 2 pi t / 360, in every copy."""
    parameters = revise(SineParameters(), {"waveform": waveform, "dimension": 3})
    for t in (0, 1, 90, 360, 500):
        target = SignalSource(0, parameters).frame(t, History(((0, parameters),))).target
        assert target.position == pytest.approx(np.full(3, function(2 * np.pi * t / 360)))


def test_noise_has_its_spread_and_is_independent() -> None:
    """Noise has the standard deviation asked for and does not repeat over frames and copies."""
    parameters = revise(SineParameters(), {"dimension": 2, "observation_noise_sd": 0.1})
    source, history = SignalSource(3, parameters), History(((0, parameters),))
    shown = [source.frame(t, history) for t in range(4000)]
    noise = np.array([frame.signal - frame.target.position for frame in shown])
    assert np.allclose(noise.std(axis=0), 0.1, rtol=0.05)
    assert abs(np.corrcoef(noise.T)[0, 1]) < 0.06
    assert abs(np.corrcoef(noise[1:, 0], noise[:-1, 0])[0, 1]) < 0.06


def test_a_history_has_spans_of_equal_parameters() -> None:
    """A span ends where one of the named parameters changes; another change does not split it."""
    slow, still, other = (
        revise(SineParameters(), {"observation_noise_sd": sd, "sample_count": count})
        for sd, count in ((0.1, 50), (0.1, 60), (0.2, 60))
    )
    history = History(((0, slow), (4, still), (6, other)))
    assert (history.at(3), history.at(4)) == (slow, still)
    assert history.spans(7, "observation_noise_sd") == [(5, slow), (2, other)]
    assert history.spans(7, "waveform", "dimension") == [(7, slow)]
    assert history.spans(7) == [(3, slow), (2, still), (2, other)]
    assert history.spans(0) == []
    with pytest.raises(IndexError):
        history.at(-1)
