"""Submissions: a file that answers an exercise, and all that its functions are called with."""

from copy import deepcopy
from dataclasses import fields, is_dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.frame import Frame
from pftrack.core.model.parameters import flat, revise
from pftrack.core.model.source import History
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.experiment import Experiment, Setup
from pftrack.experiments.own import FilterFileError, extend
from pftrack.experiments.own.code import FUNCTIONS, FilterCode, FilterFile
from pftrack.experiments.shared.filter_interface import FilterInterface
from pftrack.filters.particles import normalise
from pftrack.runs.run import Run
from pftrack.teaching.exercises.exercise import Exercise

__all__ = ["Submission", "arrays_in", "generator"]

LATER = 1
"""The frame that functions are called with: the first that a filter computes."""


def generator(seed: int, draw: int = 0) -> np.random.Generator:
    """Return the random numbers that a function of a file is given."""
    return np.random.Generator(np.random.Philox(key=[seed, draw]))


class Submission:
    """A file that answers an exercise.

    Attributes:
        exercise: Which.
        name: Of its tracker.
        text: Of the file, which is trusted.
    """

    def __init__(self, exercise: Exercise, name: str, text: str) -> None:
        self.exercise, self.name, self.text = exercise, name, text
        self._rows: dict[tuple[int, str], list[Diagnostics]] = {}

    @cached_property
    def code(self) -> FilterCode:
        """What the file offers."""
        return FilterFile(self.name, self.text).load()

    def fresh(self) -> FilterCode:
        """Return the code as of a process that has not called any of it."""
        FilterFile(self.name, self.text).load()  # raises unless it is trusted
        return FilterCode(self.name, self.text)

    @cached_property
    def experiment(self) -> Experiment:
        """The experiment with the file among its trackers."""
        return extend(self.exercise.experiment, {self.name: (self.text,)})

    @cached_property
    def setup(self) -> Setup:
        """The scene, with the exercise's values."""
        setup = self.experiment.simulate()
        return replace(setup, parameters=revise(setup.parameters, self.exercise.values))

    @property
    def interface(self) -> FilterInterface:
        """What the experiment tells filters from files."""
        if self.experiment.filter_interface is None:
            raise FilterFileError(self.code.file, None, f"{self.experiment.id} takes no filters from files")
        return self.experiment.filter_interface

    def rows(self, seed: int, tracker: str | None = None) -> list[Diagnostics]:
        """Return what a run of the file comes to, or one of another tracker on the same scene; it is computed once."""
        chosen = tracker or self.name
        if (seed, chosen) not in self._rows:
            run = Run(self.experiment, self.setup, tracker=chosen, seed=seed, frames=self.exercise.frames)
            run.finish()
            self._rows[seed, chosen] = run.diagnostics
        return self._rows[seed, chosen]

    @property
    def defined(self) -> tuple[str, ...]:
        """Names of the functions that the file defines, in the order of `FUNCTIONS`."""
        return tuple(name for name in FUNCTIONS if name in self.code.functions)

    def arguments(self, function: str, count: int, seed: int) -> dict[str, Any]:
        """Return what a function may be called with, in arrays of its own that can be written to.

        Args:
            function: Of `FUNCTIONS`.
            count: Of particles.
            seed: Of the scene and the particles.
        """
        state, frame, parameters = self._begin(seed)
        stream = Stream(seed, LATER, Purpose.TRACK)
        particles = self.interface.particles(state, parameters, stream)
        begun = particles.states[np.arange(count) % len(particles)]
        spread = self.interface.propagate(state, begun, frame, parameters, stream)
        project = self.interface.project
        logs, _ = normalise(2.0 * stream.standard_normal(count))
        seen = frame if self.interface.see is None else self.interface.see(state, frame)
        given = {
            "position": np.array(frame.target.position) if frame.target is not None else None,
            "states": np.array(spread),
            "log_weights": logs,
            "count": count,
            "frame": deepcopy(replace(seen, target=None)),
            "parameters": self.parameters,
            "project": None if project is None else partial(project, state),
        }
        return {name: given[name] for name in FUNCTIONS[function] if name in given}

    def call(self, function: str, *, code: FilterCode | None = None, **given: Any) -> Any:  # noqa: ANN401 - what it returns
        """Call a function in the time that a step may take.

        Raises:
            FilterFileError: It raised something, or there is none of that name.
        """
        code = code or self.code
        if function not in code.functions:
            raise FilterFileError(code.file, None, f"does not define {function}")
        with code.limited():
            return code.call(function, **given)

    @property
    def parameters(self) -> Any:  # noqa: ANN401 - of the file's own class
        """What the functions see of the parameters."""
        return self.code.parameters(flat(self.setup.parameters))

    def _begin(self, seed: int) -> tuple[Any, Frame, Any]:
        """Return the state of frame 0, by the experiment's own beginning, and the frame after."""
        parameters = self.setup.parameters
        source, history = self.setup.open_source(seed, parameters), History(((0, parameters),))
        first, later = (source.frame(index, history) for index in (0, LATER))
        begun = self.interface.start(source.start, first, parameters, Stream(seed, 0, Purpose.START))
        begun = self.interface.likelihood.prepare(begun, later, parameters)
        return begun, later, parameters


def arrays_in(value: Any, name: str = "") -> dict[str, NDArray[Any]]:  # noqa: ANN401 - whatever a function takes or returns
    """Return the arrays in a value, copied, by their names: of a tuple's places and a frame's fields."""
    if isinstance(value, tuple | list) and any(_is_array(each) for each in value):
        found: dict[str, NDArray[Any]] = {}
        for place, each in enumerate(value):
            found |= arrays_in(each, f"{name}[{place}]")
        return found
    if is_dataclass(value) and not isinstance(value, type):
        parts = [arrays_in(getattr(value, each.name), f"{name}.{each.name}") for each in fields(value)]
        return {key: each for part in parts for key, each in part.items()}
    if isinstance(value, np.ndarray | list | int | float | bool | np.generic):
        return {name: np.array(value)}
    return {}


def _is_array(value: object) -> bool:
    return isinstance(value, np.ndarray)
