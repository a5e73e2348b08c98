"""The gallery of failures: what is declared of each, and the courses of its runs, computed once and kept."""

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path

from pftrack.experiments import EXPERIMENTS
from pftrack.failures import Entry, entry, gallery
from pftrack.model.failure import KINDS
from pftrack.model.parameters import Value, declarations, flat, revise
from pftrack_server.errors import NotFoundError
from pftrack_server.schemas.failures import DifferencePublic, FailureNeighbour, FailurePublic, FailureResult
from pftrack_server.tasks.child_tasks import ChildTasks
from pftrack_server.tasks.disk_cache import DiskCache, digest
from pftrack_server.tasks.functions import run_with_and_without_cure

__all__ = ["FailureResults", "failure_named", "failures", "public"]


def failures() -> list[FailurePublic]:
    """Return all failures by their numbers."""
    return [public(each) for each in gallery(EXPERIMENTS)]


def failure_named(name: str) -> Entry:
    """Return a failure by its id or its number.

    Raises:
        NotFoundError: There is none, or its experiment is not installed here.
    """
    try:
        return entry(EXPERIMENTS, name)
    except LookupError:
        raise NotFoundError(
            f"There is no failure {name[:64]!r} here. It may belong to an experiment that is not installed; there are "
            f"{len(gallery(EXPERIMENTS))}, by number or by name."
        ) from None


def public(shown: Entry) -> FailurePublic:
    """Return what is declared of a failure."""
    failure, experiment = shown.failure, shown.experiment
    return FailurePublic(
        id=failure.id,
        number=shown.number,
        title=failure.title,
        kind=failure.kind,
        kind_title=KINDS[failure.kind],
        experiment=experiment.id,
        experiment_title=experiment.title,
        diagnosis=failure.diagnosis,
        cure=failure.cure.text,
        frame=failure.frame,
        differences=_differences(shown),
        failing=shown.recipe(),
        cured=shown.recipe(cured=True),
        page=f"failures/{failure.id}",
        previous=_neighbour(shown.number - 1),
        next=_neighbour(shown.number + 1),
    )


def _neighbour(number: int) -> FailureNeighbour | None:
    found = [each.failure for each in gallery(EXPERIMENTS) if each.number == number]
    return FailureNeighbour(id=found[0].id, title=found[0].title) if found else None


def _differences(shown: Entry) -> list[DifferencePublic]:
    """Return what differs between the two runs, in the words of the experiment."""
    failure, experiment = shown.failure, shown.experiment
    parameters = experiment.simulate().parameters
    before, after = (
        flat(revise(parameters, {name: value for name, value in values.items() if name != "tracker"}))
        for values in (failure.parameters, {**failure.parameters, **failure.cure.values})
    )
    found = [
        DifferencePublic(title=it.title, unit=it.unit, failing=before[it.name], cured=after[it.name])
        for it in declarations(type(parameters))
        if before[it.name] != after[it.name]
    ]
    trackers: list[Value] = [
        experiment.trackers[str(name)].title for name in (failure.tracker, failure.cure.values.get("tracker")) if name
    ]
    if len(set(trackers)) > 1:
        found.insert(0, DifferencePublic(title="Tracker", unit="", failing=trackers[0], cured=trackers[1]))
    return found


class FailureResults:
    """The courses of failures that somebody has asked for: each is computed once, in a child, and kept on the disk.

    Those of other packages' experiments are kept as long as the server runs, which sees no change of theirs.
    """

    def __init__(self, folder: Path, wait_for: Callable[[str], Awaitable[None]]) -> None:
        """Begin with those that were computed by this very program.

        Args:
            folder: Where they are kept.
            wait_for: Waits for an experiment to be compiled, or raises that it takes longer.
        """
        self._kept = DiskCache(folder)
        self._wait_for = wait_for
        self._known: dict[str, FailureResult] = {}
        self._under_way: dict[str, asyncio.Lock] = {}

    def open(self) -> None:
        """Forget what another version of the program has computed."""
        self._kept.open()

    async def of(self, shown: Entry, tasks: ChildTasks) -> FailureResult:
        """Return the course of a failure and of its cure.

        Raises:
            UnavailableError: Its experiment is still being compiled, or it takes too long.
            RefusedError: It cannot be computed.
        """
        name = shown.failure.id
        async with self._under_way.setdefault(name, asyncio.Lock()):
            if name not in self._known:
                is_own, place = shown.experiment.id in EXPERIMENTS.own, digest(name)
                course = await asyncio.to_thread(self._kept.read, place) if is_own else None
                if course is None:
                    await self._wait_for(shown.experiment.id)
                    course = await tasks.run(run_with_and_without_cure, name)
                    if is_own:
                        await asyncio.to_thread(self._kept.write, place, course)
                self._known[name] = FailureResult.model_validate(course)
        return self._known[name]
