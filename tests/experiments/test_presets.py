import pytest

from pftrack.experiments import Experiment, Preset, find
from pftrack.runs.run import Change, Run

BALL = find("ball")


@pytest.mark.parametrize("preset", BALL.presets, ids=lambda preset: preset.name)
def test_presets_of_the_ball_do_what_they_say(preset: Preset) -> None:
    """A preset that is said to work succeeds, one that is said to break fails."""
    timeline = (Change(0, preset.parameters),)
    run = Run(BALL, BALL.simulate(), tracker=preset.tracker, seed=preset.seed, timeline=timeline)
    run.finish()
    assert run.summary().verdict.success == preset.title.startswith("works")


PRISM, HEAD = find("prism"), find("head")


@pytest.mark.parametrize(
    ("experiment", "preset"),
    [
        *(pytest.param(PRISM, preset, id=f"prism-{preset.name}") for preset in PRISM.presets),
        *(pytest.param(HEAD, preset, id=f"head-{preset.name}", marks=pytest.mark.slow) for preset in HEAD.presets),
    ],
)
def test_presets_of_the_poses_do_what_they_say(experiment: Experiment, preset: Preset) -> None:
    """What works ends in success, what breaks does not, and what is worse has a larger error than what works."""
    best, _ = finished(experiment, experiment.presets[0].name)
    error, success = finished(experiment, preset.name)
    if preset.title.startswith("worse"):
        assert error > 1.05 * best
    else:
        assert success == preset.title.startswith("works")


_known: dict[tuple[str, str], tuple[float, bool]] = {}


def finished(experiment: Experiment, name: str) -> tuple[float, bool]:
    if (experiment.id, name) not in _known:
        preset = next(preset for preset in experiment.presets if preset.name == name)
        _known[experiment.id, name] = outcome(experiment, preset)
    return _known[experiment.id, name]


def outcome(experiment: Experiment, preset: Preset) -> tuple[float, bool]:
    timeline = (Change(0, preset.parameters),) if preset.parameters else ()
    run = Run(experiment, experiment.simulate(), tracker=preset.tracker, seed=preset.seed, timeline=timeline)
    run.finish()
    summary = run.summary().as_dict()
    return summary["mean_error"], summary["success"]


def test_presets_of_the_signal_do_what_they_say() -> None:
    """With a thousand particles the error is near the exact one, with ten or in five dimensions it is not."""
    sine = find("sine")
    errors = {}
    for preset in sine.presets:
        run = Run(sine, sine.simulate(), tracker=preset.tracker, timeline=(Change(0, preset.parameters),))
        run.finish()
        errors[preset.name] = run.summary().verdict.mean_error
    assert errors["works"] < 1.25 * errors["kalman"]
    assert errors["few"] > 1.25 * errors["kalman"]
    assert errors["dimensions"] > 1.25 * errors["kalman"]
