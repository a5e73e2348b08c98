"""Saving: from a session to a record that can be downloaded, sent, brought in elsewhere and opened again."""

import asyncio
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pftrack.core.files import settle
from pftrack.core.model.measures import HIT_RATE
from pftrack.core.model.recipe import Footage
from pftrack.experiments import find
from pftrack.runs.loss import loss_words
from pftrack.runs.record import Record
from pftrack_server.errors import ConflictError, DiskFullError
from pftrack_server.schemas.snapshot import FIRST, Bookmark
from pftrack_server.schemas.spec import SessionSpec
from pftrack_server.sessions.create import new_spec
from pftrack_server.sessions.session import Session
from pftrack_server.settings import Settings
from pftrack_server.store import Store
from pftrack_server.store.disk_budget import mebibytes
from pftrack_server.store.files import new_name, now
from pftrack_server.store.tables import RunRow
from pftrack_server.tasks.child_tasks import ChildTasks
from pftrack_server.tasks.functions import compare_record, read_record, weigh_record
from pftrack_server.uploads.intake import index_of, limits_of
from pftrack_server.uploads.multipart import Received


def check_room(store: Store, settings: Settings) -> None:
    """Make sure that there is a place for one more saved run.

    Raises:
        ConflictError: There are as many as there may be.
        DiskFullError: All together are as large as they may be, or the disk has no room.
    """
    store.disk_budget.check()
    if store.count(RunRow) >= settings.max_runs:
        raise ConflictError(f"The server keeps at most {settings.max_runs} saved runs; delete one first.")
    used = store.files.runs_bytes()
    if used >= settings.max_runs_bytes:
        raise DiskFullError(
            f"The saved runs have {mebibytes(used)}, and all together may have {mebibytes(settings.max_runs_bytes)}; "
            "delete one first."
        )


async def save(store: Store, session: Session, title: str | None) -> RunRow:
    """Save the active branch of a session: its record, a picture, and what came of it."""
    name = new_name()
    run = session.spec.run
    saved = await session.save(str(store.files.record(name)))
    summary = saved["summary"]
    row = RunRow(
        id=name,
        title=title or f"{session.state.snapshot.name} · {session.description.tracker_title(run.tracker)}",
        experiment=run.recipe.experiment,
        tracker=run.tracker,
        seed=run.recipe.seed,
        frames=summary["frames"],
        position=run.position,
        computed=run.computed,
        outcome=outcome(summary),
        summary=summary,
        bookmarks=[mark.model_dump() for mark in session.spec.bookmarks if mark.branch == run.branch],
        created=now(),
    )
    await asyncio.to_thread(store.add_run, row, saved["thumbnail"])
    return row


async def bring_in(
    store: Store,
    tasks: ChildTasks,
    settings: Settings,
    folder: Path,
    received: Received,
    on_step: Callable[[int, int], None],
) -> RunRow:
    """Keep a record that was sent, once its run has been computed in a confined process.

    Args:
        store: Where to keep it.
        tasks: Where to compute it.
        settings: What is allowed.
        folder: Where it is; it is removed.
        received: The file.
        on_step: Called now and then with the frames computed and with all that there are to compute.

    Raises:
        RefusedError: It is no record, or one that cannot be opened here.
    """
    try:
        path = str(received.paths[0])
        saved = Record.model_validate(await tasks.run(read_record, path))
        video = await footage_here(store, settings, tasks, saved.recipe.footage)
        filters = await asyncio.to_thread(store.files.filters_of, saved.recipe)
        found = await tasks.run_long(
            weigh_record,
            path,
            video,
            limits_of(settings),
            filters,
            cpu_seconds=settings.worker_cpu_seconds,
            on_step=on_step,
        )
        summary = found["summary"]
        last = min(saved.computed, summary["frames"]) - 1
        row = RunRow(
            id=new_name(),
            title=received.names[0].removesuffix(".pft") or found["title"],
            experiment=saved.recipe.experiment,
            tracker=summary["tracker"],
            seed=saved.recipe.seed,
            frames=summary["frames"],
            position=last,
            computed=last,
            outcome=outcome(summary),
            summary=summary,
            bookmarks=[],
            created=now(),
        )
        await asyncio.to_thread(settle, received.paths[0], store.files.record(row.id))
        await asyncio.to_thread(store.add_run, row, found["thumbnail"])
        return row
    finally:
        await asyncio.to_thread(shutil.rmtree, folder, ignore_errors=True)


async def compare(store: Store, tasks: ChildTasks, row: RunRow, session: Session) -> None:
    """Have a session that goes on with a saved run say so if it has come to other numbers."""
    estimates = session.state.columns(session.spec.branch).get("estimate", [])
    session.state.note(await tasks.run(compare_record, str(store.files.record(row.id)), estimates))


async def reopen(store: Store, tasks: ChildTasks, row: RunRow) -> SessionSpec:
    """Return the spec of a session that goes on with a saved run.

    Raises:
        RefusedError: The record cannot be read.
        ConflictError: Its file or its video is not here.
    """
    path = store.files.record(row.id)
    if not path.exists():
        raise ConflictError("The file of this run is missing.")
    saved = Record.model_validate(await tasks.run(read_record, str(path)))
    footage = saved.recipe.footage
    upload = await asyncio.to_thread(store.upload_of, footage.sha256 or "") if footage else None
    if footage is not None and upload is None:
        name = footage.name or "a recording"
        raise ConflictError(f"The run was made on {name}, which is no longer on this server; upload it first.")
    return new_spec(
        saved.recipe.with_footage(name=upload.name) if upload else saved.recipe,
        upload=upload.id if upload else None,
        position=min(row.position, saved.computed - 1),
        computed=saved.computed - 1,
        bookmarks=[Bookmark(**{**mark, "branch": FIRST}) for mark in row.bookmarks],
    )


def outcome(summary: dict[str, Any]) -> str:
    """Say in a few words what came of a run, by the measure that decided on its success."""
    frames, lost = summary["frames"], summary.get("lost_frames")
    if summary.get("success") is None:
        return f"{frames} frames"
    decisive = summary.get("success_measure", HIT_RATE.name)
    if decisive != HIT_RATE.name:
        measure = find(summary["experiment"]).measure_named(decisive)
        # In which frames is for the measure's title to say: the last ten of a run may decide.
        title = f"{measure.title[:1].lower()}{measure.title[1:]}"
        return f"{100 * summary[decisive]:.0f} % {title}, {frames} frames in all"
    return loss_words(frames, lost or 0, summary.get("first_lost_frame"))


async def footage_here(
    store: Store, settings: Settings, tasks: ChildTasks, footage: Footage | None
) -> tuple[str, str] | None:
    """Return path and index of the upload that a run was made on, if it is here."""
    if footage is None or not footage.sha256:
        return None
    upload = await asyncio.to_thread(store.upload_of, footage.sha256)
    if upload is None:
        return None
    return str(store.files.upload(upload.id)), await index_of(store, settings, tasks, upload.id)
