"""The particle filter of a chain, beside what is exact or drawn in large numbers."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, Measurements
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.linkage import particles as filtering
from pftrack.experiments.linkage.gaussians import constraints, noise
from pftrack.experiments.linkage.linearised import predict
from pftrack.experiments.linkage.particles import Settings, move, resample
from pftrack.experiments.linkage.scene import LinkageTarget
from pftrack.experiments.linkage.state import LinkageState
from tests.experiments.linkage.chains import CAREFUL

LINKAGE = find("linkage")
Numbers = NDArray[np.float64]
THETA, R = np.array([1.0, 0.8, 0.7]), np.array([70.0, 60.0, 50.0])
ORIGIN = np.array([240.0, 120.0])
NARROW = CAREFUL | {"noise_unknown": False}
WIDE = {
    "start_angle_variance_rad2": 0.02,
    "start_rate_variance_rad2": 1e-6,
    "start_length_variance_px2": 60.0,
    "observation_variance_px2": 9.0,
    "acceleration_rad": 1e-3,
    "noise_unknown": False,
}
FREE = {
    "start_angle_variance_rad2": 0.04,
    "start_rate_variance_rad2": 1e-3,
    "start_length_variance_px2": 400.0,
    "observation_variance_px2": 1.0,
    "acceleration_rad": 0.02,
    "length_difference_12_px": 100,
    "length_difference_23_px": 100,
    "joint_low_deg": -360,
    "joint_high_deg": 360,
    "joint_difference_23_deg": 360,
    "noise_unknown": False,
}
"""Of a chain of which only the first link is seen, and whose joints have no bounds."""


def start(theta: Numbers = THETA, **values: object) -> LinkageState:
    parameters = revise(LINKAGE.simulate().parameters, values)
    target = LinkageTarget(np.zeros(6), theta=theta, r=R, origin_px=ORIGIN)
    return LINKAGE.trackers["particles"].start(target, Frame(0, 0.0), parameters, Stream(0, 0, Purpose.START))


def step(tracker: str, state: LinkageState, seen: Numbers, frame: int = 1, **values: object) -> LinkageState:
    parameters = revise(LINKAGE.simulate().parameters, values)
    shown = Frame(frame, 0.0, measurements=Measurements(np.column_stack([seen, np.zeros(3)]) + ORIGIN, np.ones((3, 2))))
    return LINKAGE.trackers[tracker].step(state, shown, parameters, Stream(4, frame, Purpose.TRACK))


def stepped(state: LinkageState, frames: int, **values: object) -> LinkageState:
    """The particles after some frames of a chain at rest."""
    for frame in range(1, frames + 1):
        state = step("particles", state, image(THETA, R), frame, **values)
    return state


def image(theta: Numbers, r: Numbers) -> Numbers:
    return np.cumsum(r * np.cos(np.cumsum(theta, axis=-1)), axis=-1)


def test_on_what_is_almost_linear_it_is_the_kalman_filter() -> None:
    """Mean, covariance and evidence are the extended filter's, which is exact there, and hardly a weight differs."""
    seen = image(THETA + 0.01, R) + np.array([0.5, -0.5, 1.0])
    wanted = step("ekf", start(**NARROW), seen, **NARROW)
    exact = wanted.belief.members[0]
    found = step("particles", start(**NARROW), seen, sample_count=2000, **NARROW)
    mean, covariance = found.belief.moments
    deviations = np.sqrt(exact.covariance.diagonal())
    assert (np.abs(mean - exact.mean) < 0.1 * deviations).all()
    assert np.sqrt(covariance.diagonal()) == pytest.approx(deviations, rel=0.06)
    assert found.belief.effective_sample_size > 1500
    assert found.log_evidence == pytest.approx(wanted.log_evidence + 1.5 * np.log(2.0 * np.pi), abs=0.02)


