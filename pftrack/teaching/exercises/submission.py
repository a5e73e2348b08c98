"""Exercises, submissions and verdicts.

An exercise is a text and a first file; a submission is a file that answers it, with the arguments of its functions; a
verdict states whether a property holds, with the numbers that show it.
"""

import math
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property, partial
from typing import Annotated, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy import stats

from pftrack.core.arrays import Floats
from pftrack.core.model.model import FilterModel
from pftrack.core.model.parameters import flat, revise
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, History
from pftrack.core.model.tracker import Diagnostics
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.own.code import FUNCTIONS, FilterCode, FilterFile, FilterFileError
from pftrack.experiments.own.extension import extend
from pftrack.filters.particles import normalise
from pftrack.runs.run import Run
from pftrack.teaching.lessons.lesson import Line, Name, Part, Scalar, Words


class Check(Part):
    """One property that a file is checked for.

    Attributes:
        property: Its name.
        points: Its points.
        options: Options that differ from the property's own, by name.
    """

    property: Name
    points: Annotated[float, Field(ge=0, le=1000)] = 1.0
    options: dict[Name, Scalar] = Field(default_factory=dict, max_length=20)


class ExerciseHead(Part):
    """The head of an exercise's file; docs/how-to/exercises.md explains how to write it.

    Attributes:
        id: Name in commands and in files.
        title: A few words.
        experiment: Whose target the file follows.
        functions: Functions to write, among those that a filter's file may define.
        values: Parameters of the experiment that differ from its defaults.
        frames: Length of a run.
        checks: Checks, in display order.
        hints: One after the other.
    """

    id: Annotated[str, Field(max_length=40, pattern=r"^[a-z][a-z0-9]*(-[a-z0-9]+)*$")]
    title: Line
    experiment: Name
    functions: Annotated[tuple[Name, ...], Field(min_length=1, max_length=8)]
    values: dict[Name, Scalar] = Field(default_factory=dict, max_length=100)
    frames: Annotated[int, Field(ge=2, le=500)] = 60
    checks: Annotated[tuple[Check, ...], Field(min_length=1, max_length=30)]
    hints: Annotated[tuple[Words, ...], Field(max_length=8)] = ()


class Exercise(ExerciseHead):
    """An exercise for students.

    Attributes:
        text: The task, as Markdown.
        skeleton: The file to begin with.
        origin: Its source, for users.
    """

    text: str
    skeleton: str
    origin: str

    @property
    def points(self) -> float:
        """All that can be reached."""
        return sum(check.points for check in self.checks)


@dataclass(frozen=True)
class Verdict:
    """The result of checking a property.

    Attributes:
        holds: Whether it holds.
        words: The finding, a sentence.
        numbers: By name, those that decided.
        seed: Seed of the random numbers that show it; None where nothing is random.
    """

    holds: bool
    words: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    seed: int | None = None


class SettledError(Exception):
    """A check has its verdict before its end.

    Attributes:
        verdict: The verdict.
    """

    def __init__(self, verdict: Verdict) -> None:
        super().__init__(verdict.words)
        self.verdict = verdict


# A right solution practically never fails by chance: each check that rests on random draws has a false alarm with a
# probability of `RISK`, shared among all that it compares. Seeds are fixed, so what has passed once passes again.


RISK = 1e-6
"""Probability that a right solution fails a check by chance."""


def bernstein_margin(variances: Floats, risk: float) -> Floats:
    """Return the tolerance of sums of independent 0-or-1 numbers about their expectations (Bernstein's inequality).

    It holds for every variance and every number of draws, not only for many. With v the sum of the variances, the
    probability of being off by more than t is at most 2 exp(-t^2 / (2 v + 2 t / 3)).

    Args:
        variances: (N,) sums of variances, or more than these.
        risk: Probability that one of the N sums is further off.
    """
    exponent = math.log(2.0 * len(variances) / risk)
    margin: Floats = exponent / 3.0 + np.sqrt((exponent / 3.0) ** 2 + 2.0 * exponent * variances)
    return margin


def student_margin(values: Floats, risk: float) -> float:
    """Return the tolerance of the mean of independent, roughly normal numbers about its expectation, by Student's t."""
    count = len(values)
    quantile = float(stats.t.ppf(1.0 - risk / 2.0, count - 1))
    return quantile * float(np.std(values, ddof=1)) / math.sqrt(count)


Option: TypeAlias = "int | float | str"
Options: TypeAlias = "Mapping[str, Option]"
Look: TypeAlias = "Callable[[Submission, Options, int], Verdict]"
"""(submission, options, first seed) -> what was found."""


LATER = 1
"""The frame that functions are called with: the first that a filter computes."""


def generator(seed: int, draw: int = 0) -> np.random.Generator:
    """Return the random numbers that a function of a file is given."""
    return np.random.Generator(np.random.Philox(key=[seed, draw]))


