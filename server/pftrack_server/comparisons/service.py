"""Comparisons under way: outlined before they begin, so that what cannot be compared is refused at once."""

import dataclasses
from collections.abc import Awaitable, Callable, Sequence
from typing import Any, TypeAlias

from pftrack.core.model.recipe import Recipe
from pftrack.output.exports.comparisons import COMPARISON_FORMATS
from pftrack.runs.comparison import MOST_RUNS
from pftrack_server.comparisons.references import NamedRun, RunSources, find_run
from pftrack_server.errors import RefusedError
from pftrack_server.runs.exports import Exporting, Exports
from pftrack_server.schemas.comparisons import (
    ComparedPublic,
    ComparedRun,
    ComparisonOutline,
    ComparisonResult,
    RunComparisonPublic,
    SettingPublic,
)
from pftrack_server.schemas.description import ExportPublic
from pftrack_server.settings import Settings
from pftrack_server.tasks.comparisons import compare_runs, outline_comparison
from pftrack_server.tasks.jobs import Job, Jobs, failure_of
from pftrack_server.worker.protocol import WorkerConfig

Comparing: TypeAlias = Job[ComparisonOutline, ComparisonResult]


class Comparisons(Jobs[ComparisonOutline, ComparisonResult]):
    """All comparisons of a server."""

    def __init__(self, settings: Settings, house: RunSources, wait_for: Callable[[str], Awaitable[None]]) -> None:
        """Begin with none.

        Args:
            settings: What the server allows.
            house: Where runs can be.
            wait_for: Waits for an experiment to be compiled, or raises that it takes longer.
        """
        super().__init__("comparison")
        self._settings = settings
        self.house = house
        self._wait_for = wait_for

    async def compare(self, runs: Sequence[ComparedRun]) -> Comparing:
        """Begin to compare runs, once it is known that they can be compared.

        Raises:
            RefusedError: They are too few or too many, one is not as it should be, or they have nothing in common.
            NotFoundError: One is not here.
            ConflictError: The recording of one is not here.
            UnavailableError: Their experiment is still being compiled, or too much is under way.
        """
        self.check_room()
        named, configs, outlined = await self._prepare(runs)

        async def compute(on_step: Callable[[int, int], None]) -> ComparisonResult:
            seconds = self._settings.worker_cpu_seconds
            told = await self.house.tasks.run_long(compare_runs, configs, cpu_seconds=seconds, on_step=on_step)
            return ComparisonResult.model_validate(told)

        return self.begin(_outline(named, outlined), compute)

    async def export(self, runs: Sequence[ComparedRun], title: str, export: str, exports: Exports) -> Exporting:
        """Begin to write what runs come to beside each other as a file.

        Raises:
            NotFoundError: There is no such export, or one of the runs is not here.
            DiskFullError: The disk has no room.
            ApiError: They cannot be compared; see `compare`.
        """
        _, configs, outlined = await self._prepare(runs)
        return exports.write_comparison(configs, title or " ".join(outlined["names"]), export)

    async def _prepare(self, runs: Sequence[ComparedRun]) -> tuple[list[NamedRun], list[WorkerConfig], dict[str, Any]]:
        """Return what makes runs, and what is known of them beside each other before they are computed."""
        if not 2 <= len(runs) <= MOST_RUNS:
            raise RefusedError(f"Expected two to four runs to compare, got {len(runs)}.", field="runs", value=len(runs))
        named = [await find_run(run, self.house) for run in runs]
        for experiment in dict.fromkeys(each.spec.recipe.experiment for each in named):
            await self._wait_for(experiment)
        configs = [await self._config(each) for each in named]
        return named, configs, await self.house.tasks.run(outline_comparison, configs)

    async def _config(self, named: NamedRun) -> WorkerConfig:
        return dataclasses.replace(await self.house.manager.config(named.spec), states=None)


def comparison_view(job: Comparing) -> RunComparisonPublic:
    """Return a comparison as everybody outside sees it."""
    known = {**dict(job.about), "id": job.id, "done": job.done, "total": job.total}
    if not job.task.done():
        return RunComparisonPublic(**known, state="computing", result=None, message=None)
    message = failure_of(job)
    if message is None:
        return RunComparisonPublic(**known, state="done", result=job.task.result(), message=None)
    return RunComparisonPublic(**known, state="failed", result=None, message=message)


def _outline(named: Sequence[NamedRun], told: dict[str, Any]) -> ComparisonOutline:
    described = zip(named, told["names"], told["colours"], told["firsts"], strict=True)
    return ComparisonOutline(
        unit=told["unit"],
        frames=told["frames"],
        runs=[_compare(*each, frames=told["frames"]) for each in described],
        settings=[SettingPublic.model_validate(each) for each in told["settings"]],
        exports=[ExportPublic.model_validate(one) for one in COMPARISON_FORMATS],
    )


def _compare(named: NamedRun, name: str, colour: str, first: int, *, frames: int) -> ComparedPublic:
    # The truth belongs to the upload, from which whoever makes the run takes it.
    recipe: Recipe = named.spec.recipe.with_footage(truth=None)
    return ComparedPublic(
        name=name,
        title=named.title,
        colour=colour,
        first=first,
        recipe=recipe,
        shown=recipe.model_copy(update={"frames": first + frames}),
        upload=named.spec.upload,
    )
