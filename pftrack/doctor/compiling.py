"""Compilation: the runs that call all compiled functions, and the reports of the process that makes them.

Trackers, presets, and choices and switches of parameters are all run. Otherwise a class would wait for the compiler at
the first switch to the pinhole camera.
"""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from numba.core import event

from pftrack.core.model.drawing import Drawing
from pftrack.core.model.parameters import Value, declarations
from pftrack.core.model.recipe import Change
from pftrack.core.numerics.compiled import FUNCTIONS
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.experiment import Experiment
from pftrack.process import report
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
    # A choice may matter only together with another one.
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


class _Watch(event.Listener):
    def __init__(self, begun: Callable[[str], None], ended: Callable[[str, float], None]) -> None:
        self._begun, self._ended = begun, ended
        self._open: list[list[float]] = []

    def on_start(self, event: Any) -> None:  # noqa: ANN401 - numba's
        """Begin to measure."""
        self._open.append([time.process_time(), 0.0])
        if (name := _ours(event)) is not None:
            self._begun(name)

    def on_end(self, event: Any) -> None:  # noqa: ANN401 - numba's
        """Report its processor time, less that of the functions it called."""
        begun, inside = self._open.pop()
        whole = time.process_time() - begun
        if self._open:
            self._open[-1][1] += whole
        if (name := _ours(event)) is not None:
            self._ended(name, whole - inside)


@contextmanager
def watch(begun: Callable[[str], None], ended: Callable[[str, float], None]) -> Iterator[None]:
    """Report every function of pftrack that this process compiles.

    Args:
        begun: Is called with its name.
        ended: Is called with its name and the processor time that it took without the functions that it calls, s.
    """
    with event.install_listener("numba:compile", _Watch(begun, ended)):
        yield


def name_of(dispatcher: Any) -> str:  # noqa: ANN401 - numba's
    """Return a function's name with its module's."""
    return f"{dispatcher.py_func.__module__}.{dispatcher.py_func.__qualname__}"


def _ours(event: Any) -> str | None:  # noqa: ANN401 - numba's
    dispatcher = event.data["dispatcher"]
    return name_of(dispatcher) if any(dispatcher is ours for ours in FUNCTIONS) else None


def compile_case(name: str, number: int) -> list[str]:
    """Run one of the `cases` of an experiment, and return the names of all that is compiled by then.

    It reports `{"begun": EXPERIMENT, "cases": 12, "total": 81}` before the first case of one, with the number of all
    functions, and `{"function": NAME, "seconds": S}` for each compiled function.
    """
    every = tuple(cases(EXPERIMENTS[name]))
    if number == 0:
        report({"begun": name, "cases": len(every), "total": len(FUNCTIONS)})
    with watch(lambda _: None, lambda function, seconds: report({"function": function, "seconds": round(seconds, 3)})):
        run_case(EXPERIMENTS[name], *every[number])
    return [name_of(it) for it in FUNCTIONS if it.signatures]
