"""The motion model of a ball, the trackers' reports, and states that one tracker hands to another."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are

from pftrack.core.geometry import paint_disc
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.source import Frame, Target
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments.ball import model as motion
from pftrack.experiments.ball.model import COLOURED, MODELLED, TRACKERS, BallTrackerParameters, colour_model
from pftrack.experiments.shared.reports import PointState
from pftrack.filters import kalman
from pftrack.filters.learning import online_em
from pftrack.vision.likelihoods import chromaticity

SIZE = (160, 120)
MIDDLE = np.array([80.0, 60.0])
PARTICLES = [name for name in TRACKERS if name != "kalman"]


def parameters(**values: Value) -> BallTrackerParameters:
    return revise(BallTrackerParameters(), {"sample_count": 200, **values})


def picture(x: float, radius: float = 6.0) -> NDArray[np.uint8]:
    image = np.full((SIZE[1], SIZE[0], 3), 100 if radius else 0, np.uint8)
    if radius:
        paint_disc(image, x, 60.0, radius, (200, 50, 50))
    return image


def frame(index: int, radius: float = 6.0) -> Frame:
    """Return a picture of a ball that moves right, or a black one if the radius is 0."""
    return Frame(index, index / 30, image_rgb=picture(60.0 + 3 * index, radius))


def begun(given: BallTrackerParameters, seed: int = 1) -> PointState:
    return COLOURED.start(Target(np.array([60.0, 60.0]), 12.0), frame(0), given, Stream(seed, 0, Purpose.START))


def stepped(tracker: str, state: PointState, index: int, given: BallTrackerParameters, radius: float = 6.0) -> Any:
    return TRACKERS[tracker].step(state, frame(index, radius), given, Stream(1, index, Purpose.TRACK))


def advanced(tracker: str, given: BallTrackerParameters, frames: int) -> Any:
    """Return the state after some frames."""
    state = begun(given)
    for index in range(1, frames + 1):
        state = stepped(tracker, state, index, given)
    return state


def test_a_learned_model_has_the_process_noise_that_is_set() -> None:
    """The model is the learner's, its noise is the slider's."""
    given = parameters(learn_dynamics=True, process_noise_px=4.0)
    state, theta = begun(given), np.hstack([0.5 * np.eye(2), 0.25 * np.eye(2), np.array([[0.1], [-0.2]])])
    model = motion.dynamics_of(replace(state, learner=replace(state.learner, theta=theta)), given, SIZE)
    assert np.array_equal(model.noise_covariance, np.diag([16.0, 16.0, 0.0, 0.0]))
    fixed_point = np.tile(MIDDLE + 100 * np.array([0.1, -0.2]) / (1 - 0.75), 2)
    assert model.predict(fixed_point[None])[0] == pytest.approx(fixed_point)
    untaught, initial = motion.dynamics_of(state, given, SIZE), motion.initial_dynamics(given, SIZE)
    assert untaught.transition == pytest.approx(initial.transition)


@pytest.mark.parametrize("tracker", MODELLED)
def test_every_tracker_predicts_by_what_was_learned(tracker: str) -> None:
    """In a black picture the estimate is the learned model's prediction, not the initial model's."""
    given = parameters(learn_dynamics=True, sample_count=2000)
    state = advanced(tracker, given, 1)
    jump = np.hstack([np.eye(2), np.zeros((2, 2)), np.array([[0.15], [-0.1]])])
    taught = replace(state, learner=replace(state.learner, theta=jump))
    after = stepped(tracker, taught, 2, given, radius=0.0)
    assert after.estimate - state.estimate == pytest.approx([15.0, -10.0], abs=0.5)


@pytest.mark.parametrize("tracker", MODELLED)
def test_every_tracker_learns_from_its_estimates(tracker: str) -> None:
    """After a step the learner is the previous one updated by this frame's estimate and deviation."""
    given = parameters(learn_dynamics=True, warm_up_frames=2, forgetting=0.9, learning_ridge=1e-3)
    settings = online_em.Settings(0.9, 2, 1e-3, given.largest_spectral_radius)
    state, initial = begun(given), motion.initial_dynamics(given, SIZE)
    for index in range(1, 10):
        before, state = state, stepped(tracker, state, index, given)
        expected = online_em.learn(before.learner, initial, state.estimate, state.sigma, settings)
        for name in ("theta", "regressors", "products"):
            assert np.array_equal(getattr(state.learner, name), getattr(expected, name))
        assert state.learner.frames == index
    assert not np.array_equal(state.learner.theta, begun(given).learner.theta)  # type: ignore[union-attr] # it learns


def test_learning_begins_at_the_estimate_when_it_is_switched_on() -> None:
    """The learner's first position is the current estimate with the deviation of the position's posterior."""
    state = advanced("condensation", parameters(), 1)
    learner = motion.with_learner(state, SIZE, parameters(learn_dynamics=True)).learner
    assert 100 * learner.positions.mean[:2] + MIDDLE == pytest.approx(state.estimate)
    assert 100 * learner.positions.standard_deviations[0] == pytest.approx(state.sigma.max())
    assert motion.with_learner(state, SIZE, parameters()) is state


