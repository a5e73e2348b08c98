"""Trackers of a ball: what must be the same is the same, to the bit."""

import numpy as np
import pytest

from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.experiments.ball.model import MODELLED
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
    assert sha("h-spf", gamma_px=1000, **same) == condensation
    assert sha("h-spf", gamma_px=0, **same) == auxiliary
    assert sha("s-spf", gamma_min_px=999, gamma_max_px=1000, **same) == condensation
    assert sha("s-spf", gamma_min_px=0, gamma_max_px=0, **same) == auxiliary


@pytest.mark.parametrize("tracker", MODELLED)
def test_learning_goes_with_every_tracker(tracker: str) -> None:
    """Those with a motion model learn that of a ball in plain sight; its period is within two frames of the truth."""
    from pftrack.filters.learning import online_em

    plain = {"occlusion_width_px": 0, "distracter_radius_px": 0, "amplitude_px": 40, "learn_dynamics": True}
    run = Run(BALL, BALL.simulate(), tracker=tracker, seed=5, frames=240, timeline=(Change(0, plain),))
    learner = run.finish().state.learner
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
        assert np.isfinite([row.estimate for row in run.diagnostics]).all()
        assert np.isfinite([row.sigma for row in run.diagnostics]).all()


def test_a_model_that_knows_the_swing_keeps_what_a_straight_line_loses() -> None:
    """With the true period assumed, prediction alone survives a pillar behind which constant velocity is lost."""
    lost = {}
    for period in (0, 30):
        values = {"occlusion_width_px": 40, "distracter_radius_px": 0, "assumed_period_frames": period}
        run = whole_run(BALL, tracker="condensation", seed=1, frames=61, values=values)
        lost[period] = run.summary().verdict.lost_frames
    assert lost[30] == 0
    assert lost[0] > 15
