"""Exports: runs and comparisons written as files of other kinds by a child, and fetched from here once they are there.

A file lies in a folder of its own for as long as its job can be asked for, and goes with it. Sessions do not wait: the
child computes the run from its recipe.
"""

import asyncio
import re
import shutil
from collections.abc import Callable, Coroutine, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from pftrack.core.model.recipe import Footage, Recipe
from pftrack.core.model.setup import N, find_export
from pftrack.experiments import EXPERIMENTS
from pftrack.output.exports.comparisons import COMPARISON_FORMATS, ComparisonExport
from pftrack.output.exports.formats import RunExport, check_plot, exports_of
from pftrack_server.errors import NotFoundError
from pftrack_server.experiments import find_experiment
from pftrack_server.runs.service import footage_here
from pftrack_server.schemas.description import ExportPublic
from pftrack_server.settings import Settings
from pftrack_server.store import Store
from pftrack_server.tasks.child_tasks import ChildTasks
from pftrack_server.tasks.comparisons import write_comparison
from pftrack_server.tasks.exports import Order, write_export
from pftrack_server.tasks.jobs import Job, Jobs
from pftrack_server.uploads.intake import limits_of
from pftrack_server.worker.protocol import WorkerConfig

LONGEST = 60
"""Characters of a run's name that the name of a file has."""


@dataclass(frozen=True, slots=True)
class Subject:
    """A run that can be exported.

    Attributes:
        recipe: What makes it.
        computed: The last frame that belongs to it.
        position: The frame at which it stands.
        name: What people call it.
        what_if: The record of what would have saved it, where somebody has asked.
    """

    recipe: Recipe
    computed: int
    position: int
    name: str
    what_if: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class Ordered:
    """A file that was asked for.

    Attributes:
        kind: What it is.
        name: What it is called where it is taken to.
        folder: Where it lies, alone.
    """

    kind: RunExport | ComparisonExport
    name: str
    folder: Path

    @property
    def path(self) -> Path:
        """The file."""
        return self.folder / "file"


Exporting: TypeAlias = Job[Ordered, Path]
"""A file that is being written."""


OnStep: TypeAlias = Callable[[int, int], None]


class Exports(Jobs[Ordered, Path]):
    """All exports of a server."""

    def __init__(self, settings: Settings, store: Store, tasks: ChildTasks) -> None:
        super().__init__("export")
        self._settings = settings
        self._store = store
        self._tasks = tasks

    def write(self, subject: Subject, name: str, plot: str | None) -> Exporting:
        """Begin to write a file of a run.

        Raises:
            NotFoundError: There is no such export.
            ExportError: There is no such plot.
            DiskFullError: The disk has no room.
            UnavailableError: There are as many under way as there may be.
        """
        experiment = find_experiment(subject.recipe.experiment)
        kind = _find(exports_of(experiment), name)
        check_plot(experiment, kind, plot)

        async def write(path: Path, on_step: OnStep) -> None:
            recipe = subject.recipe.model_dump(mode="json")
            filters = await asyncio.to_thread(self._store.files.filters_of, subject.recipe)
            order = Order(
                recipe, subject.computed, subject.position, kind.name, plot, str(path), filters, subject.what_if
            )
            await self._write(order, subject.recipe.footage, on_step)

        return self._begin(kind, file_name(subject, kind, plot), write)

    def write_comparison(self, configs: Sequence[WorkerConfig], title: str, name: str) -> Exporting:
        """Begin to write a file of a comparison.

        Args:
            configs: Of its runs.
            title: What people call it.
            name: Of the export.

        Raises:
            NotFoundError: There is no such export.
            DiskFullError: The disk has no room.
            UnavailableError: There are as many under way as there may be.
        """
        kind = _find(COMPARISON_FORMATS, name)

        def write(path: Path, on_step: OnStep) -> Coroutine[Any, Any, None]:
            return self._tasks.run_long(
                write_comparison,
                configs,
                kind.name,
                str(path),
                cpu_seconds=self._settings.worker_cpu_seconds,
                file_bytes=self._settings.max_export_bytes,
                on_step=on_step,
            )

        return self._begin(kind, f"{_slug(f'compare {title}')}.{kind.suffix}", write)

    def _begin(
        self,
        kind: RunExport | ComparisonExport,
        name: str,
        write: Callable[[Path, OnStep], Coroutine[Any, Any, None]],
    ) -> Exporting:
        """Begin to write a file, in a folder of its own."""
        self.check_room()
        self._store.disk_budget.check()
        folder = self._store.files.new_outgoing()
        folder.mkdir(mode=0o700)
        ordered = Ordered(kind, name, folder)

        async def work(on_step: OnStep) -> Path:
            try:
                await write(ordered.path, on_step)
            except BaseException:
                shutil.rmtree(folder, ignore_errors=True)
                raise
            return ordered.path

        return self.begin(ordered, work)

    async def _write(self, order: Order, footage: Footage | None, on_step: OnStep) -> None:
        video = await footage_here(self._store, self._settings, self._tasks, footage)
        await self._tasks.run_long(
            write_export,
            order,
            video,
            limits_of(self._settings),
            cpu_seconds=self._settings.worker_cpu_seconds,
            file_bytes=self._settings.max_export_bytes,
            on_step=on_step,
        )

    def on_drop(self, job: Exporting) -> None:
        """Remove the file of a job that nobody can ask for any more."""
        shutil.rmtree(job.about.folder, ignore_errors=True)


def file_name(subject: Subject, kind: RunExport | ExportPublic, plot: str | None) -> str:
    """Return what a file is called: by the run, and the last frame in it or the one that it shows."""
    frame = subject.position if kind.group == "model" else subject.computed
    run = run_file_name(subject.recipe.experiment, subject.name)
    return f"{'-'.join(filter(None, (run, str(frame), plot)))}.{kind.suffix}"


def run_file_name(experiment: str, name: str) -> str:
    """Return what files of a run are called: by its experiment, and by its name unless that says no more."""
    known = EXPERIMENTS.get(experiment)
    titles = (known.video.clip_title, known.title) if known else ()
    rest = next((name.removeprefix(title) for title in titles if title and name.startswith(title)), name)
    return "-".join(filter(None, (experiment, _slug(rest))))


def _slug(text: str) -> str:
    """Return a text as a part of a file's name."""
    return re.sub(r"[^\w.]+", "-", text.lower()).strip("-.")[:LONGEST]


def _find(offered: Iterable[N], name: str) -> N:
    try:
        return find_export(offered, name)
    except LookupError as error:
        raise NotFoundError(f"{str(error.args[0]).capitalize()}.") from None
