"""Examples: for every experiment a sweep that is worth starting as it stands, filled into the form at first."""

from typing import Any

from pftrack.experiments.experiment import Experiment
from pftrack.parameters import Declaration, declarations
from server.sweeps.wishes import AxisWish, SweepWish

__all__ = ["example"]

STEPS = 5

EXAMPLES: dict[str, dict[str, Any]] = {
    # The coarse map of the document: 25 cells, 60 frames.
    "ball": {
        "axes": [
            {"name": "occlusion_width_px", "values": [5, 30, 55, 80, 100]},
            {"name": "distracter_radius_px", "values": [1, 6, 11, 16, 20]},
        ],
        "trackers": ["h-spf", "s-spf", "pc-pf"],
        "trials": 20,
        "frames": 60,
    },
    "sine": {
        "axes": [
            {"name": "sample_count", "values": [10, 30, 100, 300, 1000]},
            {"name": "dimension", "start": 1, "stop": 5, "step": 1},
        ],
        "trackers": ["condensation", "kalman"],
        "trials": 10,
        "frames": 120,
    },
}


def example(experiment: Experiment) -> SweepWish:
    """Return a filled-in wish for an experiment; of one that has none of its own, its first two numbers are varied."""
    known = EXAMPLES.get(experiment.id)
    if known is not None:
        return SweepWish(experiment=experiment.id, **known)
    every = declarations(type(experiment.simulate().parameters))
    numbers = [it for it in every if it.kind in {"integer", "number"} and it.minimum is not None]
    return SweepWish(
        experiment=experiment.id,
        axes=[_around(it) for it in numbers[:2]],
        trackers=list(experiment.trackers)[:3],
        trials=5,
        frames=min(experiment.frames, 60),
    )


def _around(declaration: Declaration) -> AxisWish:
    """Return an axis around a number's default, within its bounds."""
    step = declaration.step or 1.0
    low, high = declaration.minimum or 0.0, declaration.maximum or 1.0
    middle = float(declaration.default)
    start = max(low, middle - STEPS // 2 * step)
    return AxisWish(name=declaration.name, start=start, stop=min(high, start + (STEPS - 1) * step), step=step)
