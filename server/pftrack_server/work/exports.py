"""Exports: runs and comparisons written as files of other kinds by a child, and fetched from here once they are there.

A file lies in a folder of its own for as long as its job can be asked for, and goes with it. Sessions do not wait: the
child computes the run from its recipe.
"""

import re
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal

from pydantic import BaseModel, Field

from pftrack.core.model.setup import N, find_export
from pftrack.core.refusal import RefusedError
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments import find as find_experiment
from pftrack.output.exports.comparisons import COMPARISON_FORMATS, ComparisonExport
from pftrack.output.exports.formats import RunExport, check_plot, exports_of
from pftrack_server.core.errors import NotFoundError
from pftrack_server.jobs.jobs import Job, OnStep
from pftrack_server.sessions.spec import SessionSpec
from pftrack_server.store.files import new_name
from pftrack_server.work.comparisons import prepare
from pftrack_server.work.run_functions import write_comparison, write_export
from pftrack_server.work.sources import ComparedRun, House


class ExportedFile(BaseModel):
    """A file that was written."""

    title: str = Field(description="What kind of file it is")
    media_type: str
    address: str = Field(description="Where it can be fetched")


class ExportJob(Job[ExportedFile]):
    """A file that is being written; the first half of its steps computes the run."""

    kind: Literal["export"] = "export"


LONGEST = 60
"""Characters of a run's name that the name of a file has."""


async def export_run(
    house: House, spec: SessionSpec, title: str, export: str, plot: str | None, what_if: Mapping[str, Any] | None = None
) -> ExportJob:
    """Begin to write a file of a run.

    Args:
        house: Where that is done.
        spec: What makes the run, how far it has been computed, and where it stands.
        title: What people call it.
        export: Name of the export.
        plot: Id of the one plot that a picture shall show; None for all.
        what_if: The record of what would have saved it, where somebody has asked.

    Raises:
        NotFoundError: There is no such export.
        ConflictError: There is no such plot.
        DiskFullError: The disk has no room.
        UnavailableError: There are as many under way as there may be.
    """
    experiment = find_experiment(spec.recipe.experiment)
    kind = _find(exports_of(experiment), export)
    check_plot(experiment, kind, plot)
    frame = spec.run.position if kind.group == "model" else spec.run.computed
    name = "-".join(filter(None, (run_file_name(experiment.id, title), str(frame), plot)))
    return _begin(house, kind, name, write_export, await house.config(spec), kind.name, plot, what_if)


async def export_comparison(house: House, runs: Sequence[ComparedRun], title: str, export: str) -> ExportJob:
    """Begin to write what runs come to beside each other as a file, called by a title or else by the runs.

    Raises:
        NotFoundError: There is no such export, or one of the runs is not here.
        DiskFullError: The disk has no room.
        ApiError: They cannot be compared; see `prepare`.
    """
    _, configs, outline = await prepare(house, runs)
    kind = _find(COMPARISON_FORMATS, export)
    name = _slug(f"compare {title or ' '.join(outline.names)}")
    return _begin(house, kind, name, write_comparison, configs, kind.name)


def _begin(
    house: House, kind: RunExport | ComparisonExport, name: str, function: Callable[..., Any], *arguments: object
) -> ExportJob:
    """Begin to write a file, in a folder of its own that is named as the job."""
    house.jobs.check_room(ExportJob)
    house.store.disk_budget.check()
    job = ExportJob(id=new_name(), name=f"{name}.{kind.suffix}")
    path = house.store.files.exported(job.id)
    path.parent.mkdir(mode=0o700)

    async def work(on_step: OnStep) -> ExportedFile:
        most = house.settings.max_export_bytes
        await house.compute(on_step, function, *arguments, str(path), file_bytes=most, may_be_short=True)
        return ExportedFile(title=kind.title, media_type=kind.media_type, address=f"api/v1/jobs/{job.id}/file")

    return house.jobs.begin(job, work, drop=lambda: shutil.rmtree(path.parent, ignore_errors=True))


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
    except RefusedError as error:
        raise NotFoundError(str(error)) from None
