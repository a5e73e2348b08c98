import numpy as np
import pytest

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
    model = colour_model(parameters)

    def log_likelihood(
        states: np.ndarray[tuple[int, int], np.dtype[np.float64]],
    ) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        return chromaticity.log_likelihood(PICTURE, states, model, parameters.background_level)

    dynamics = model_of(state, parameters, (160, 120))
    resample = RESAMPLERS[parameters.resampling]
    if observed == 0:
        return bootstrap.step(
            state.particles,
            dynamics,
            log_likelihood,
            rng,
            resample=resample,
            threshold=parameters.resampling_threshold,
        )
    return auxiliary.step(
        state.particles,
        dynamics,
        log_likelihood,
        rng,
        weights=parameters.apf_weights,
        prediction_count=parameters.sample_count - observed,
        observation_count=observed,
        resample=resample,
    )


@pytest.mark.parametrize("resampling", list(RESAMPLERS))
@pytest.mark.parametrize("weights", ["sharpened", "corrected", "balanced"])
@pytest.mark.parametrize("tracker", ["condensation", "apf", "h-spf", "s-spf"])
def test_the_loop_is_the_filters_put_together(tracker: str, weights: str, resampling: str) -> None:
    """One frame of the compiled loop gives the particles and weights of the filters called one by one, to the bit."""
    parameters = revise(
        BallTrackerParameters(), {"sample_count": 300, "apf_weights": weights, "resampling": resampling}
    )
    for spread in (3.0, 12.0):
        state = begun(parameters, spread)
        observed = {
            "condensation": 0,
            "apf": 300,
            "h-spf": auxiliary.hard(state.sigma, parameters.gamma_px, 300),
            "s-spf": auxiliary.soft(state.sigma, parameters.gamma_min_px, parameters.gamma_max_px, 300),
        }[tracker]
        expected = by_filters(state, parameters, observed, Stream(9, 1, Purpose.TRACK))
        stepped = TRACKERS[tracker].step(
            state, Frame(1, 0.0, image_rgb=PICTURE), parameters, Stream(9, 1, Purpose.TRACK)
        )
        assert np.array_equal(stepped.particles.ancestors, expected.particles.ancestors)
        assert np.array_equal(stepped.particles.states, expected.particles.states)
        assert np.array_equal(stepped.particles.log_weights, expected.particles.log_weights)
        assert stepped.log_evidence == expected.log_evidence
        assert stepped.observation_count == observed


@pytest.mark.parametrize("threshold", [0.0, 0.3, 0.9])
def test_resampling_only_when_it_is_needed_is_the_filters_own(threshold: float) -> None:
    """With a threshold the loop keeps weights where the bootstrap filter does, over several frames."""
    parameters = revise(BallTrackerParameters(), {"sample_count": 200, "resampling_threshold": threshold})
    state = begun(parameters, 5.0)
    particles = state.particles
    decisions = []
    for frame in range(1, 8):
        expected = by_filters(state, parameters, 0, Stream(2, frame, Purpose.TRACK))
        state = TRACKERS["condensation"].step(
            state, Frame(frame, 0.0, image_rgb=PICTURE), parameters, Stream(2, frame, Purpose.TRACK)
        )
        assert np.array_equal(state.particles.log_weights, expected.particles.log_weights)
        assert state.resampled == expected.resampled
        decisions.append(state.resampled)
    assert particles is not None
    assert any(decisions) == (threshold > 0)


def test_the_loop_is_compiled_once() -> None:
    """Values from a person have the loop compiled no second time: in a live session that would take half a minute."""
    for values in ({}, {"gamma_px": 6, "gamma_max_px": 21, "resampling_threshold": 1, "background_level": 0}):
        parameters = (
            revise(BallTrackerParameters(), {"sample_count": 50, **values}) if values else BallTrackerParameters()
        )
        state = begun(parameters, 1.0)
        TRACKERS["h-spf"].step(state, Frame(1, 0.0, image_rgb=PICTURE), parameters, Stream(0, 1, Purpose.TRACK))
    assert len(COLOURED.loop.signatures) == 1
