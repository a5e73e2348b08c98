"""Checks, and the runs that they use."""

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import Drawing
from pftrack.core.model.recipe import Change
from pftrack.core.model.tracker import Step
from pftrack.experiments.experiment import Experiment
from pftrack.runs.run import Run

FRAMES = 12
"""Length of the runs: as much as differs between frames has shown itself by then, and no check takes long."""

SEED = 5


class CheckError(AssertionError):
    """An experiment does not do what every experiment should."""


@dataclass(frozen=True)
class Check:
    """One thing that should hold, to be called.

    Attributes:
        name: The property, a clause.
        run: Does nothing if it holds.
    """

    name: str
    run: Callable[[], None]

    def __call__(self) -> None:
        """Run it.

        Raises:
            CheckError: It does not hold.
        """
        self.run()

    def __str__(self) -> str:
        return self.name


def demand(holds: object, sentence: str) -> None:
    """Go on if something holds.

    Raises:
        CheckError: It does not.
    """
    if not holds:
        raise CheckError(sentence)


Whole: TypeAlias = Callable[[Experiment], None]
Each: TypeAlias = Callable[[Experiment, str], None]

OF_WHOLE: dict[str, Whole] = {}
OF_EACH: dict[str, Each] = {}
"""Checks by what should hold, a clause: of an experiment as a whole, and of each of its trackers."""


def whole(name: str) -> Callable[[Whole], Whole]:
    """Return what makes a function a check of an experiment as a whole."""
    return lambda function: OF_WHOLE.setdefault(name, function)


def each_tracker(name: str) -> Callable[[Each], Each]:
    """Return what makes a function a check of each tracker of an experiment."""
    return lambda function: OF_EACH.setdefault(name, function)


def begin_run(
    experiment: Experiment, tracker: str | None = None, *, seed: int = SEED, timeline: Iterable[Change] = ()
) -> Run:
    """Return a short run on the simulated scene, at its frame 0."""
    return Run(experiment, experiment.simulate(), tracker=tracker, seed=seed, frames=FRAMES, timeline=timeline)


def copy_arrays(step: Step) -> Mapping[str, NDArray[np.generic]]:
    """Return copies of the arrays of a state, its estimate and sigma among them."""
    arrays = {name: np.array(array) for name, array in step.state.arrays().items()}
    return arrays | {"estimate": np.array(step.state.estimate), "sigma": np.array(step.state.sigma)}


@dataclass(frozen=True)
class Straight:
    """A short run that was computed from its first frame to its last: what other ways are compared with.

    Checks share it, and leave it as it is.

    Attributes:
        run: At its last frame.
        steps: All of its steps.
        begun: Content of the state of frame 0 before a further frame was computed.
    """

    run: Run
    steps: tuple[Step, ...]
    begun: Mapping[str, NDArray[np.generic]]

    @cached_property
    def drawings(self) -> tuple[Drawing, ...]:
        """Drawing of each step at the time when it was the last one."""
        draw, rows = self.run.experiment.draw, self.run.diagnostics
        return tuple(draw(step, rows[:number]) for number, step in enumerate(self.steps, 1))


_LATEST: deque[tuple[Experiment, tuple[str, int], Straight]] = deque(maxlen=12)
"""Those that were asked for last: all checks of an experiment look at the same ones, of each of its trackers."""


def straight(experiment: Experiment, tracker: str, *, seed: int = SEED) -> Straight:
    """Return the straight run of a tracker on the simulated scene."""
    for known, key, found in _LATEST:
        if known is experiment and key == (tracker, seed):
            return found
    run = begin_run(experiment, tracker, seed=seed)
    begun = copy_arrays(run.current)
    made = Straight(run, tuple(run), begun)
    _LATEST.append((experiment, (tracker, seed), made))
    return made