class Submission:
    """A file that answers an exercise.

    Attributes:
        exercise: Its exercise.
        name: Name of its tracker.
        text: Text of the file, which is trusted.
    """

    def __init__(self, exercise: Exercise, name: str, text: str) -> None:
        self.exercise, self.name, self.text = exercise, name, text
        self._rows: dict[tuple[int, str], list[Diagnostics]] = {}

    @cached_property
    def code(self) -> FilterCode:
        """The content of the file."""
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
    def model(self) -> FilterModel:
        """The defaults for missing functions."""
        if self.experiment.model is None:
            raise FilterFileError(self.code.file, None, f"{self.experiment.id} takes no filters from files")
        return self.experiment.model

    def rows(self, seed: int, tracker: str | None = None) -> list[Diagnostics]:
        """Return the result of a run of the file, or of another tracker on the same scene; it is computed once."""
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
        """Return arguments for a function, in separate writable arrays.

        Args:
            function: One of `FUNCTIONS`.
            count: Number of particles.
            seed: Seed of the scene and the particles.
        """
        state, frame, parameters = self._begin(seed)
        stream = Stream(seed, LATER, Purpose.TRACK)
        particles = self.model.particles(state, parameters, stream)
        begun = particles.states[np.arange(count) % len(particles)]
        spread = self.model.propagate(begun, frame, parameters, stream, state)
        logs, _ = normalise(2.0 * stream.standard_normal(count))
        seen = self.model.see(frame, state)
        given = {
            "position": np.array(frame.target.position) if frame.target is not None else None,
            "states": np.array(spread),
            "log_weights": logs,
            "count": count,
            "frame": deepcopy(replace(seen, target=None)),
            "parameters": self.parameters,
            "project": partial(self.model.project, known=state) if self.model.project else None,
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
        """The parameters as the functions see them."""
        return self.code.parameters(flat(self.setup.parameters))

    def _begin(self, seed: int) -> tuple[Any, Frame, Any]:
        """Return the state of frame 0, by the experiment's own beginning, and the frame after."""
        parameters = self.setup.parameters
        source, history = self.setup.open_source(seed, parameters), History(((0, parameters),))
        first, later = (source.frame(index, history) for index in (0, LATER))
        begun = self.model.start(source.start, first, parameters, Stream(seed, 0, Purpose.START))
        begun = self.model.prepare(begun, later, parameters)
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


# The exact moments of a signal of one dimension are computed by brute force: a grid over its two newest values. The
# model is of second order, x_t = 2 x_{t-1} - x_{t-2} + b u, so the belief is a density over pairs (x_t, x_{t-1}), and a
# step is one sum over x_{t-2} for each pair. The values of each frame have their own grid, around their prediction. The
# likelihood is the experiment's, and may be of any form.

CELLS = 81
REACH = 6.0
"""Extent of a grid on either side of the predicted mean, in standard deviations of the prediction."""


def moments_on_grid(submission: Submission, seed: int, *, noise: str) -> tuple[float, float]:
    """Return mean and standard deviation of the newest value in the last frame, given all frames.

    Args:
        submission: Its exercise gives the scene, which must begin in one known place.
        seed: Seed of the scene.
        noise: Name of the parameter with the standard deviation b of the motion's noise.

    Raises:
        ValueError: The signal has more dimensions, or begins in a place that is not known.
    """
    model, parameters = submission.model, submission.setup.parameters
    source, history = submission.setup.open_source(seed, parameters), History(((0, parameters),))
    first = source.frame(0, history)
    state = model.start(source.start, first, parameters, Stream(seed, 0, Purpose.START))
    known = model.particles(state, parameters, Stream(seed, 0, Purpose.START)).states
    if known.shape[1] != 2 or np.ptp(known, axis=0).any():
        raise ValueError("a grid takes a signal of one dimension that begins in a place which is known")
    sd = float(getattr(parameters, noise))
    newest, before = known[:1, 0], known[:1, 1]
    joint = np.ones((1, 1))
    for index in range(1, submission.exercise.frames):
        values = _grid(joint, newest, before, sd)
        means = 2.0 * newest[:, None] - before[None, :]
        moves = np.exp(-0.5 * ((values[:, None, None] - means[None]) / sd) ** 2)
        moved = np.einsum("xyz,yz->xy", moves, joint)
        states = np.stack([values, values], axis=1)
        logs = model.log_likelihood(states, source.frame(index, history), parameters, state)
        joint = moved * np.exp(logs - logs.max())[:, None]
        joint /= joint.sum()
        newest, before = values, newest
    density = joint.sum(axis=1)
    mean = float(density @ newest)
    return mean, float(np.sqrt(density @ (newest - mean) ** 2))


def _grid(joint: Floats, newest: Floats, before: Floats, sd: float) -> Floats:
    """Return the values (CELLS,) of a frame, around what is predicted from the joint density of the two before."""
    moved = 2.0 * newest[:, None] - before[None, :]
    mean = float(np.sum(joint * moved))
    reach = REACH * float(np.sqrt(np.sum(joint * (moved - mean) ** 2) + sd**2))
    return np.linspace(mean - reach, mean + reach, CELLS)
