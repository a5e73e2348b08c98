"""Checks of what is written down of every frame: finite, of the right length, and as declared."""

from collections.abc import Iterator

import numpy as np

from pftrack.experiment import Experiment, Step
from pftrack.testing.check import Check, begun, demand, each_tracker

__all__ = ["checks"]


def checks(experiment: Experiment) -> Iterator[Check]:
    """Yield the checks of this module, each for every tracker."""
    yield from each_tracker(
        experiment,
        [
            ("estimates are finite and as long as positions are", _estimates_are_finite),
            ("its states are values", _states_are_values),
            ("series are as declared", _series_are_declared),
        ],
    )


def _estimates_are_finite(experiment: Experiment, tracker: str) -> None:
    run = begun(experiment, tracker)
    length = len(run.source.start.position)
    for step in run:
        frame, state = step.diagnostics.frame, step.state
        for name, values in (("estimate", state.estimate), ("sigma", state.sigma)):
            shape, finite = np.shape(values), np.isfinite(values).all()
            demand(shape == (length,), f"the {name} of frame {frame} must have the shape ({length},), got {shape}")
            demand(finite, f"the {name} of frame {frame} must be finite, got {values}")
        demand((state.sigma >= 0).all(), f"the sigma of frame {frame} must not be negative, got {state.sigma}")
        evidence = state.log_evidence
        demand(evidence < np.inf, f"the log evidence of frame {frame} must be a number or -inf, got {evidence}")


def _states_are_values(experiment: Experiment, tracker: str) -> None:
    run = begun(experiment, tracker)
    first = run.current
    before = _copied(first)
    run.finish()
    demand(first.state.nbytes > 0, f"a state must say how much memory it takes, got {first.state.nbytes} bytes")
    for name, array in _copied(first).items():
        same = np.array_equal(array, before[name], equal_nan=array.dtype.kind == "f")
        demand(same, f"{name} of the state of frame 0 changed while later frames were computed; states must not change")


def _copied(step: Step) -> dict[str, np.ndarray]:
    arrays = {name: np.array(array) for name, array in step.state.arrays().items()}
    return arrays | {"estimate": np.array(step.state.estimate), "sigma": np.array(step.state.sigma)}


def _series_are_declared(experiment: Experiment, tracker: str) -> None:
    run = begun(experiment, tracker)
    run.finish()
    names = run.diagnostics[0].series.keys()
    for row in run.diagnostics:
        found = row.series.keys()
        demand(found == names, f"frame {row.frame} has the series {', '.join(found)}, frame 0 has {', '.join(names)}")
        for name, value in row.series.items():
            demand(not np.isinf(value).any(), f"{name} of frame {row.frame} must be finite or NaN, got {value}")
    shown = [(plot.title, plot.names) for plot in experiment.plots]
    shown += [(reading.title, reading.names) for reading in experiment.readings]
    for title, wanted in shown:
        missing = set(wanted) - names
        demand(not missing, f"{title} reads series that no frame has: {', '.join(sorted(missing))}")
