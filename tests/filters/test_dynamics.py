import numpy as np
import pytest

from pftrack.filters.dynamics import LinearDynamics, autoregression, constant_velocity, random_walk

MODELS = {
    "random walk": random_walk(3, 2.0),
    "constant velocity": constant_velocity(2, 0.1, 5.0),
    "autoregression": autoregression(
        np.array([[1.9, 0.1], [0.0, 1.8]]), -0.9 * np.eye(2), np.array([3.0, -1.0]), np.diag([2.0, 0.5])
    ),
}


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_samples_have_the_moments_of_the_model(model: LinearDynamics) -> None:
    """Drawn states have mean A x + d and covariance B B^T, within five standard errors."""
    rng = np.random.default_rng(2)
    state = rng.normal(size=(1, len(model.offset))) * 10
    count = 200_000
    drawn = model.diffuse(rng, model.predict(state), np.zeros(count, dtype=np.int64))
    expected = model.transition @ state[0] + model.offset
    scale = np.sqrt(np.diag(model.noise_covariance))
    assert (np.abs(drawn.mean(0) - expected) <= 5 * scale / np.sqrt(count) + 1e-9).all()
    assert np.allclose(np.cov(drawn.T), model.noise_covariance, atol=5 * scale.max() ** 2 / np.sqrt(count) * 2)


def test_ancestors_are_followed() -> None:
    """Without noise each drawn state is the prediction of its ancestor."""
    model = LinearDynamics(np.eye(2), np.ones(2), np.zeros((2, 1)))
    states = np.arange(6.0).reshape(3, 2)
    drawn = model.diffuse(np.random.default_rng(0), model.predict(states), np.array([2, 0, 2, 1]))
    assert np.array_equal(drawn, states[[2, 0, 2, 1]] + 1)


def test_constant_velocity_moves_by_its_velocity() -> None:
    """Position advances by velocity times the interval, velocity stays."""
    model = constant_velocity(2, 0.5, 1.0)
    assert np.allclose(model.predict(np.array([[1.0, 2.0, 4.0, -6.0]])), [[3.0, -1.0, 4.0, -6.0]])


def test_autoregression_shifts_its_past() -> None:
    """The second block of the next state is the first block of this one, exactly."""
    model = MODELS["autoregression"]
    states = np.random.default_rng(1).normal(size=(5, 4))
    drawn = model.diffuse(np.random.default_rng(2), model.predict(states), np.arange(5))
    assert np.array_equal(drawn[:, 2:], states[:, :2])
