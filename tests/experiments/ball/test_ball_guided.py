import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.source import Frame
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.ball.model import GUIDANCE, TRACKERS, BallTrackerParameters
from pftrack.experiments.shared.reports import PointState
from pftrack.filters.learning.diffusion import learn
from pftrack.filters.particles import ParticleSet
from tests.making import whole_run

BALL = find("ball")
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
    assert isinstance(after, PointState)
    assert after.particles is not None
    return after.particles.states


def test_particles_spread_as_was_learned() -> None:
    """Where the picture says nothing, places spread about the prediction with the learned covariance."""
    states = drawn((3.0, -2.0))
    assert states[:, :2].mean(axis=0) == pytest.approx([53, 38], abs=0.1)
    assert np.cov(states[:, :2].T) == pytest.approx(LEARNED.diffusion("fixed").covariance, rel=0.05)
    assert (states[:, 2:] == [50.0, 40.0]).all()


def test_width_and_correlation_can_be_turned() -> None:
    """The width multiplies all standard deviations; without correlations each axis keeps its own."""
    narrow = np.cov(drawn((0.0, 0.0), diffusion_scale=0.5)[:, :2].T)
    assert narrow == pytest.approx(0.25 * LEARNED.diffusion("fixed").covariance, rel=0.05)
    alone = np.cov(drawn((0.0, 0.0), correlated_changes=False)[:, :2].T)
    assert alone == pytest.approx(np.diag(np.diagonal(LEARNED.diffusion("fixed").covariance)), rel=0.05, abs=0.1)


def test_the_frame_may_turn_with_the_motion() -> None:
    """In the frame of the motion a ball that moves down spreads down the picture by what was learned along it."""
    learned = LEARNED.diffusion("motion").covariance
    states = drawn((0.0, 5.0), guided_frame="motion")
    assert np.var(states[:, 1]) == pytest.approx(learned[0, 0], rel=0.05)
    assert np.var(states[:, 0]) == pytest.approx(learned[1, 1], rel=0.05)


def test_few_guided_particles_follow_where_many_others_do_not() -> None:
    """Without a pillar 300 guided particles hold the swinging ball, and 1000 of Condensation lose it."""

    def lost(tracker: str, count: int) -> int:
        values = {"occlusion_width_px": 0, "sample_count": count}
        run = whole_run(BALL, tracker=tracker, frames=90, values=values)
        return sum(bool(row.lost) for row in run.diagnostics)

    assert lost("guided", 300) < 5
    assert lost("condensation", 1000) > 20
