"""The particle filter of a chain, beside what is exact or drawn in large numbers."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.experiments import find
from pftrack.model.frame import Frame, Measurements
from pftrack.model.parameters import revise
from pftrack.numerics.random import Purpose, Stream
from pftrack.particles import ParticleSet
from pftrack.sources.linkage.truth import LinkageTarget
from pftrack.trackers.linkage import particles as filtering
from pftrack.trackers.linkage.gaussians import constraints, noise
from pftrack.trackers.linkage.linearised import predict
from pftrack.trackers.linkage.state import LinkageState

LINKAGE = find("linkage")
THETA, R = np.array([1.0, 0.8, 0.7]), np.array([70.0, 60.0, 50.0])
ORIGIN = np.array([240.0, 120.0])
NARROW = {
    "start_angle_variance_rad2": 1e-4,
    "start_rate_variance_rad2": 1e-6,
    "start_length_variance_px2": 1.0,
    "observation_variance_px2": 1.0,
    "length_difference_12_px": 100,
    "length_difference_23_px": 100,
}
WIDE = {
    "start_angle_variance_rad2": 0.02,
    "start_rate_variance_rad2": 1e-6,
    "start_length_variance_px2": 60.0,
    "observation_variance_px2": 9.0,
    "acceleration_rad": 1e-3,
}


def start(theta: NDArray[np.float64] = THETA, **values: object) -> LinkageState:
    parameters = revise(LINKAGE.simulate().parameters, values)
    target = LinkageTarget(np.zeros(6), theta=theta, r=R, origin_px=ORIGIN)
    return LINKAGE.trackers["particles"].start(target, Frame(0, 0.0), parameters, Stream(0, 0, Purpose.START))


def step(
    tracker: str, state: LinkageState, seen: NDArray[np.float64], frame: int = 1, **values: object
) -> LinkageState:
    parameters = revise(LINKAGE.simulate().parameters, values)
    measured = Measurements(np.column_stack([seen, np.zeros(3)]) + ORIGIN, np.ones((3, 2)))
    stream = Stream(4, frame, Purpose.TRACK)
    return LINKAGE.trackers[tracker].step(state, Frame(frame, 0.0, measurements=measured), parameters, stream)


def image(theta: NDArray[np.float64], r: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.cumsum(r * np.cos(np.cumsum(theta, axis=-1)), axis=-1)


def test_on_what_is_almost_linear_it_is_the_kalman_filter() -> None:
    """Mean, covariance and evidence are the extended filter's, which is exact there, and hardly a weight differs."""
    seen = image(THETA + 0.01, R) + np.array([0.5, -0.5, 1.0])
    wanted = step("ekf", start(**NARROW), seen, **NARROW)
    exact = wanted.belief.members[0]
    found = step("particles", start(**NARROW), seen, sample_count=2000, **NARROW)
    mean, covariance = found.belief.moments
    deviations = np.sqrt(exact.covariance.diagonal())
    assert (
        np.abs(mean - exact.mean).max() < 0.1 * deviations.min() or (np.abs(mean - exact.mean) < 0.1 * deviations).all()
    )
    assert np.sqrt(covariance.diagonal()) == pytest.approx(deviations, rel=0.06)
    assert found.belief.effective_sample_size > 1900
    assert found.log_evidence == pytest.approx(wanted.log_evidence + 1.5 * np.log(2.0 * np.pi), abs=0.02)


def test_what_is_not_linear_is_drawn_rightly() -> None:
    """Under bounds and a wide prior the moments are those of a million draws of the prior, weighed by hand.

    The unscented filter, whose posterior is cut instead, comes near; half a deviation is what cutting costs.
    """
    rng = np.random.default_rng(0)
    seen = image(THETA + 0.1, R - 2.0)
    angles = THETA + np.sqrt(WIDE["start_angle_variance_rad2"] + 1e-6) * rng.normal(size=(1_000_000, 3))
    lengths = R + np.sqrt(WIDE["start_length_variance_px2"]) * rng.normal(size=(1_000_000, 3))
    draws = np.column_stack([angles, lengths])
    rows, low, high = revise(LINKAGE.simulate().parameters, WIDE).bounds.constraints(in_space=False)
    along = draws @ rows.T
    weights = ((along >= low) & (along <= high)).all(axis=1).astype(float)
    off = seen - image(angles, lengths)
    weights *= np.exp(-0.5 * np.square(off).sum(axis=1) / WIDE["observation_variance_px2"])
    weights /= weights.sum()
    mean = weights @ draws
    deviations = np.sqrt(weights @ np.square(draws - mean))
    found = step("particles", start(**WIDE), seen, sample_count=8000, **WIDE)
    assert (np.abs(found.mean - mean) < 0.15 * deviations).all()
    assert found.spread == pytest.approx(deviations, rel=0.1)
    near = step("ukf", start(**WIDE), seen, **WIDE)
    assert (np.abs(near.mean - mean) < 0.5 * deviations).all()


