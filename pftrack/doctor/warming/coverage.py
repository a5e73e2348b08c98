"""Which runs call everything that an experiment compiles: trackers, presets, and choices and switches of parameters.

Otherwise a class would wait for the compiler in the moment in which somebody first turns to the pinhole camera.
"""

from collections.abc import Iterator, Mapping

from pftrack.core.model.drawing import Drawing
from pftrack.core.model.parameters import Value, declarations
from pftrack.core.model.recipe import Change
from pftrack.experiments.experiment import Experiment
from pftrack.runs.run import Run


def cases(experiment: Experiment) -> Iterator[tuple[str, dict[str, Value]]]:
    """Yield each tracker with the defaults, the default one first, then choices with who reads them, then presets."""
    first = experiment.default_tracker
    yield first, {}
    yield from ((tracker, {}) for tracker in experiment.trackers if tracker != first)
    for item in declarations(type(experiment.simulate().parameters)):
        others: tuple[Value, ...] = item.choices if item.kind == "choice" else ()
        if item.kind == "boolean":
            others = (not item.default,)
        for value in others:
            if value != item.default:
                yield (item.trackers[0] if item.trackers else experiment.default_tracker), {item.name: value}
    # A choice may matter only beside another one.
    yield from (
        (preset.tracker, dict(preset.parameters)) for preset in experiment.presets if len(preset.parameters) > 1
    )


def run_case(experiment: Experiment, tracker: str, values: Mapping[str, Value]) -> Drawing:
    """Compute as many frames as call all that later ones do, and return the last drawing."""
    timeline = (Change(0, dict(values)),) if values else ()
    frames = experiment.warm_frames
    run = Run(experiment, experiment.simulate(), tracker=tracker, frames=frames, timeline=timeline)
    run.finish()
    return experiment.draw(run.current, run.diagnostics)
