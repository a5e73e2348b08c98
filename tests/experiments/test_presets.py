"""Presets do what their titles say, and name what to watch."""

from functools import cache

import pytest

from pftrack.core.model.parameters import declarations, flat
from pftrack.core.model.preset import Preset
from pftrack.experiments import EXPERIMENTS, find
from pftrack.experiments.experiment import Experiment
from tests.making import whole_run

BALL = find("ball")


@pytest.mark.parametrize("experiment", EXPERIMENTS.values(), ids=lambda experiment: experiment.id)
def test_presets_have_a_sentence_and_values_within_range(experiment: Experiment) -> None:
    """Each preset has a plain sentence and at most five subjects, as many as a narrow panel can show.

    Every value of a preset, a failure, its cure and the example sweep lies within the slider's range.
    """
    for preset in experiment.presets:
        assert preset.watch.startswith("Watch "), preset.name
        assert not set("*`_") & set(preset.watch), f"{preset.name}: it is shown as it stands"
        assert 0 < len(preset.subjects) <= 5, preset.name
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


def test_a_run_is_recognised_as_its_preset() -> None:
    """Tracker, seed and all parameters must be the preset's; the subjects of other runs are those of all presets."""
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
"""One preset of a window of each kind; each takes a second."""


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
    """One that works ends in success, one that breaks does not, and one that is worse has a larger error."""
    error, success = outcome(experiment.id, preset.name)
    if preset.title.startswith("worse"):
        assert error > 1.05 * outcome(experiment.id, experiment.presets[0].name)[0]
    else:
        assert success == preset.title.startswith("works")


@cache
def outcome(experiment: str, name: str) -> tuple[float, bool]:
    preset = find(experiment).preset_named(name)
    frames = 250 if experiment == "prism" and not preset.title.startswith("breaks") else None
    options = {"tracker": preset.tracker, "seed": preset.seed, "frames": frames}
    verdict = whole_run(find(experiment), values=preset.parameters, **options).summary().verdict
    return verdict.mean_error, verdict.success


def test_presets_of_the_signal_do_what_they_say() -> None:
    """With a thousand particles the error is close to the exact one, with ten or in five dimensions it is not."""
    works, few, dimensions, exact = (outcome("sine", name)[0] for name in ("works", "few", "dimensions", "kalman"))
    assert works < 1.25 * exact < min(few, dimensions)


FISH = find("fish")


@pytest.mark.parametrize("preset", FISH.presets, ids=lambda preset: preset.name)
def test_presets_of_the_fish_do_what_they_say(preset: Preset) -> None:
    """The estimate of one that works stays inside the fish, unlike that of one that breaks; worse ones turn round."""
    frames = 48 if preset.name == "rudder" else 32  # all that a sentence speaks of has happened by then
    run = whole_run(FISH, tracker=preset.tracker, seed=preset.seed, frames=frames, values=preset.parameters)
    turned = max(row.number("heading_error") for row in run.diagnostics) > 150
    assert turned == preset.title.startswith("worse")
    assert run.summary().verdict.success == (not preset.title.startswith("breaks"))