def test_the_start_is_known() -> None:
    """Particles are at rest with the initial spread on both axes; the posterior is the position itself."""
    state = begun(parameters(sample_count=40_000, initial_sd_px=5.0))
    now, before = np.hsplit(state.particles.states, 2)
    assert np.array_equal(now, before)
    assert now.mean(axis=0) == pytest.approx([60, 60], abs=0.1)
    assert np.cov(now.T) == pytest.approx(25 * np.eye(2), abs=0.6)
    assert np.array_equal(state.posterior.mean, [60, 60, 60, 60])
    assert np.array_equal(state.posterior.covariance, 25 * np.tile(np.eye(2), (2, 2)))


def test_particles_after_a_gaussian_are_its_samples() -> None:
    """Their mean and covariance are the Gaussian's."""
    root = np.random.default_rng(0).normal(size=(4, 4))
    state = PointState(Gaussian(np.array([60.0, 50.0, 58.0, 49.0]), root @ root.T), 2)
    particles = COLOURED.particles(state, parameters(sample_count=60_000), Stream(3, 7, Purpose.TRACK))
    assert particles.mean == pytest.approx(state.posterior.mean, abs=0.05)
    assert particles.covariance == pytest.approx(state.posterior.covariance, abs=0.15)
    assert np.ptp(particles.log_weights) == 0


@pytest.mark.parametrize("before", PARTICLES)
def test_the_kalman_filter_takes_over_the_moments_of_the_particles(before: str) -> None:
    """Its posterior is the exact update of the Gaussian with their mean and covariance."""
    given = parameters()
    state = advanced(before, given, 1)
    prior = kalman.predict(Gaussian(*state.particles.moments), motion.initial_dynamics(given, SIZE))
    seen = chromaticity.centroid(picture(66.0), colour_model(given))
    assert seen is not None
    expected, log_evidence = kalman.update(prior, seen, np.eye(2, 4), given.measurement_noise_px**2 * np.eye(2))
    after = stepped("kalman", state, 2, given)
    assert (after.particles, after.arrays()) == (None, {})
    assert after.posterior.mean == pytest.approx(expected.mean)
    assert after.posterior.covariance == pytest.approx(expected.covariance)
    assert after.log_evidence == pytest.approx(log_evidence)


@pytest.mark.parametrize("tracker", PARTICLES)
@pytest.mark.parametrize("count", [1, 500])
def test_the_number_of_particles_may_change(tracker: str, count: int) -> None:
    """The next frame has the new number, and all descend from the present particles."""
    state = stepped(tracker, begun(parameters()), 1, parameters(resampling_threshold=0.1))
    after = stepped(tracker, state, 2, parameters(sample_count=count, resampling_threshold=0.1))
    assert len(after.particles) == count
    assert after.particles.ancestors.max() < 200
    assert np.isfinite(after.estimate).all()
    parents = state.particles.states[after.particles.ancestors]
    assert np.array_equal(after.particles.states[:, 2:], parents[:, :2])


@pytest.mark.parametrize("tracker", PARTICLES)
def test_reports_follow_from_the_particles(tracker: str) -> None:
    """ESS, counts, mean and deviation are those of the particles, and every declared series is reported."""
    member, state = TRACKERS[tracker], advanced(tracker, parameters(), 3)
    found, weights = member.measure(state), np.exp(state.particles.log_weights)
    assert found.keys() == {series.name for series in member.series}
    assert weights.sum() == pytest.approx(1.0)
    assert found["ess"] == pytest.approx(1 / (weights**2).sum())
    assert found["particles"] == len(weights) == 200
    assert found["unique_ancestors"] == len(np.unique(state.particles.ancestors))
    mean = weights @ state.particles.states
    assert state.estimate == pytest.approx(mean[:2], abs=1e-9)
    spread = weights @ (state.particles.states[:, :2] - mean[:2]) ** 2
    assert state.sigma == pytest.approx(np.sqrt(spread), abs=1e-9)


def test_samplers_are_those_of_the_tracker() -> None:
    """Condensation draws by prediction, the auxiliary filter by observation; the others switch by their deviation.

    A switch is reported in exactly the frames whose sampler differs from that of the frame before.
    """
    given = parameters(gamma_px=3.0, gamma_min_px=3.0, gamma_max_px=5.0)
    states = {name: [begun(given)] for name in ("condensation", "pc-pf", "apf", "h-spf", "s-spf")}
    for name, course in states.items():
        for index in range(1, 13):
            # The ball is away for some frames, so that the posterior widens.
            course.append(stepped(name, course[-1], index, given, 0.0 if 5 <= index < 9 else 6.0))
    rows = {name: [TRACKERS[name].measure(state) for state in course[1:]] for name, course in states.items()}
    samples = {name: [row["samples"] for row in measured] for name, measured in rows.items()}
    assert set(samples["condensation"]) == set(samples["pc-pf"]) == {(200.0, 0.0)}
    assert set(samples["apf"][:4]) == {(0.0, 200.0)}
    assert set(samples["h-spf"]) == {(200.0, 0.0), (0.0, 200.0)}
    assert len(set(samples["s-spf"])) > 2
    changed = [before.alert not in {None, after.alert} for before, after in pairwise(states["h-spf"])]
    assert [row["switched"] for row in rows["h-spf"]] == [float(flag) for flag in changed]
    assert any(changed)