def test_no_particle_beyond_a_bound_has_weight() -> None:
    """A bound is a factor of 0 or 1, and what it takes is counted."""
    state = step("particles", start(**WIDE), image(THETA, R), sample_count=500, **WIDE)
    rows, low, high = constraints(revise(LINKAGE.simulate().parameters, WIDE), in_space=False)
    along = state.belief.states @ rows.T
    allowed = ((along >= low) & (along <= high)).all(axis=1)
    assert (state.belief.weights[~allowed] == 0.0).all()
    assert state.events.truncated == np.count_nonzero(~allowed) > 0


def test_nothing_seen_is_the_motion_alone() -> None:
    """Without any point the cloud moves and widens, its weights stay the same, and there is no evidence."""
    before = step("particles", start(**NARROW), image(THETA, R), sample_count=1000, **NARROW)
    after = step("particles", before, np.full(3, np.nan), 2, sample_count=1000, **NARROW)
    assert after.belief.effective_sample_size == pytest.approx(1000)
    assert after.mean == pytest.approx(before.mean, abs=0.2)
    parameters = revise(LINKAGE.simulate().parameters, NARROW)
    _, wanted = predict(*before.belief.moments, noise(parameters, False))
    assert np.sqrt(after.belief.covariance.diagonal()) == pytest.approx(np.sqrt(wanted.diagonal()), rel=0.1)
    assert (after.events.outlier, after.log_evidence) == (False, pytest.approx(0.0, abs=1e-9))


def test_particles_know_their_parents() -> None:
    """The first particles come of a Gaussian and have none; later ones have, in order; their number may change."""
    first = step("particles", start(**NARROW), image(THETA, R), sample_count=100, **NARROW)
    assert (first.belief.ancestors == -1).all()
    second = step("particles", first, image(THETA, R), 2, sample_count=70, **NARROW)
    assert len(second.belief) == 70
    assert (np.diff(second.belief.ancestors) >= 0).all()
    assert 0 <= second.belief.ancestors.min() <= second.belief.ancestors.max() < 100


def test_an_observation_in_portions_is_the_same_observation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Taken bit by bit it gives the same posterior and the same evidence as taken whole."""
    seen = image(THETA + 0.01, R)
    whole = step("particles", start(**NARROW), seen, sample_count=4000, **NARROW)
    monkeypatch.setattr(filtering, "FEW", 2.0)
    portions = step("particles", start(**NARROW), seen, sample_count=4000, **NARROW)
    assert (np.abs(portions.mean - whole.mean) < 0.15 * whole.spread).all()
    assert portions.spread == pytest.approx(whole.spread, rel=0.12)
    assert portions.log_evidence == pytest.approx(whole.log_evidence, abs=0.3)
    assert (portions.belief.ancestors == -1).all()


def test_a_wide_belief_survives_a_sharp_observation() -> None:
    """Where hardly a particle would be left, the portions keep many, and they fit what is seen."""
    values = {"start_angle_variance_rad2": 0.2, "start_length_variance_px2": 400.0, "observation_variance_px2": 0.05}
    seen = image(THETA + 0.1, R)
    state = step("particles", start(**values), seen, **values)
    belief = state.belief
    assert isinstance(belief, ParticleSet)
    assert belief.effective_sample_size > 20
    off = image(belief.states[:, :3], belief.states[:, 6:]) - seen
    assert np.sqrt(belief.weights @ np.square(off).sum(axis=1)) < 1.0


def test_the_third_link_is_kept_through_the_parallel() -> None:
    """On a motion through the parallel pose the cloud holds both sides, and ends on the right one."""
    way = 0.5 - 0.5 * np.cos(np.pi * np.arange(40) / 39)[:, None]
    theta = np.array([1.35, 0.95, 1.1]) + way * np.array([-0.1, -0.35, -0.95])
    state = start(theta[0] + 0.05)
    noise = np.random.default_rng(2).normal(size=(40, 3))
    for frame in range(1, 40):
        state = step("particles", state, image(theta[frame], R) + noise[frame], frame, sample_count=300)
    assert state.directions == pytest.approx(np.cumsum(theta[-1]), abs=0.2)
