"""Trackers of a ball: where it is in the picture does not matter, and of a ball at rest the Kalman filter is known."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, Target
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.ball.model import TRACKERS, BallTrackerParameters
from pftrack.experiments.shared.reports import PointState

WIDTH, HEIGHT, RADIUS = 200, 160, 8
BACKGROUND, RED = (0, 60, 120), (200, 50, 50)
"""Nothing of the background looks like the ball, so that it has no part in the centroid."""
PARAMETERS = revise(BallTrackerParameters(), {"sample_count": 400})
PARTICLES = [name for name in TRACKERS if name != "kalman"]


def picture(*balls: tuple[int, int]) -> NDArray[np.uint8]:
    """Draw red discs on grey."""
    image = np.empty((HEIGHT, WIDTH, 3), np.uint8)
    image[:] = BACKGROUND
    down, across = np.mgrid[:HEIGHT, :WIDTH]
    for x, y in balls:
        image[(across - x) ** 2 + (down - y) ** 2 <= RADIUS**2] = RED
    return image


def course(shift: tuple[int, int] = (0, 0)) -> list[Frame]:
    """A ball that goes to the right, is away for some frames, and is there again beside another."""
    frames = []
    for index in range(14):
        x, y = 50 + 4 * index + shift[0], 60 + shift[1]
        balls = () if 5 <= index < 8 else ((x, y), (x + 20, y + 16))[: 1 + (index > 10)]
        frames.append(Frame(index, index / 30, image_rgb=picture(*balls)))
    return frames


def followed(
    name: str, frames: list[Frame], start: tuple[float, float], parameters: BallTrackerParameters = PARAMETERS
) -> list:
    tracker = TRACKERS[name]
    states = [tracker.start(Target(np.array(start)), frames[0], parameters, Stream(3, 0, Purpose.START))]
    for frame in frames[1:]:
        states.append(tracker.step(states[-1], frame, parameters, Stream(3, frame.index, Purpose.TRACK)))
    return states


@pytest.mark.parametrize("name", TRACKERS)
def test_a_shift_of_the_picture_shifts_everything(name: str) -> None:
    """With the same random numbers the estimates are shifted by as much, and nothing else changes."""
    here, there = followed(name, course(), (50, 60)), followed(name, course((24, 18)), (74, 78))
    assert here[4].estimate == pytest.approx((66, 60), abs=8)
    for one, other in zip(here, there, strict=True):
        assert other.estimate - one.estimate == pytest.approx((24, 18), abs=1e-6)
        assert other.sigma == pytest.approx(one.sigma, abs=1e-6)
        assert other.log_evidence == pytest.approx(one.log_evidence, abs=1e-6)
        measured, expected = (TRACKERS[name].measure(state) for state in (other, one))
        assert measured.keys() == expected.keys()
        assert measured.get("samples") == expected.get("samples")


@pytest.mark.parametrize("name", PARTICLES)
def test_what_is_reported_is_what_the_particles_are(name: str) -> None:
    """ESS, numbers, samplers, mean and deviation follow from the particles of each state but the first."""
    tracker = TRACKERS[name]
    for state in followed(name, course(), (50, 60))[1:]:
        found = tracker.measure(state)
        assert found.keys() == {series.name for series in tracker.series}
        weights = np.exp(state.particles.log_weights)
        assert weights.sum() == pytest.approx(1.0)
        assert found["ess"] == pytest.approx(1 / (weights**2).sum())
        assert found["particles"] == len(weights) == 400
        assert found["unique_ancestors"] == len(np.unique(state.particles.ancestors))
        if "samples" in found:
            assert sum(found["samples"]) == 400  # type: ignore[arg-type] # a vector
        mean = weights @ state.particles.states
        assert state.estimate == pytest.approx(mean[:2], abs=1e-9)
        spread = weights @ (state.particles.states[:, :2] - mean[:2]) ** 2
        assert state.sigma == pytest.approx(np.sqrt(spread), abs=1e-9)


def test_the_sampler_is_the_one_that_the_name_says() -> None:
    """Prediction draws all by prediction, the auxiliary filter all by observation, the switching ones by sigma.

    A switch is reported in the frames whose sampler is another than in the frame before, and there alone.
    """
    states = {name: followed(name, course(), (50, 60)) for name in ("condensation", "pc-pf", "apf", "h-spf", "s-spf")}
    rows = {name: [TRACKERS[name].measure(state) for state in course[1:]] for name, course in states.items()}
    samples = {name: [row["samples"] for row in measured] for name, measured in rows.items()}
    assert set(samples["condensation"]) == set(samples["pc-pf"]) == {(400.0, 0.0)}
    # Where no parent can have given the picture, there is nothing to draw by: the ball is away.
    assert set(samples["apf"][:4]) == {(0.0, 400.0)}
    assert set(samples["h-spf"]) <= {(400.0, 0.0), (0.0, 400.0)}
    assert len(set(samples["s-spf"])) > 2
    changed = [before.alert not in {None, after.alert} for before, after in pairwise(states["h-spf"])]
    assert [row["switched"] for row in rows["h-spf"]] == [float(flag) for flag in changed]
    assert any(changed)


def test_of_a_ball_at_rest_the_kalman_filter_comes_to_the_steady_state() -> None:
    """Its mean comes to the centroid of the disc, its covariance to the solution of the Riccati equation."""
    frames = [Frame(index, index / 30, image_rgb=picture((90, 70))) for index in range(200)]
    state: PointState = followed("kalman", frames, (80, 75))[-1]
    assert state.estimate == pytest.approx((90, 70), abs=1e-3)
    kept, (noise, seen) = (
        PARAMETERS.velocity_retention,
        np.square([PARAMETERS.process_noise_px, PARAMETERS.measurement_noise_px]),
    )
    transition, observation = np.array([[1 + kept, -kept], [1.0, 0.0]]), np.array([[1.0, 0.0]])
    prior = solve_discrete_are(transition.T, observation.T, np.diag([noise, 0.0]), np.array([[seen]]))
    assert state.sigma**2 == pytest.approx(prior[0, 0] * seen / (prior[0, 0] + seen), abs=1e-6)
    assert TRACKERS["kalman"].measure(state)["nis"] == pytest.approx(0, abs=1e-12)


def test_without_the_colour_the_kalman_filter_only_predicts() -> None:
    """It goes on at the velocity that it had, and grows as unsure as the motion is."""
    states = followed("kalman", course()[:8], (50, 60), revise(PARAMETERS, {"velocity_retention": 1.0}))
    seen, away = states[4], states[5:8]
    velocity = seen.posterior.mean[:2] - seen.posterior.mean[2:]
    assert velocity[0] > 1
    for frames, state in enumerate(away, 1):
        assert state.estimate == pytest.approx(seen.estimate + frames * velocity)
        assert state.log_evidence == 0.0
    assert np.all(np.diff([state.sigma[0] for state in (seen, *away)]) > 0)
