"""Runs: saved from a session to a record, or imported from one; fits of parameters; and exports.

A child process writes an export, whose file stays in a folder of its own as long as its job exists. Sessions do not
wait: the child computes the run from its recipe.
"""

import asyncio
import re
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, computed_field

from pftrack.analysis.fitting import MOST_NUMBERS, Fit
from pftrack.core.files import settle
from pftrack.core.model.measures import HIT_RATE
from pftrack.core.model.recipe import Recipe
from pftrack.core.model.setup import N, find_export
from pftrack.core.refusal import ConflictError, RefusedError
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments import find as find_experiment
from pftrack.output.exports.comparisons import COMPARISON_FORMATS, ComparisonExport
from pftrack.output.exports.formats import RunExport, check_plot, exports_of
from pftrack.runs.loss import loss_words
from pftrack.runs.record import Record
from pftrack_server.core.bodies import Name, RequestBody
from pftrack_server.core.errors import disk_full, not_found
from pftrack_server.core.resource_limits import mebibytes
from pftrack_server.core.settings import Settings
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.jobs.jobs import Job, OnStep
from pftrack_server.sessions.session import Session
from pftrack_server.sessions.spec import SessionSpec
from pftrack_server.sessions.worker.protocol import Save
from pftrack_server.store import Store
from pftrack_server.store.database import RunRow
from pftrack_server.store.files import new_name, now
from pftrack_server.uploads.intake import recording_of
from pftrack_server.uploads.multipart import Received
from pftrack_server.work import run_functions as functions
from pftrack_server.work.comparisons import prepare
from pftrack_server.work.sources import ComparedRun, House


class FitCreate(RequestBody):
    """The parameters to fit."""

    numbers: list[Name] = Field(min_length=1, max_length=MOST_NUMBERS, description="Names of the tracker's parameters")


class RunPublic(BaseModel):
    """A saved run."""

    model_config = ConfigDict(from_attributes=True)

    id: str
    title: str
    experiment: str
    tracker: str
    seed: int
    frames: int
    created: str
    outcome: str
    summary: dict[str, Any]

    @computed_field  # type: ignore[prop-decorator]
    @property
    def thumbnail(self) -> str:
        """Address of the run's picture."""
        return f"api/v1/runs/{self.id}/thumbnail.png"

    @computed_field  # type: ignore[prop-decorator]
    @property
    def page(self) -> str:
        """Address of the page that lists the run."""
        return f"work?show=runs#run-{self.id}"


class ImportJob(Job[RunPublic]):
    """An imported run that is being computed; its steps are frames."""

    kind: Literal["import"] = "import"


class FitJob(Job[Fit]):
    """A fit of parameters to the data of a session's run."""

    kind: Literal["fit"] = "fit"


class ExportedFile(BaseModel):
    """An exported file."""

    title: str = Field(description="Title of the file's kind")
    media_type: str
    address: str = Field(description="Address of the file")


class ExportJob(Job[ExportedFile]):
    """A file that is being written; the first half of its steps computes the run."""

    kind: Literal["export"] = "export"


LONGEST = 60
"""Most characters of a run's name in a file name."""

FIT = TypeAdapter(Fit)


def check_room(store: Store, settings: Settings) -> None:
    """Make sure that there is room for one more saved run.

    Raises:
        ConflictError: The limit of saved runs is reached.
        ApiError: All saved runs together are too large, or the disk has no room (507).
    """
    store.disk_budget.check()
    if store.count(RunRow) >= settings.max_runs:
        raise ConflictError(f"The server keeps at most {settings.max_runs} saved runs; delete one first.")
    used = store.files.runs_bytes()
    if used >= settings.max_runs_bytes:
        raise disk_full(f"Saved runs take {mebibytes(used)} of {mebibytes(settings.max_runs_bytes)}; delete one first.")


async def save_run(store: Store, session: Session, title: str | None) -> RunRow:
    """Save the active branch of a session: its record, a picture, and its outcome."""
    name = new_name()
    run = session.spec.run
    saved = await session.order(Save(str(store.files.record(name))))
    title = title or f"{session.snapshot.name} · {session.description.tracker_title(run.tracker)}"
    row = _row(name, title, run.recipe, run.tracker, saved["summary"], run.position, run.computed)
    row.bookmarks = [mark.model_dump() for mark in session.spec.bookmarks if mark.branch == run.branch]
    await asyncio.to_thread(store.add_run, row, saved["thumbnail"])
    return row


def _row(
    name: str, title: str, recipe: Recipe, tracker: str, summary: dict[str, Any], position: int, computed: int
) -> RunRow:
    """Return a saved run without bookmarks."""
    return RunRow(
        id=name,
        title=title,
        experiment=recipe.experiment,
        tracker=tracker,
        seed=recipe.seed,
        frames=summary["frames"],
        position=position,
        computed=computed,
        outcome=outcome(summary),
        summary=summary,
        bookmarks=[],
        created=now(),
    )


async def bring_in(house: House, folder: Path, received: Received) -> ImportJob:
    """Begin to import a record; a confined process computes its run first.

    Args:
        house: The server's services for runs.
        folder: Folder of the record; it is removed.
        received: The file.

    Raises:
        RefusedError: The file cannot be read as a record.
        ApiError: Too many jobs are running (503).
    """

    def drop() -> None:
        shutil.rmtree(folder, ignore_errors=True)

    try:
        house.jobs.check_room(ImportJob)
        path = received.paths[0]
        saved = Record.model_validate(await house.tasks.run(functions.read_record, str(path)))

        async def work(on_step: OnStep) -> RunPublic:
            row = await _weigh(house, saved, path, received.names[0], on_step)
            drop()
            return RunPublic.model_validate(row)

        return house.jobs.begin(ImportJob(id=new_name(), name=received.names[0]), work, drop=drop)
    except BaseException:
        drop()
        raise


