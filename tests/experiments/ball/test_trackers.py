"""Trackers of a ball: what must be the same is the same, to the bit."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.recipe import Change
from pftrack.core.model.source import Frame
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.ball.model import GUIDANCE, MODELLED, TRACKERS, BallTrackerParameters
from pftrack.experiments.shared.reports import PointState
from pftrack.filters.learning import online_em
from pftrack.filters.learning.diffusion import learn
from pftrack.filters.particles import ParticleSet
from pftrack.runs.run import Run
from tests.making import whole_run

BALL = find("ball")


def sha(tracker: str, **parameters: object) -> str:
    run = whole_run(BALL, tracker=tracker, seed=5, frames=60, values=parameters)
    return run.estimates_sha256


@pytest.mark.parametrize("rule", ["sharpened", "corrected", "balanced"])
@pytest.mark.parametrize("resampling", ["systematic", "residual"])
def test_switching_filters_at_their_limits(rule: str, resampling: str) -> None:
    """With thresholds out of reach they are Condensation, with thresholds of zero the auxiliary filter."""
    same = {"apf_weights": rule, "resampling": resampling}
    condensation, auxiliary = sha("condensation", **same), sha("apf", **same)
    assert condensation != auxiliary
    for threshold, expected in ((1000, condensation), (0, auxiliary)):
        assert sha("h-spf", gamma_px=threshold, **same) == expected
        assert sha("s-spf", gamma_min_px=threshold, gamma_max_px=threshold, **same) == expected


@pytest.mark.parametrize("tracker", MODELLED)
def test_learning_goes_with_every_tracker(tracker: str) -> None:
    """Those with a motion model learn that of a ball in plain sight; its period is within two frames of the truth."""
    plain = {"occlusion_width_px": 0, "distracter_radius_px": 0, "amplitude_px": 40, "learn_dynamics": True}
    learner = whole_run(BALL, tracker=tracker, seed=5, frames=240, values=plain).current.state.learner
    assert online_em.period_frames(online_em.dynamics(learner, np.zeros((2, 2)))) == pytest.approx(30, abs=2)


def test_learning_can_be_switched_on_and_off() -> None:
    """Switched on in mid-run it begins there, switched off it is forgotten."""
    timeline = (Change(10, {"learn_dynamics": True}), Change(40, {"learn_dynamics": False}))
    run = Run(BALL, BALL.simulate(), tracker="h-spf", seed=5, frames=60, timeline=timeline)
    learners = [step.state.learner for step in run]
    assert [learner is not None for learner in learners] == [10 <= frame < 40 for frame in range(60)]
    assert learners[39].frames == 30


@pytest.mark.parametrize("tracker", BALL.trackers)
def test_extreme_parameters_do_no_harm(tracker: str) -> None:
    """One particle, no background level, a picture without the colour: a finite estimate each time."""
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


@pytest.mark.parametrize(("period", "least", "most"), [(0, 16, 61), (30, 0, 0)])
def test_a_model_that_knows_the_swing_keeps_what_a_straight_line_loses(period: int, least: int, most: int) -> None:
    """With the true period assumed, prediction alone survives a pillar behind which constant velocity is lost."""
    values = {"occlusion_width_px": 40, "distracter_radius_px": 0, "assumed_period_frames": period}
    run = whole_run(BALL, tracker="condensation", seed=1, frames=61, values=values)
    assert least <= run.summary().verdict.lost_frames <= most


COVARIANCE = np.array([[9.0, 1.5], [1.5, 1.0]])


def wandering(seed: int = 0) -> NDArray[np.float64]:
    """A track whose accelerations have the covariance above."""
    normals = np.random.default_rng(seed).standard_normal((4000, 2))
    return np.cumsum(np.cumsum(normals @ np.linalg.cholesky(COVARIANCE).T, axis=0), axis=0)


LEARNED = learn([wandering()], GUIDANCE.chart, "ball")


def drawn(velocity: tuple[float, float], **values: Value) -> NDArray[np.float64]:
    """Particles (N, 4) a frame after all were at one place with one velocity, of a picture that says nothing."""
    parameters = revise(BallTrackerParameters(), {"sample_count": 20_000, "learned": LEARNED.text, **values})
    state = np.array([50.0, 40.0, 50.0 - velocity[0], 40.0 - velocity[1]])
    particles = ParticleSet.uniform(np.tile(state, (20_000, 1)))
    before = PointState(Gaussian(state, np.eye(4)), 2, particles)
    night = Frame(1, 0.0, image_rgb=np.zeros((80, 100, 3), np.uint8))
    after = TRACKERS["guided"].step(before, night, parameters, Stream(0, 1, Purpose.TRACK))
    return after.particles.states


def test_particles_spread_as_was_learned() -> None:
    """Where the picture says nothing, places spread about the prediction with the learned covariance.

    The width multiplies all standard deviations; without correlations each axis keeps its own.
    """
    states, learned = drawn((3.0, -2.0)), LEARNED.diffusion("fixed").covariance
    assert states[:, :2].mean(axis=0) == pytest.approx([53, 38], abs=0.1)
    assert np.cov(states[:, :2].T) == pytest.approx(learned, rel=0.05)
    assert (states[:, 2:] == [50.0, 40.0]).all()
    assert np.cov(drawn((0.0, 0.0), diffusion_scale=0.5)[:, :2].T) == pytest.approx(0.25 * learned, rel=0.05)
    alone = np.cov(drawn((0.0, 0.0), correlated_changes=False)[:, :2].T)
    assert alone == pytest.approx(np.diag(np.diagonal(learned)), rel=0.05, abs=0.1)


def test_the_frame_may_turn_with_the_motion() -> None:
    """In the frame of the motion a ball that moves down spreads down the picture by what was learned along it."""
    along, across = LEARNED.diffusion("motion").covariance.diagonal()
    states = drawn((0.0, 5.0), guided_frame="motion")
    assert states[:, :2].var(axis=0) == pytest.approx([across, along], rel=0.05)


@pytest.mark.parametrize(("tracker", "count", "least", "most"), [("guided", 300, 0, 4), ("condensation", 1000, 21, 90)])
def test_few_guided_particles_follow_where_many_others_do_not(tracker: str, count: int, least: int, most: int) -> None:
    """Without a pillar 300 guided particles hold the swinging ball, and 1000 of Condensation lose it."""
    values = {"occlusion_width_px": 0, "sample_count": count}
    run = whole_run(BALL, tracker=tracker, frames=90, values=values)
    assert least <= sum(bool(row.lost) for row in run.diagnostics) <= most
