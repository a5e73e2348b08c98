"""The compiled loop of a ball is its filters put together."""

from typing import Any

import numpy as np
import pytest

from pftrack.core.arrays import Floats
from pftrack.core.geometry import paint_disc
from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, Target
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.ball.model import COLOURED, TRACKERS, BallTrackerParameters, colour_model
from pftrack.experiments.ball.model import dynamics_of as model_of
from pftrack.experiments.shared.reports import PointState
from pftrack.filters import auxiliary, bootstrap
from pftrack.filters.particles import Posterior
from pftrack.filters.resampling import RESAMPLERS
from pftrack.vision.likelihoods import chromaticity

PICTURE = np.full((120, 160, 3), 100, np.uint8)
paint_disc(PICTURE, 80.0, 60.0, 6.0, (200, 50, 50))
paint_disc(PICTURE, 110.0, 40.0, 8.0, (200, 50, 50))


def begun(parameters: BallTrackerParameters, spread: float) -> PointState:
    wide = revise(parameters, {"initial_sd_px": spread})
    target = Target(np.array([78.0, 61.0]), 12.0)
    return TRACKERS["h-spf"].start(target, Frame(0, 0.0, image_rgb=PICTURE), wide, Stream(1, 0, Purpose.START))


def by_filters(state: PointState, parameters: BallTrackerParameters, observed: int, rng: Stream) -> Posterior:
    assert state.particles is not None
    colours, dynamics = colour_model(parameters), model_of(state, parameters, (160, 120))
    resample = RESAMPLERS[parameters.resampling]

    def weigh(states: Floats) -> Floats:
        return chromaticity.log_likelihood(PICTURE, states, colours, parameters.background_level)

    if observed == 0:
        return bootstrap.step(state.particles, dynamics, weigh, rng, resample=resample)
    return auxiliary.step(
        state.particles,
        dynamics,
        weigh,
        rng,
        weights=parameters.apf_weights,
        prediction_count=parameters.sample_count - observed,
        observation_count=observed,
        resample=resample,
    )


def stepped(tracker: str, state: PointState, parameters: BallTrackerParameters, rng: Stream) -> Any:
    return TRACKERS[tracker].step(state, Frame(rng.frame, 0.0, image_rgb=PICTURE), parameters, rng)


@pytest.mark.parametrize("resampling", list(RESAMPLERS))
@pytest.mark.parametrize("weights", ["sharpened", "corrected", "balanced"])
@pytest.mark.parametrize("tracker", ["condensation", "apf", "h-spf", "s-spf"])
def test_the_loop_is_the_filters_put_together(tracker: str, weights: str, resampling: str) -> None:
    """One frame of the compiled loop gives the particles and weights of the filters called one by one, to the bit."""
    values = {"sample_count": 300, "apf_weights": weights, "resampling": resampling}
    parameters = revise(BallTrackerParameters(), values)
    for spread in (3.0, 12.0):
        state = begun(parameters, spread)
        observed = {
            "condensation": 0,
            "apf": 300,
            "h-spf": auxiliary.hard(state.sigma, parameters.gamma_px, 300),
            "s-spf": auxiliary.soft(state.sigma, parameters.gamma_min_px, parameters.gamma_max_px, 300),
        }[tracker]
        expected = by_filters(state, parameters, observed, Stream(9, 1, Purpose.TRACK))
        after = stepped(tracker, state, parameters, Stream(9, 1, Purpose.TRACK))
        for name in ("ancestors", "states", "log_weights"):
            assert np.array_equal(getattr(after.particles, name), getattr(expected.particles, name))
        assert (after.log_evidence, after.observation_count) == (expected.log_evidence, observed)


def test_the_loop_is_compiled_once() -> None:
    """Values as a person types them do not compile it again, which would stop a live session for half a minute."""
    typed = {"sample_count": 50, "gamma_px": 6, "gamma_max_px": 21, "resampling_threshold": 1, "background_level": 0}
    for parameters in (BallTrackerParameters(), revise(BallTrackerParameters(), typed)):
        stepped("h-spf", begun(parameters, 1.0), parameters, Stream(0, 1, Purpose.TRACK))
    assert len(COLOURED.loop.signatures) == 1
