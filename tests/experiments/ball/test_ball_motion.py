"""How a ball is expected to move, and what trackers carry from frame to frame and hand over to each other."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import paint_disc
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.source import Frame, Target
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments.ball import model as motion
from pftrack.experiments.ball.model import (
    COLOURED,
    MODELLED,
    TRACKERS,
    BallTrackerParameters,
    LoopParameters,
    colour_model,
)
from pftrack.experiments.shared.reports import PointState
from pftrack.filters import dynamics, kalman
from pftrack.filters.learning import online_em
from pftrack.filters.particles import normalise
from pftrack.filters.resampling import RESAMPLERS
from pftrack.vision.likelihoods import chromaticity

SIZE = (160, 120)
MIDDLE = np.array([80.0, 60.0])
LOOP = ("condensation", "apf", "pc-pf", "h-spf", "s-spf")
PARTICLES = [name for name in TRACKERS if name != "kalman"]


def parameters(**values: Value) -> BallTrackerParameters:
    return revise(BallTrackerParameters(), {"sample_count": 200, **values})


def picture(x: float, radius: float = 6.0) -> NDArray[np.uint8]:
    image = np.full((SIZE[1], SIZE[0], 3), 100 if radius else 0, np.uint8)
    if radius:
        paint_disc(image, x, 60.0, radius, (200, 50, 50))
    return image


def frame(index: int, radius: float = 6.0) -> Frame:
    """A ball that goes to the right; with no radius the night, in which nothing has a colour."""
    return Frame(index, index / 30, image_rgb=picture(60.0 + 3 * index, radius))


def begun(given: LoopParameters, seed: int = 1) -> PointState:
    return COLOURED.start(Target(np.array([60.0, 60.0]), 12.0), frame(0), given, Stream(seed, 0, Purpose.START))


def stepped(tracker: str, state: PointState, index: int, given: LoopParameters, radius: float = 6.0) -> Any:
    return TRACKERS[tracker].step(state, frame(index, radius), given, Stream(1, index, Purpose.TRACK))


def advanced(tracker: str, given: LoopParameters, frames: int) -> Any:
    """Return the state after some frames."""
    state = begun(given)
    for index in range(1, frames + 1):
        state = stepped(tracker, state, index, given)
    return state


def without_noise(given: LoopParameters, first: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return the path (count, 2) that the initial model predicts from two positions (4,)."""
    model, states = motion.initial_dynamics(given, SIZE), [first]
    for _ in range(count - 1):
        states.append(model.predict(states[-1][None])[0])
    return np.array(states)[:, :2]


@pytest.mark.parametrize("retention", [0.0, 0.5, 0.8, 1.0])
def test_of_its_velocity_a_share_is_kept(retention: float) -> None:
    """The path after t frames is x_0 + v (r + r^2 + ... + r^t)."""
    path = without_noise(parameters(velocity_retention=retention), np.array([40.0, 50.0, 36.0, 52.0]), 9)
    shares = np.cumsum(retention ** np.arange(1, 9))
    assert path[1:] == pytest.approx(np.array([40.0, 50.0]) + shares[:, None] * np.array([4.0, -2.0]))


@pytest.mark.parametrize("period", [5.0, 30.0])
def test_an_assumed_period_is_a_swing_about_the_middle(period: float) -> None:
    """The path without noise is the cosine of that period about the middle of the picture, on both axes."""
    phases = 2 * np.pi * np.arange(-1, 40) / period
    swing = MIDDLE + np.outer(np.cos(phases), [30.0, 0.0]) + np.outer(np.sin(phases), [0.0, -20.0])
    given = parameters(assumed_period_frames=period, velocity_retention=0.3)
    path = without_noise(given, np.concatenate([swing[1], swing[0]]), 40)
    assert path == pytest.approx(swing[1:], abs=1e-8)


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
    """In a picture that says nothing the estimate is the learned model's prediction, not that of the first one."""
    given = parameters(learn_dynamics=True, sample_count=2000)
    state = advanced(tracker, given, 1)
    jump = np.hstack([np.eye(2), np.zeros((2, 2)), np.array([[0.15], [-0.1]])])
    taught = replace(state, learner=replace(state.learner, theta=jump))
    after = stepped(tracker, taught, 2, given, radius=0.0)
    assert after.estimate - state.estimate == pytest.approx([15.0, -10.0], abs=0.5)


