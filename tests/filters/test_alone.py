"""A model of somebody's own, filtered alone: the exact answer, the same numbers again, and what is refused."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import pftrack
from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, Target
from pftrack.core.numerics.random import Gaussian
from pftrack.experiments import find
from pftrack.filters import kalman
from pftrack.filters.dynamics import random_walk

DRIVE, NOISE = 0.3, 0.5


class Walk:
    def begin(self, rng: Any, n: int) -> Any:
        return rng.normal(0.0, 1.0, (n, 1))

    def propagate(self, states: Any, rng: Any) -> Any:
        return states + rng.normal(0.0, DRIVE, states.shape)

    def log_likelihood(self, states: Any, frame: Any) -> Any:
        if frame is None:
            return np.zeros(len(states))
        return -0.5 * ((frame - states[:, 0]) / NOISE) ** 2 - np.log(NOISE * np.sqrt(2.0 * np.pi))


def test_it_comes_to_the_exact_answer() -> None:
    """Means, deviations and evidence are those of the Kalman filter, within five deviations of Monte Carlo."""
    rng, n = np.random.default_rng(5), 20_000
    values = np.cumsum(rng.normal(0.0, DRIVE, 40)) + rng.normal(0.0, NOISE, 40)
    data = [None if 10 <= index < 15 else float(value) for index, value in enumerate(values)]
    found = pftrack.filter(Walk(), data, n=n, seed=3)
    belief, dynamics = Gaussian(np.zeros(1), np.eye(1)), random_walk(1, DRIVE)
    evidence = 0.0
    for index, value in enumerate(data):
        belief = kalman.predict(belief, dynamics) if index else belief
        if value is not None:
            belief, told = kalman.update(belief, np.array([value]), np.eye(1), np.array([[NOISE**2]]))
            evidence += told
        sd = belief.standard_deviations[0]
        assert found.means[index, 0] == pytest.approx(belief.mean[0], abs=5.0 * sd / np.sqrt(0.2 * n))
        assert found.sds[index, 0] == pytest.approx(sd, rel=5.0 / np.sqrt(0.4 * n))
    assert found.log_evidence.sum() == pytest.approx(evidence, abs=0.1)
    assert (found.ess >= 1).all()
    assert len(found.particles) == n


def test_a_model_of_an_experiment_runs_alone() -> None:
    """The belief in a signal filters a list of frames, with the experiment's parameters."""
    sine = find("sine")
    parameters = revise(sine.simulate().parameters, {"process_noise_sd": 0.02})
    frames = [Frame(index, index / 30.0, signal=np.array([np.sin(index / 20.0)])) for index in range(20)]
    found = pftrack.filter(sine.model, frames, n=500, parameters=parameters, target=Target(np.zeros(1)))
    assert found.means.shape == (20, 2)
    assert np.abs(found.means[-1, 0] - np.sin(19 / 20.0)) < 0.3


@pytest.mark.parametrize(
    ("function", "answer", "sentence"),
    [
        ("begin", np.zeros(50), r"begin returned states of shape \(50,\); expected \(50, d\)"),
        ("begin", np.full((50, 1), np.nan), "begin returned states that are not finite for 50 of 50 particles"),
        ("propagate", np.zeros((3, 1)), r"propagate returned states of shape \(3, 1\); expected \(50, 1\)"),
        ("log_likelihood", np.zeros(7), r"log_likelihood returned of shape \(7,\); expected \(50,\)"),
        ("log_likelihood", np.full(50, np.nan), "log_likelihood returned NaN for 50 of 50 particles"),
        ("log_likelihood", np.full(50, -np.inf), "-inf for all 50 particles of frame 0: none is near"),
        ("log_likelihood", "no", "log_likelihood returned str, which is not an array of numbers"),
    ],
)
def test_wrong_answers_are_refused(function: str, answer: object, sentence: str) -> None:
    """What a function returns wrongly is refused in one sentence with both sides."""
    model = type("Wrong", (Walk,), {function: lambda self: answer})()
    with pytest.raises(ValueError, match=sentence):
        pftrack.filter(model, [0.1, 0.2, 0.3], n=50)


@pytest.mark.parametrize(
    ("model", "data", "n", "sentence"),
    [
        (SimpleNamespace(), [1.0], 9, "SimpleNamespace has no begin"),
        (type("Odd", (Walk,), {"propagate": lambda self, velocity: velocity})(), [1.0], 9, "asks for velocity, but it"),
        (Walk(), [], 9, "there are no data"),
        (Walk(), [1.0], 0, "n must be at least 1, got 0"),
    ],
)
def test_what_cannot_be_called_is_refused(model: Any, data: list[float], n: int, sentence: str) -> None:
    """A missing function, an argument that there is not, no data and no particles are told."""
    with pytest.raises((TypeError, ValueError), match=sentence):
        pftrack.filter(model, data, n=n)
