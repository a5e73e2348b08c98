"""What a check is, and the runs that checks are made on."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from pftrack.experiment import Experiment
from pftrack.runs.run import Change, Run

__all__ = ["FRAMES", "Check", "CheckError", "begun", "demand", "each_tracker", "named"]

FRAMES = 12
"""Length of the runs: as much as differs between frames has shown itself by then, and no check takes long."""

SEED = 5


class CheckError(AssertionError):
    """An experiment does not do what every experiment should."""


@dataclass(frozen=True)
class Check:
    """One thing that should hold, to be called.

    Attributes:
        name: What should hold, a clause.
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


def named(experiment: Experiment, parts: Sequence[tuple[str, Callable[[Experiment], None]]]) -> Iterator[Check]:
    """Yield checks of an experiment as a whole."""
    for name, function in parts:
        yield Check(name, partial(function, experiment))


def each_tracker(
    experiment: Experiment, parts: Sequence[tuple[str, Callable[[Experiment, str], None]]]
) -> Iterator[Check]:
    """Yield checks that are made of each tracker, whose name stands behind the check's own."""
    for name, function in parts:
        for tracker in experiment.trackers:
            yield Check(f"{name} ({tracker})", partial(function, experiment, tracker))


def begun(
    experiment: Experiment, tracker: str | None = None, *, seed: int = SEED, timeline: Iterable[Change] = ()
) -> Run:
    """Return a short run on the simulated scene, at its frame 0."""
    return Run(experiment, experiment.simulate(), tracker=tracker, seed=seed, frames=FRAMES, timeline=timeline)