@pytest.mark.parametrize("tracker", MODELLED)
def test_what_is_learned_is_the_estimate(tracker: str) -> None:
    """After a step the learner is the one of the frame before with this frame's estimate and deviation taken in."""
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
    """The first position of the learner is the present estimate, as sure as the posterior of the position is."""
    state = advanced("condensation", parameters(), 1)
    learner = motion.with_learner(state, SIZE, parameters(learn_dynamics=True)).learner
    assert 100 * learner.positions.mean[:2] + MIDDLE == pytest.approx(state.estimate)
    assert 100 * learner.positions.standard_deviations[0] == pytest.approx(state.sigma.max())
    assert motion.with_learner(state, SIZE, parameters()) is state


@pytest.mark.parametrize("learned", [False, True])
def test_the_start_is_known(learned: bool) -> None:
    """Particles have the initial spread on both axes, at rest; the posterior is the position itself."""
    state = begun(parameters(sample_count=40_000, initial_sd_px=5.0, learn_dynamics=learned))
    now, before = np.hsplit(state.particles.states, 2)
    assert np.array_equal(now, before)
    assert now.mean(axis=0) == pytest.approx([60, 60], abs=0.1)
    assert np.cov(now.T) == pytest.approx(25 * np.eye(2), abs=0.6)
    assert np.array_equal(state.posterior.mean, [60, 60, 60, 60])
    assert np.array_equal(state.posterior.covariance, 25 * np.tile(np.eye(2), (2, 2)))
    assert (state.learner is not None) == learned


def test_particles_after_a_gaussian_are_its_samples() -> None:
    """Their mean and covariance are the Gaussian's; they depend on the frame's seed and not on what else was drawn."""
    root = np.random.default_rng(0).normal(size=(4, 4))
    state = PointState(Gaussian(np.array([60.0, 50.0, 58.0, 49.0]), root @ root.T), 2)
    given, rng = parameters(sample_count=60_000), Stream(3, 7, Purpose.TRACK)
    particles = COLOURED.particles(state, given, rng)
    assert particles.mean == pytest.approx(state.posterior.mean, abs=0.05)
    assert particles.covariance == pytest.approx(state.posterior.covariance, abs=0.15)
    assert np.ptp(particles.log_weights) == 0
    rng.random(5)
    assert np.array_equal(COLOURED.particles(state, given, rng).states, particles.states)
    elsewhere = COLOURED.particles(state, given, Stream(4, 7, Purpose.TRACK))
    assert not np.array_equal(elsewhere.states, particles.states)


@pytest.mark.parametrize("before", PARTICLES)
def test_the_kalman_filter_takes_over_the_moments_of_the_particles(before: str) -> None:
    """Its answer is the exact update of a Gaussian with the mean and covariance of the particles."""
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
    """The next frame has as many as are asked for now, descended from those that there are."""
    state = stepped(tracker, begun(parameters()), 1, parameters(resampling_threshold=0.1))
    after = stepped(tracker, state, 2, parameters(sample_count=count, resampling_threshold=0.1))
    assert len(after.particles) == count
    assert after.particles.ancestors.max() < 200
    assert np.isfinite(after.estimate).all()
    parents = state.particles.states[after.particles.ancestors]
    assert np.array_equal(after.particles.states[:, 2:], parents[:, :2])


@pytest.mark.parametrize("tracker", LOOP)
@pytest.mark.parametrize(("known", "count"), [(False, 12), (True, 12), (False, 1), (True, 1), (False, 2), (True, 2)])
def test_many_frames_at_once_are_as_many_steps(tracker: str, known: bool, count: int) -> None:
    """Estimates, samplers, switches and the last state of a fold are those of steps, from the start and later on."""
    given = parameters(gamma_px=3.0, gamma_min_px=3.0, gamma_max_px=5.0, resampling_threshold=0.6)
    state, member = advanced(tracker, given, 2 * known), TRACKERS[tracker]
    indices = range(1 + 2 * known, 1 + 2 * known + count)
    # Without a ball for some frames, so that the posterior widens and the samplers change.
    radii = [0.0 if (3 if count == 2 else 5) <= index < 9 else 6.0 for index in indices]
    pictures = np.stack([frame(index, radius).image_rgb for index, radius in zip(indices, radii, strict=True)])
    folded = member.fold(state, pictures, given, 1, indices[0])
    rows = []
    for place, (index, radius) in enumerate(zip(indices, radii, strict=True)):
        state = stepped(tracker, state, index, given, radius)
        assert np.array_equal(state.estimate, folded.estimates[place])
        rows.append(member.measure(state))
    assert np.array_equal([row["samples"] for row in rows], folded.series["samples"])
    if tracker in {"h-spf", "s-spf", "pc-pf"}:
        assert [row["switched"] for row in rows] == folded.series["switched"].tolist()
        assert count < 12 or 0 < sum(folded.series["switched"]) < 12
    assert np.array_equal(folded.state.particles.states, state.particles.states)
    assert np.array_equal(folded.state.posterior.covariance, state.posterior.covariance)
    for name in ("log_evidence", "alert", "switched", "resampled", "observation_count"):
        assert getattr(folded.state, name) == getattr(state, name)


