"""Execution of the studies: in this process, over several, or over a cluster.

A study runs the product: it passes recipes and the measurements of each run. Several processes and a cluster are the
workers of the sweeps: both are handed pieces of work by number.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from itertools import chain, islice
from pathlib import Path
from time import monotonic, process_time
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.model.source import Source
from pftrack.core.model.tracker import Diagnostics
from pftrack.experiments import find
from pftrack.output.figures.style import save
from pftrack.runs.run import Run
from pftrack.sweep import Plan, Result, carry_out, partial_of, read_result
from pftrack.sweep.axis import SweepError
from pftrack.sweep.driver import Progress, hand_out, open_workers
from pftrack.sweep.work import Workers
from pftrack.vision.rendering import png

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")
Key = TypeVar("Key")

OpenSource: TypeAlias = Callable[[int, Any], Source[Any]]
"""From seed and parameters to a source of the study's own, in place of the experiment's scene."""

RUNS_A_PIECE = 120
"""Number of runs of a sweep per piece of work."""


class Pool:
    """Maps functions over lists of work, carries out sweeps, and reports progress.

    Attributes:
        folder: Where sweeps and figures are kept, if anywhere.
        pieces: Number of finished pieces of work, most of them trials.
        seconds: Processor time of all pieces of work so far, s; of sweeps the time that they took, for every process.
    """

    def __init__(
        self,
        jobs: int,
        progress: Callable[[int, int], object] | None = None,
        folder: Path | None = None,
        cluster: str | None = None,
    ) -> None:
        """Prepare to compute.

        Args:
            jobs: Number of processes.
            progress: Called with the number of pieces done and of those known so far.
            folder: Where sweeps and figures are kept; nowhere if None.
            cluster: Address of a Dask scheduler whose workers compute in the place of these processes.
        """
        self.folder = folder
        self._jobs = jobs
        self._cluster = cluster
        self._workers: Workers | None = None
        self._progress = progress
        self.pieces = 0
        self._known = 0
        self.seconds = 0.0

    def __enter__(self) -> Self:
        """Use the pool."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End its processes; what has not begun is dropped."""
        if self._workers is not None:
            self._workers.close()

    def map(self, function: Callable[[Item], Outcome], items: Iterable[Item]) -> list[Outcome]:
        """Return function(item) for all items, in order; function and items must be picklable.

        Raises:
            SweepError: The function failed in another process, or ended it.
        """
        work = list(items)
        self._known += len(work)
        if self._jobs == 1 and self._cluster is None:
            results = []
            for item in work:
                (outcome,), seconds = _transform(function, [item])
                results.append(outcome)
                self._advance(1, seconds)
            return results
        size = max(1, min(16, len(work) // 16))
        return self._spread(function, [work[start : start + size] for start in range(0, len(work), size)])

    def runs(
        self, measure: Callable[[Run], Outcome], recipes: Iterable[Recipe], source: OpenSource | None = None
    ) -> list[Outcome]:
        """Return what is measured of the run of each recipe, in order.

        Args:
            measure: Called with a run at its frame 0, which it carries out; picklable, as are the sources.
            recipes: Recipes of simulated scenes.
            source: Source of the frames, instead of the experiment's own.

        Raises:
            SweepError: A run failed in another process, or ended it.
        """
        return self.map(partial(_measured, measure, source), recipes)

    def groups(
        self, function: Callable[[Item], Outcome], groups: Mapping[Key, Iterable[Item]]
    ) -> dict[Key, list[Outcome]]:
        """Return function(item) for the items under each key; see `map`."""
        work = {key: list(items) for key, items in groups.items()}
        outcomes = iter(self.map(function, chain.from_iterable(work.values())))
        return {key: list(islice(outcomes, len(items))) for key, items in work.items()}

    def run_groups(
        self, measure: Callable[[Run], Outcome], groups: Mapping[Key, Iterable[Recipe]]
    ) -> dict[Key, list[Outcome]]:
        """Return what is measured of the runs of the recipes under each key; see `runs`."""
        return self.groups(partial(_measured, measure, None), groups)

    def draw(self, make: "Callable[[], Mapping[str, Figure | NDArray[np.uint8]]]") -> None:
        """Write figures and pictures (RGB) by their names, PNG, where there is a folder for them."""
        if self.folder is None:
            return
        for name, drawn in make().items():
            if isinstance(drawn, np.ndarray):
                (self.folder / f"{name}.png").write_bytes(png(drawn))
            else:
                save(drawn, self.folder / f"{name}.png", name)

    def _spread(self, function: Callable[[Item], Outcome], pieces: list[list[Item]]) -> list[Outcome]:
        """Return the outcomes of all pieces in order, each computed by the next worker that is free."""
        if self._workers is None:
            self._workers = open_workers(self._jobs, self._cluster)
        outcomes: dict[int, list[Outcome]] = {}
        for done in hand_out(self._workers, range(len(pieces)), lambda it: (_transform, function, pieces[it]), _lose):
            for number, (found, seconds) in done:
                outcomes[number] = found
                self._advance(len(found), seconds)
        return [outcome for number in range(len(pieces)) for outcome in outcomes[number]]

    def _advance(self, count: int, seconds: float) -> None:
        self.pieces += count
        self.seconds += seconds
        if self._progress is not None:
            self._progress(self.pieces, self._known)

    def sweep(self, plan: Plan, out: Path) -> Result:
        """Return the result of a sweep that is kept in a file: finished before, gone on with, or computed.

        Raises:
            SweepError: The file holds another sweep.
        """
        begun = out.exists() or partial_of(out).exists()
        if begun and read_result(out).plan != plan:
            raise SweepError(f"{out} holds another sweep; name another folder")
        if out.exists():
            return read_result(out)
        known, pieces = self._known, -(-plan.runs // RUNS_A_PIECE)
        self._known += pieces

        def tell(progress: Progress) -> None:
            self.pieces = known + progress.done // RUNS_A_PIECE
            if self._progress is not None:
                self._progress(self.pieces, self._known)

        began = monotonic()
        result = carry_out(None if begun else plan, out, jobs=self._jobs, cluster=self._cluster, progress=tell)
        self.pieces = known + pieces
        self.seconds += self._jobs * (monotonic() - began)
        return result


def _lose(_number: int, how: str, too_often: bool) -> None:
    if too_often:
        raise SweepError(f"the study failed: it lost a process of the pool again and again ({how})")


def _transform(function: Callable[[Item], Outcome], items: list[Item]) -> tuple[list[Outcome], float]:
    """Return the outcomes of a piece of work, and the processor time that it took, s."""
    began = process_time()
    return [function(item) for item in items], process_time() - began


def _measured(measure: Callable[[Run], Outcome], source: OpenSource | None, recipe: Recipe) -> Outcome:
    return measure(begin(recipe, source))


def recipe(
    experiment: str,
    tracker: str,
    values: Mapping[str, Value] | None = None,
    *,
    seed: int = 0,
    frames: int | None = None,
) -> Recipe:
    """Return the recipe of a run of a simulated scene with these values from the first frame on."""
    timeline = (Change(0, dict(values)),) if values else ()
    return Recipe(experiment=experiment, tracker=tracker, seed=seed, frames=frames, timeline=timeline)


def seeded(recipe: Recipe, seeds: Iterable[int]) -> list[Recipe]:
    """Return the recipe with each of the seeds."""
    return [recipe.model_copy(update={"seed": seed}) for seed in seeds]


def preset_recipe(experiment: str, preset: str, tracker: str = "", **values: Value) -> Recipe:
    """Return the recipe of a preset, with another tracker or other values if they are given."""
    chosen = find(experiment).preset_named(preset)
    return recipe(experiment, tracker or chosen.tracker, {**chosen.parameters, **values}, seed=chosen.seed)


def begin(recipe: Recipe, source: OpenSource | None = None) -> Run:
    """Return the run of a recipe of a simulated scene at its frame 0, or of another source that is followed alike."""
    experiment = find(recipe.experiment)
    setup = experiment.simulate()
    return Run.from_recipe(recipe, experiment, setup if source is None else replace(setup, open_source=source))


def rows_of(run: Run) -> list[Diagnostics]:
    """Carry a run out and return the numbers of all frames but the first."""
    run.finish()
    return run.diagnostics[1:]
