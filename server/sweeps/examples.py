"""Examples: for every experiment a sweep that is worth starting as it stands, filled into the form at first."""

from typing import Any

from pftrack.experiment import Experiment
from pftrack.parameters import Declaration, declarations
from server.schemas.sweeps import SweepAxis, SweepCreate

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
    # Where the affine camera's error and the corners' noise decide which prediction is worth more.
    "prism": {
        "axes": [
            {"name": "distance_mm", "values": [70, 80, 100, 150, 300]},
            {"name": "noise_px", "values": [1, 3, 10, 20, 40]},
        ],
        "trackers": ["pf-asd", "alpha-1", "alpha-0"],
        "trials": 5,
        "frames": 200,
    },
    # How fast may the driver turn, with how few particles?
    "head": {
        "axes": [
            {"name": "speed", "values": [0.5, 1, 2, 3, 4]},
            {"name": "sample_count", "values": [10, 20, 50, 200]},
        ],
        "trackers": ["pf-asd", "alpha-1", "alpha-0"],
        "trials": 2,
        "frames": 200,
    },
}


def example(experiment: Experiment) -> SweepCreate:
    """Return a filled-in body for an experiment; of one that has none of its own, its first two numbers are varied."""
    known = EXAMPLES.get(experiment.id)
    if known is not None:
        return SweepCreate(experiment=experiment.id, **known)
    every = declarations(type(experiment.simulate().parameters))
    numbers = [it for it in every if it.kind in {"integer", "number"} and it.minimum is not None]
    return SweepCreate(
        experiment=experiment.id,
        axes=[_around(it) for it in numbers[:2]],
        trackers=list(experiment.trackers)[:3],
        trials=5,
        frames=min(experiment.frames, 60),
    )


def _around(declaration: Declaration) -> SweepAxis:
    """Return an axis around a number's default, within its bounds."""
    step = declaration.step or 1.0
    low, high = declaration.minimum or 0.0, declaration.maximum or 1.0
    middle = float(declaration.default)
    start = max(low, middle - STEPS // 2 * step)
    return SweepAxis(name=declaration.name, start=start, stop=min(high, start + (STEPS - 1) * step), step=step)
