"""Whole runs of the ball's trackers: learned motion, extreme parameters and guided particles."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.recipe import Change
from pftrack.core.model.source import Frame
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.ball.model import GUIDANCE, TRACKERS, BallTrackerParameters
from pftrack.experiments.shared.reports import PointState
from pftrack.filters.learning import online_em
from pftrack.filters.learning.diffusion import learn
from pftrack.filters.particles import ParticleSet
from pftrack.runs.run import Run
from tests.making import whole_run

BALL = find("ball")


def test_the_period_is_learned() -> None:
    """The learned motion of a visible ball has its period to two frames."""
    plain = {"occlusion_width_px": 0, "distracter_radius_px": 0, "amplitude_px": 40, "learn_dynamics": True}
    learner = whole_run(BALL, tracker="h-spf", seed=5, frames=240, values=plain).current.state.learner
    assert online_em.period_frames(online_em.dynamics(learner, np.zeros((2, 2)))) == pytest.approx(30, abs=2)


def test_learning_can_be_switched_on_and_off() -> None:
    """Learning begins in the frame that switches it on; switching it off discards the learned model."""
    timeline = (Change(10, {"learn_dynamics": True}), Change(40, {"learn_dynamics": False}))
    run = Run(BALL, BALL.simulate(), tracker="h-spf", seed=5, frames=60, timeline=timeline)
    learners = [step.state.learner for step in run]
    assert [learner is not None for learner in learners] == [10 <= frame < 40 for frame in range(60)]
    assert learners[39].frames == 30


@pytest.mark.parametrize("tracker", BALL.trackers)
def test_extreme_parameters_give_finite_estimates(tracker: str) -> None:
    """These include one particle, no background level and a picture without the colour."""
    for parameters in (
        {"sample_count": 1},
        {"background_level": 0.0, "occlusion_width_px": 640},
        {"background_level": 0.0, "ball_colour": "#000000", "background_colour": "#000000"},
        {"process_noise_px": 200, "initial_sd_px": 200, "gamma_px": 0},
        {"ball_radius_px": 60, "image_noise_sd": 100, "red_spread": 0.001},
        {"resampling_threshold": 0.0, "background_level": 0.0},
    ):
        run = whole_run(BALL, tracker=tracker, seed=5, frames=12, values=parameters)
        assert np.isfinite([row.estimate + row.sigma for row in run.diagnostics]).all()


def test_the_assumed_period_keeps_a_ball_behind_a_pillar() -> None:
    """Condensation holds the ball with the true period, and loses it with constant velocity."""
    lost = []
    for period in (30, 0):
        values = {"occlusion_width_px": 40, "distracter_radius_px": 0, "assumed_period_frames": period}
        run = whole_run(BALL, tracker="condensation", seed=1, frames=61, values=values)
        lost.append(run.summary().verdict.lost_frames)
    assert lost[0] == 0
    assert lost[1] >= 16


COVARIANCE = np.array([[9.0, 1.5], [1.5, 1.0]])
ACCELERATIONS = np.random.default_rng(0).standard_normal((4000, 2)) @ np.linalg.cholesky(COVARIANCE).T
LEARNED = learn([ACCELERATIONS.cumsum(axis=0).cumsum(axis=0)], GUIDANCE.chart, "ball")


def drawn(velocity: tuple[float, float], **values: Value) -> NDArray[np.float64]:
    """Return particles (N, 4) after a black frame; before, all were at one place with one velocity."""
    parameters = revise(BallTrackerParameters(), {"sample_count": 20_000, "learned": LEARNED.text, **values})
    state = np.array([50.0, 40.0, 50.0 - velocity[0], 40.0 - velocity[1]])
    particles = ParticleSet.uniform(np.tile(state, (20_000, 1)))
    before = PointState(Gaussian(state, np.eye(4)), 2, particles)
    night = Frame(1, 0.0, image_rgb=np.zeros((80, 100, 3), np.uint8))
    after = TRACKERS["guided"].step(before, night, parameters, Stream(0, 1, Purpose.TRACK))
    return after.particles.states


def test_particles_spread_by_the_learned_covariance() -> None:
    """In a black picture they spread about the prediction with the learned covariance.

    The width multiplies all standard deviations; without correlations each axis keeps its own. In the frame of the
    motion a ball that moves down spreads down by the deviation learned along the motion.
    """
    states, learned = drawn((3.0, -2.0)), LEARNED.diffusion("fixed").covariance
    assert states[:, :2].mean(axis=0) == pytest.approx([53, 38], abs=0.1)
    assert np.cov(states[:, :2].T) == pytest.approx(learned, rel=0.05)
    assert (states[:, 2:] == [50.0, 40.0]).all()
    assert np.cov(drawn((0.0, 0.0), diffusion_scale=0.5)[:, :2].T) == pytest.approx(0.25 * learned, rel=0.05)
    alone = np.cov(drawn((0.0, 0.0), correlated_changes=False)[:, :2].T)
    assert alone == pytest.approx(np.diag(np.diagonal(learned)), rel=0.05, abs=0.1)
    along, across = LEARNED.diffusion("motion").covariance.diagonal()
    states = drawn((0.0, 5.0), guided_frame="motion")
    assert states[:, :2].var(axis=0) == pytest.approx([across, along], rel=0.05)