def test_what_is_not_linear_is_drawn_rightly() -> None:
    """Under bounds and a wide prior the moments are those of half a million draws of the prior, weighed by hand.

    The unscented filter, whose posterior is cut instead, comes near; half a deviation is what cutting costs.
    """
    seen = image(THETA + 0.1, R - 2.0)
    sd = np.sqrt([WIDE["start_angle_variance_rad2"] + 1e-6, WIDE["start_length_variance_px2"]]).repeat(3)
    draws = np.append(THETA, R) + sd * np.random.default_rng(0).normal(size=(500_000, 6))
    rows, low, high = revise(LINKAGE.simulate().parameters, WIDE).bounds.constraints(in_space=False)
    along = draws @ rows.T
    off = seen - image(draws[:, :3], draws[:, 3:])
    weights = ((along >= low) & (along <= high)).all(axis=1).astype(float)
    weights *= np.exp(-0.5 * np.square(off).sum(axis=1) / WIDE["observation_variance_px2"])
    weights /= weights.sum()
    mean = weights @ draws
    deviations = np.sqrt(weights @ np.square(draws - mean))
    found, near = (step(name, start(**WIDE), seen, sample_count=8000, **WIDE) for name in ("particles", "ukf"))
    assert (np.abs(found.mean - mean) < 0.2 * deviations).all()
    assert found.spread == pytest.approx(deviations, rel=0.1)
    assert (np.abs(near.mean - mean) < 0.5 * deviations).all()


PATHS = {
    "through the parallel": np.linspace(0.4, -0.3, 13),
    "to and fro": 0.6 + 0.5 * np.sin(np.arange(25) / 4.0),
}
"""Directions of the first link, rad."""


def by_grid(path: Numbers, seen: Numbers) -> tuple[float, float]:
    """Mean and deviation of the first length by Bayes's rule on a grid, its pose by 4,000 particles at each node."""
    lengths, count = np.linspace(60.0, 80.0, 21), 4_000
    log_density = -0.5 * np.square(lengths - R[0]) / FREE["start_length_variance_px2"]
    for node, length in enumerate(lengths):
        rng = np.random.default_rng(5)
        theta = path[0] + np.sqrt(FREE["start_angle_variance_rad2"]) * rng.normal(size=count)
        rate = np.sqrt(FREE["start_rate_variance_rad2"]) * rng.normal(size=count)
        for y in seen:
            push = FREE["acceleration_rad"] * rng.normal(size=count)
            theta, rate = theta + rate + 0.5 * push, rate + push
            log_weights = -0.5 * np.square(y - length * np.cos(theta)) / FREE["observation_variance_px2"]
            weights = np.exp(log_weights - log_weights.max())
            log_density[node] += log_weights.max() + np.log(weights.mean())
            shares = np.cumsum(weights) / weights.sum()
            parents = np.searchsorted(shares, (np.arange(count) + rng.random()) / count).clip(max=count - 1)
            theta, rate = theta[parents], rate[parents]
    density = np.exp(log_density - log_density.max())
    density[[0, -1]] *= 0.5
    density /= density.sum()
    mean = density @ lengths
    return float(mean), float(np.sqrt(density @ np.square(lengths - mean)))


@pytest.mark.parametrize("name", PATHS)
def test_a_length_has_the_posterior_of_a_grid(name: str) -> None:
    """Mean within 0.6 deviations and deviation within a quarter of what Bayes's rule gives on a grid of lengths.

    The difference is that of a Gaussian pose where the link is nearly parallel, and of 600 particles.
    """
    path = PATHS[name]
    seen = 72.0 * np.cos(path[1:]) + np.random.default_rng(0).normal(size=len(path) - 1)
    mean, deviation = by_grid(path, seen)
    state = start(np.array([path[0], 0.8, 0.7]), **FREE)
    for frame, y in enumerate(seen, 1):
        state = step("particles", state, np.array([y, np.nan, np.nan]), frame, sample_count=600, **FREE)
    lengths, weights = state.belief.values[:, 0], state.belief.weights
    found = weights @ lengths
    assert found == pytest.approx(mean, abs=0.6 * deviation)
    assert np.sqrt(weights @ np.square(lengths - found)) == pytest.approx(deviation, rel=0.25)


def test_a_move_leaves_a_posterior_as_it_is() -> None:
    """Many sweeps of the kernel over particles of a posterior change neither mean nor deviation of any value."""
    state, parameters = (
        stepped(start(**FREE), 2, sample_count=1500, **FREE),
        revise(LINKAGE.simulate().parameters, FREE),
    )
    particles = moved = resample(state.belief, 1500, Stream(0, 3, Purpose.TRACK))
    noises, bounds = noise(parameters, False), constraints(parameters, False)
    settings = Settings(noises, parameters.observation_variance_px2, bounds, unknown=False)
    for sweep in range(12):
        moved = move(moved, settings, Stream(1, sweep, Purpose.TRACK))
    before, after = particles.values[:, :3], moved.values[:, :3]
    assert (before != after).any(axis=1).mean() > 0.8
    assert (np.abs(after.mean(axis=0) - before.mean(axis=0)) < 0.2 * before.std(axis=0)).all()
    assert after.std(axis=0) == pytest.approx(before.std(axis=0), rel=0.15)


