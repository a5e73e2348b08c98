"""Presets do what they say, and say what to look at."""

from functools import cache

import pytest

from pftrack.core.model.parameters import declarations, flat
from pftrack.core.model.preset import Preset
from pftrack.experiments import EXPERIMENTS, find
from pftrack.experiments.experiment import Experiment
from tests.making import whole_run

BALL = find("ball")


@pytest.mark.parametrize("experiment", EXPERIMENTS.values(), ids=lambda experiment: experiment.id)
def test_presets_say_what_to_look_at_and_what_they_are_about(experiment: Experiment) -> None:
    """Each of the project's own has a sentence, and few parameters, so that a narrow panel can show them."""
    for preset in experiment.presets:
        assert preset.watch.startswith("Watch "), preset.name
        assert not set("*`_") & set(preset.watch), f"{preset.name}: it is shown as it stands"
        assert 0 < len(preset.subjects) <= 5, preset.name


@pytest.mark.parametrize("experiment", EXPERIMENTS.values(), ids=lambda experiment: experiment.id)
def test_a_slider_reaches_what_presets_and_failures_set(experiment: Experiment) -> None:
    """Every value of a preset, a failure, its cure and the example sweep lies within the useful range."""
    known = {declared.name: declared for declared in declarations(type(experiment.simulate().parameters))}
    settings = [preset.parameters for preset in experiment.presets]
    for failure in experiment.failures:
        settings += [failure.parameters, failure.cure.values, *(change.values for change in failure.timeline)]
    if experiment.example_sweep is not None:
        settings += [{name: value} for name, values in experiment.example_sweep.axes.items() for value in values]
    for name, value in (item for values in settings for item in values.items()):
        useful = known[name].useful if name in known else None
        if useful is not None:
            assert useful[0] <= float(value) <= useful[1], f"{name} = {value}"


def test_a_run_that_begins_as_a_preset_is_told_from_others() -> None:
    """Tracker, seed and all parameters have to be the preset's; any other run is about what presets set."""
    defaults = flat(BALL.simulate().parameters)
    for preset in BALL.presets:
        values = {**defaults, **preset.parameters}
        assert BALL.preset_of(preset.tracker, preset.seed, values, defaults) is preset
        assert BALL.preset_of(preset.tracker, preset.seed + 1, values, defaults) is None
    assert BALL.preset_of("h-spf", 0, {**defaults, "sample_count": 41}, defaults) is None
    general = ("occlusion_width_px", "distracter_radius_px", "sample_count", "ball_path", "period_s")
    assert BALL.subjects(None) == general


PRISM, HEAD, HISTOGRAM = find("prism"), find("head"), find("histogram")

SLOW = pytest.mark.slow
QUICK = {
    next(it.name for it in HISTOGRAM.presets if it.title.startswith(word)) for word in ("works", "worse", "breaks")
}
"""One of each kind of a window's presets, of which each takes a second."""


@pytest.mark.parametrize(
    ("experiment", "preset"),
    [
        *(pytest.param(it, preset, id=f"{it.id}-{preset.name}") for it in (BALL, PRISM) for preset in it.presets),
        *(
            pytest.param(HISTOGRAM, it, id=f"histogram-{it.name}", marks=[SLOW] * (it.name not in QUICK))
            for it in HISTOGRAM.presets
        ),
        *(pytest.param(HEAD, preset, id=f"head-{preset.name}", marks=SLOW) for preset in HEAD.presets),
    ],
)
def test_presets_of_balls_poses_and_windows_do_what_they_say(experiment: Experiment, preset: Preset) -> None:
    """What works ends in success, what breaks does not, and what is worse has a larger error than what works."""
    error, success = outcome(experiment.id, preset.name)
    if preset.title.startswith("worse"):
        assert error > 1.05 * outcome(experiment.id, experiment.presets[0].name)[0]
    else:
        assert success == preset.title.startswith("works")


@cache
def outcome(experiment: str, name: str) -> tuple[float, bool]:
    preset = find(experiment).preset_named(name)
    run = whole_run(find(experiment), values=preset.parameters, tracker=preset.tracker, seed=preset.seed)
    verdict = run.summary().verdict
    return verdict.mean_error, verdict.success


def test_presets_of_the_signal_do_what_they_say() -> None:
    """With a thousand particles the error is near the exact one, with ten or in five dimensions it is not."""
    works, few, dimensions, exact = (outcome("sine", name)[0] for name in ("works", "few", "dimensions", "kalman"))
    assert works < 1.25 * exact < min(few, dimensions)


FISH = find("fish")


@pytest.mark.parametrize("preset", FISH.presets, ids=lambda preset: preset.name)
def test_presets_of_the_fish_do_what_they_say(preset: Preset) -> None:
    """What works is inside the fish in every frame, what breaks is not, and what is worse turns head to tail."""
    run = whole_run(FISH, tracker=preset.tracker, seed=preset.seed, frames=48, values=preset.parameters)
    turned = max(row.number("heading_error") for row in run.diagnostics) > 150
    assert turned == preset.title.startswith("worse")
    assert run.summary().verdict.success == (not preset.title.startswith("breaks"))
