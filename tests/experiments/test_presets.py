import pytest

from pftrack.experiments import Preset, find
from pftrack.run import Change, Run

BALL = find("ball")


@pytest.mark.parametrize("preset", BALL.presets, ids=lambda preset: preset.name)
def test_presets_of_the_ball_do_what_they_say(preset: Preset) -> None:
    """A preset that is said to work succeeds, one that is said to break fails."""
    timeline = (Change(0, preset.parameters),)
    run = Run(BALL, BALL.simulate(), tracker=preset.tracker, seed=preset.seed, timeline=timeline)
    run.finish()
    assert run.summary()["success"] == preset.title.startswith("works")


def test_presets_of_the_signal_do_what_they_say() -> None:
    """With a thousand particles the error is near the exact one, with ten or in five dimensions it is not."""
    sine = find("sine")
    errors = {}
    for preset in sine.presets:
        run = Run(sine, sine.simulate(), tracker=preset.tracker, timeline=(Change(0, preset.parameters),))
        run.finish()
        errors[preset.name] = run.summary()["mean_error"]
    assert errors["works"] < 1.25 * errors["kalman"]
    assert errors["few"] > 1.25 * errors["kalman"]
    assert errors["dimensions"] > 1.25 * errors["kalman"]
