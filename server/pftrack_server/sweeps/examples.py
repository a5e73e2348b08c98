"""Examples: for every experiment a sweep that is worth starting as it stands, filled into the form at first."""

from pftrack.core.model.parameters import Declaration, declarations
from pftrack.experiments.experiment import Experiment
from pftrack_server.schemas.sweeps import SweepAxis, SweepCreate

STEPS = 5


def example(experiment: Experiment) -> SweepCreate:
    """Return a filled-in body for an experiment; of one that has no example, its first two numbers are varied."""
    known = experiment.example_sweep
    if known is not None:
        return SweepCreate(
            experiment=experiment.id,
            axes=[SweepAxis(name=name, values=list(values)) for name, values in known.axes.items()],
            trackers=list(known.trackers),
            trials=known.trials,
            frames=known.frames,
        )
    every = declarations(type(experiment.simulate().parameters))
    numbers = [it for it in every if it.kind in {"integer", "number"} and it.useful]
    return SweepCreate(
        experiment=experiment.id,
        axes=[_around(it) for it in numbers[:2]],
        trackers=list(experiment.trackers)[:3],
        trials=5,
        frames=min(experiment.frames, 60),
    )


def _around(declaration: Declaration) -> SweepAxis:
    """Return an axis around a number's default, within its useful range."""
    step = declaration.step or 1.0
    low, high = declaration.useful or (0.0, 1.0)
    middle = float(declaration.default)
    start = max(low, middle - STEPS // 2 * step)
    return SweepAxis(name=declaration.name, start=start, stop=min(high, start + (STEPS - 1) * step), step=step)