def test_lengths_keep_their_bounds() -> None:
    """No particle has a length beyond a bound, nor a difference of two; poses beyond a bound are counted."""
    state = stepped(start(**WIDE), 1, sample_count=500, **WIDE)
    lengths = state.belief.values[:, :3]
    assert ((lengths >= [60.0, 50.0, 40.0]) & (lengths <= [80.0, 70.0, 60.0])).all()
    assert (np.abs(np.diff(lengths, axis=1)) <= 15.0).all()
    assert 0 <= state.events.truncated < 500


def test_noises_are_learned_within_their_range() -> None:
    """Of a link that hardly accelerates and is seen to half a pixel, both factors come near the truth."""
    values = {**FREE, "noise_unknown": True, "observation_variance_px2": 5.0, "acceleration_rad": 0.05}
    path, rng = np.linspace(1.2, 0.9, 41), np.random.default_rng(3)
    state = start(np.array([path[0], 0.8, 0.7]), **values)
    for frame, angle in enumerate(path[1:], 1):
        seen = image(np.array([angle, 0.8, 0.7]), R) + 0.5 * rng.normal(size=3)
        state = step("particles", state, seen, frame, **values)
    factors = np.exp(state.belief.values[:, 3:])
    assert np.median(factors[:, -1]) == pytest.approx(0.05, rel=0.5)
    assert np.median(factors[:, 0]) < 0.1
    assert 0.003 <= factors.min() <= factors.max() <= 2.0


def test_a_change_of_settings_is_taken_for_all_frames() -> None:
    """What was seen is filtered again with the new ones, and the belief goes on."""
    values = {**FREE, "sample_count": 300}
    state = stepped(start(**FREE), 3, **values)
    after = step("particles", state, image(THETA, R), 4, **{**values, "observation_variance_px2": 0.5})
    assert len(after.belief.history) == 4
    assert after.belief.key != state.belief.key
    assert np.isfinite(after.mean).all()


def test_nothing_seen_is_the_motion_alone() -> None:
    """Without any point the cloud moves and widens, hardly a weight changes, and there is no evidence."""
    before = stepped(start(**NARROW), 1, sample_count=1000, **NARROW)
    after = step("particles", before, np.full(3, np.nan), 2, sample_count=1000, **NARROW)
    assert after.belief.effective_sample_size == pytest.approx(before.belief.effective_sample_size, rel=0.05)
    assert after.mean == pytest.approx(before.mean, abs=0.2)
    _, wanted = predict(*before.belief.moments, noise(revise(LINKAGE.simulate().parameters, NARROW), False))
    assert np.sqrt(after.belief.covariance.diagonal()) == pytest.approx(np.sqrt(wanted.diagonal()), rel=0.1)
    assert (after.events.outlier, after.log_evidence) == (False, pytest.approx(0.0, abs=1e-9))


def test_particles_know_their_parents() -> None:
    """The first particles come of a Gaussian and have none; later ones have, in order; their number may change."""
    first = stepped(start(**NARROW), 1, sample_count=100, **NARROW)
    assert (first.belief.ancestors == -1).all()
    second = step("particles", first, image(THETA, R), 2, sample_count=70, **NARROW)
    assert len(second.belief) == 70
    assert (np.diff(second.belief.ancestors) >= 0).all()
    assert 0 <= second.belief.ancestors.min() <= second.belief.ancestors.max() < 100


def test_an_observation_in_portions_is_the_same_observation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Taken bit by bit it gives the same lengths and the same evidence as taken whole."""
    seen = image(THETA + 0.01, R)
    whole = step("particles", start(**WIDE), seen, sample_count=2000, **WIDE)
    monkeypatch.setattr(filtering, "LEAST_LEFT", 0.95)
    portions = step("particles", start(**WIDE), seen, sample_count=2000, **WIDE)
    assert (np.abs(portions.mean - whole.mean) < 0.2 * whole.spread).all()
    assert portions.spread == pytest.approx(whole.spread, rel=0.15)
    assert portions.log_evidence == pytest.approx(whole.log_evidence, abs=0.3)
    assert (portions.belief.ancestors == -1).all()