def test_the_kalman_filter_reaches_its_steady_state() -> None:
    """For a ball at rest the mean is the centroid, and the covariance solves the Riccati equation.

    In a picture without the colour the filter only predicts.
    """
    given, tracker = parameters(), TRACKERS["kalman"]
    state = begun(given)
    for _ in range(200):
        state = tracker.step(state, frame(5), given, Stream(1, 5, Purpose.TRACK))
    assert state.estimate == pytest.approx((75, 60), abs=1e-3)
    kept = given.velocity_retention
    noise, seen = np.square([given.process_noise_px, given.measurement_noise_px])
    transition, observation = np.array([[1 + kept, -kept], [1.0, 0.0]]), np.array([[1.0, 0.0]])
    prior = solve_discrete_are(transition.T, observation.T, np.diag([noise, 0.0]), np.array([[seen]]))
    assert state.sigma**2 == pytest.approx(prior[0, 0] * seen / (prior[0, 0] + seen), abs=1e-6)
    assert tracker.measure(state)["nis"] == pytest.approx(0, abs=1e-12)
    blind = stepped("kalman", state, 6, given, radius=0.0)
    assert (blind.estimate, blind.log_evidence) == (pytest.approx(state.estimate, abs=1e-3), 0.0)
    assert blind.sigma**2 == pytest.approx(prior[0, 0], abs=1e-6)


@pytest.mark.parametrize("tracker", PARTICLES)
def test_an_impossible_picture_leaves_the_prediction(tracker: str) -> None:
    """A black picture without a background level gives equal weights and no evidence; tracking then continues."""
    given = parameters(background_level=0.0)
    state = advanced(tracker, given, 1)
    blind = stepped(tracker, state, 2, given, radius=0.0)
    assert (blind.log_evidence, blind.observation_count) == (-np.inf, 0)
    assert np.allclose(blind.particles.weights, 1 / 200)
    assert blind.estimate == pytest.approx(blind.particles.states[:, :2].mean(axis=0))
    velocity = state.posterior.mean[:2] - state.posterior.mean[2:]
    assert blind.estimate == pytest.approx(state.estimate + velocity, abs=1.0)
    assert np.isfinite(stepped(tracker, blind, 3, given).log_evidence)


@pytest.mark.parametrize("tracker", PARTICLES)
def test_the_path_is_that_of_the_ancestors(tracker: str) -> None:
    """Each particle's past is that of its ancestors, traced here through every frame's parents.

    Without smoothing, or without particles, there are no paths.
    """
    given = parameters(smoothing_lag_frames=3, resampling_threshold=0.5)
    states = [begun(given).particles]
    state: Any = begun(given)
    for index in range(1, 6):
        state = stepped(tracker, state, index, given)
        states.append(state.particles)
        chosen = np.arange(200)
        assert state.lineage.paths.shape == (min(index, 3) + 1, 200, 2)
        for where, then in zip(state.lineage.paths, reversed(states), strict=False):
            assert np.array_equal(where, then.states[chosen, :2])
            chosen = then.ancestors[chosen]
    assert stepped(tracker, state, 6, parameters()).lineage is None
    assert stepped("kalman", state, 6, given).lineage is None


def test_the_colour_is_that_of_the_parameters() -> None:
    """Redness ignores the share of green, chromaticity weighs both, and the packed numbers agree."""
    red = parameters(target_red_share=0.6, target_green_share=0.2, red_spread=0.04, green_spread=0.1)
    both = revise(red, {"colour_model": "chromaticity", "background_level": 0.3})
    assert colour_model(red) == chromaticity.ColourModel((0.6, 0.2), (0.04, np.inf))
    assert colour_model(both) == chromaticity.ColourModel((0.6, 0.2), (0.04, 0.1))
    assert COLOURED.pack(None, both) == ((0.6, 0.2), pytest.approx((312.5, 50.0)), 0.3)
    assert COLOURED.pack(None, red)[1][1] == 0.0


def test_a_switch_after_a_gaussian_depends_on_its_deviation() -> None:
    """A switching filter that takes over judges the Gaussian itself, not a sample of it."""
    state = advanced("kalman", parameters(), 1)
    for factor, switched in ((1 - 1e-9, True), (1 + 1e-9, False)):
        given = parameters(gamma_px=factor * float(state.sigma.max()))
        for seed in range(4):
            after = TRACKERS["h-spf"].step(state, frame(2), given, Stream(seed, 2, Purpose.TRACK))
            assert after.alert == switched