def test_nothing_is_folded_while_the_motion_is_learned() -> None:
    """The model of a frame then depends on the estimate of the one before."""
    given = parameters(learn_dynamics=True)
    fold = TRACKERS["h-spf"].fold
    assert fold(begun(given), picture(60.0)[None], given, 1, 1) is None
    assert TRACKERS["upf"].fold is None
    with pytest.raises(ValueError, match="needs particles"):
        fold(PointState(begun(given).posterior, 2), picture(60.0)[None], parameters(), 1, 1)


def test_what_was_learned_is_left_when_learning_is_switched_off() -> None:
    """Many frames at once move by the initial model again, as steps do."""
    state = advanced("condensation", parameters(learn_dynamics=True, warm_up_frames=1), 7)
    folded = TRACKERS["condensation"].fold(state, np.stack([frame(8).image_rgb]), parameters(), 1, 8)
    after = stepped("condensation", state, 8, parameters())
    assert np.array_equal(folded.state.particles.states, after.particles.states)  # type: ignore[attr-defined] # of points


@pytest.mark.parametrize("tracker", PARTICLES)
def test_where_nothing_is_possible_the_prediction_stays(tracker: str) -> None:
    """A black picture and no background level: equal weights, no evidence, and it goes on afterwards."""
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
    """Each particle's past is where its ancestors were, followed by hand through every frame's parents."""
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


def test_a_filter_without_particles_has_no_paths() -> None:
    """The Kalman filter drops them, and they begin again with the next particles."""
    given = parameters(smoothing_lag_frames=3)
    state = stepped("kalman", advanced("condensation", given, 1), 2, given)
    assert state.lineage is None
    state = stepped("condensation", state, 3, given)
    assert len(state.lineage.paths) == 2
    assert dynamics.smooth(state.lineage, state.particles, 0) == pytest.approx(state.estimate)


@pytest.mark.parametrize("tracker", ["condensation", "upf", "pc-pf"])
@pytest.mark.parametrize("resampling", RESAMPLERS)
def test_parents_are_drawn_as_the_parameters_say(tracker: str, resampling: str) -> None:
    """By weight, with the resampler that is chosen, from the first random numbers of the frame."""
    given = parameters(resampling=resampling)
    state, log_weights = begun(given), normalise(np.linspace(-3.0, 0.0, 200))[0]
    state = replace(state, particles=replace(state.particles, log_weights=log_weights))
    expected = RESAMPLERS[resampling](Stream(1, 1, Purpose.TRACK), log_weights, 200)
    assert np.array_equal(stepped(tracker, state, 1, given).particles.ancestors, expected)


def test_the_colour_is_that_of_the_parameters() -> None:
    """Redness alone leaves the share of green out; chromaticity weighs both; what is packed is the same."""
    red = parameters(target_red_share=0.6, target_green_share=0.2, red_spread=0.04, green_spread=0.1)
    both = revise(red, {"colour_model": "chromaticity", "background_level": 0.3})
    assert colour_model(red) == chromaticity.ColourModel((0.6, 0.2), (0.04, np.inf))
    assert colour_model(both) == chromaticity.ColourModel((0.6, 0.2), (0.04, 0.1))
    assert COLOURED.pack(None, both) == ((0.6, 0.2), pytest.approx((312.5, 50.0)), 0.3)
    assert COLOURED.pack(None, red)[1][1] == 0.0


def test_trackers_of_colour_need_pictures() -> None:
    """A signal is refused in a sentence."""
    given, rng = parameters(), Stream(1, 1, Purpose.TRACK)
    for member in TRACKERS.values():
        with pytest.raises(ValueError, match="a picture is needed, got a frame without one"):
            member.step(begun(given), Frame(1, 0.0, signal=np.zeros(1)), given, rng)


def test_after_a_gaussian_the_switch_goes_by_its_deviation() -> None:
    """A switching filter that takes over judges the Gaussian that it was given, not the sample that it drew of it."""
    state = advanced("kalman", parameters(), 1)
    for factor, switched in ((1 - 1e-9, True), (1 + 1e-9, False)):
        given = parameters(gamma_px=factor * float(state.sigma.max()))
        for seed in range(4):
            after = TRACKERS["h-spf"].step(state, frame(2), given, Stream(seed, 2, Purpose.TRACK))
            assert after.alert == switched