async def _weigh(house: House, saved: Record, path: Path, name: str, on_step: OnStep) -> RunRow:
    """Compute the run of a record, and store it."""
    store, settings, footage = house.store, house.settings, saved.recipe.footage
    upload = await asyncio.to_thread(store.upload_of, footage.sha256) if footage and footage.sha256 else None
    recording = upload and await recording_of(store, settings, house.tasks, upload.id)
    filters = await asyncio.to_thread(store.files.filters_of, saved.recipe)
    found = await house.compute(on_step, functions.weigh_record, str(path), recording, settings.max_frames, filters)
    summary = found["summary"]
    last = min(saved.computed, summary["frames"]) - 1
    row = _row(
        new_name(), name.removesuffix(".pft") or found["title"], saved.recipe, summary["tracker"], summary, last, last
    )
    await asyncio.to_thread(settle, path, store.files.record(row.id))
    await asyncio.to_thread(store.add_run, row, found["thumbnail"])
    return row


async def fit(house: House, session: Session, names: tuple[str, ...]) -> FitJob:
    """Begin to fit parameters to the computed frames of a session's active branch; the session continues.

    Raises:
        ApiError: Too many jobs are running (503).
    """
    config = await house.config(session.spec)

    async def work(on_step: OnStep) -> Fit:
        return FIT.validate_python(await house.compute(on_step, functions.fit_run, config, names))

    return house.jobs.begin(FitJob(id=new_name(), name=", ".join(names)), work)


async def compare(store: Store, tasks: ChildTasks, row: RunRow, session: Session) -> None:
    """Add a remark if a session that continues a saved run has other numbers than the run."""
    estimates = session.columns(session.spec.branch).get("estimate", [])
    session.keep(remark=await tasks.run(functions.compare_record, str(store.files.record(row.id)), estimates))


def outcome(summary: dict[str, Any]) -> str:
    """Return a run's outcome in a few words, by the measure that decided on its success."""
    frames, lost = summary["frames"], summary.get("lost_frames")
    if summary.get("success") is None:
        return f"{frames} frames"
    decisive = summary.get("success_measure", HIT_RATE.name)
    if decisive != HIT_RATE.name:
        measure = find_experiment(summary["experiment"]).measure_named(decisive)
        # The measure's title names its frames: the last ten of a run may decide.
        title = f"{measure.title[:1].lower()}{measure.title[1:]}"
        return f"{100 * summary[decisive]:.0f} % {title}, {frames} frames in all"
    return loss_words(frames, lost or 0, summary.get("first_lost_frame"))


async def export_run(
    house: House, spec: SessionSpec, title: str, export: str, plot: str | None, what_if: Mapping[str, Any] | None = None
) -> ExportJob:
    """Begin to write a file of a run.

    Args:
        house: The server's services for runs.
        spec: Spec of the run, with its computed frames and its position.
        title: Title of the run.
        export: Name of the export.
        plot: Id of the one plot that a picture shall show; None for all.
        what_if: The what-if record of the run, if there is one.

    Raises:
        ApiError: The export is unknown (404).
        ConflictError: The plot is unknown.
        ApiError: The disk has no room (507), or too many jobs are running (503).
    """
    experiment = find_experiment(spec.recipe.experiment)
    kind = _find(exports_of(experiment), export)
    check_plot(experiment, kind, plot)
    frame = spec.run.position if kind.group == "model" else spec.run.computed
    name = "-".join(filter(None, (run_file_name(experiment.id, title), str(frame), plot)))
    return _begin_export(house, kind, name, functions.write_export, await house.config(spec), kind.name, plot, what_if)


async def export_comparison(house: House, runs: Sequence[ComparedRun], title: str, export: str) -> ExportJob:
    """Begin to write a comparison as a file, named by a title or else by its runs.

    Raises:
        ApiError: The export or one of the runs does not exist (404); the disk has no room (507); or the runs cannot be
            compared, see `prepare`.
    """
    _, configs, outline = await prepare(house, runs)
    kind = _find(COMPARISON_FORMATS, export)
    name = _slug(f"compare {title or ' '.join(outline.names)}")
    return _begin_export(house, kind, name, functions.write_comparison, configs, kind.name)


def _begin_export(
    house: House, kind: RunExport | ComparisonExport, name: str, function: Callable[..., Any], *arguments: object
) -> ExportJob:
    """Begin to write a file, in a folder of its own with the job's name."""
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
    """Return the file name of a run: its experiment, and its name if that adds anything."""
    known = EXPERIMENTS.get(experiment)
    titles = (known.video.clip_title, known.title) if known else ()
    rest = next((name.removeprefix(title) for title in titles if title and name.startswith(title)), name)
    return "-".join(filter(None, (experiment, _slug(rest))))


def _slug(text: str) -> str:
    """Return a text in a form for file names."""
    return re.sub(r"[^\w.]+", "-", text.lower()).strip("-.")[:LONGEST]


def _find(offered: Iterable[N], name: str) -> N:
    try:
        return find_export(offered, name)
    except RefusedError as error:
        raise not_found(str(error)) from None
