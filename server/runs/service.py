"""Saving: from a session to a record that can be downloaded, sent, brought in elsewhere and opened again."""

import asyncio
import shutil
from pathlib import Path
from typing import Any

from pftrack.runs.record import Record
from server.errors import ConflictError
from server.schemas.spec import Bookmark, BranchSpec, ChangeModel, SessionSpec
from server.sessions.create import FIRST
from server.sessions.session import Session
from server.settings import Settings
from server.store import Store
from server.store.files import new_name, now
from server.store.tables import RunRow
from server.tasks.child_tasks import ChildTasks
from server.tasks.functions import read_record, weigh_record
from server.uploads.intake import limits_of
from server.uploads.multipart import Received

__all__ = ["bring_in", "outcome", "reopen", "save"]


async def save(store: Store, session: Session, title: str | None) -> RunRow:
    """Save the active branch of a session: its record, a picture, and what came of it."""
    name = new_name()
    branch = session.spec.active
    saved = await session.save(str(store.files.record(name)))
    summary = saved["summary"]
    row = RunRow(
        id=name,
        title=title or f"{session.card.title} · {session.card.trackers.get(branch.tracker, branch.tracker)}",
        experiment=session.spec.experiment,
        tracker=branch.tracker,
        seed=session.spec.seed,
        frames=summary["frames"],
        position=branch.position,
        head=branch.head,
        outcome=outcome(summary),
        summary=summary,
        bookmarks=[mark.model_dump() for mark in session.spec.bookmarks if mark.branch == branch.id],
        created=now(),
    )
    await asyncio.to_thread(store.add_run, row, saved["thumbnail"])
    return row


async def bring_in(store: Store, tasks: ChildTasks, settings: Settings, folder: Path, received: Received) -> RunRow:
    """Keep a record that was sent, once it has been read in a confined process.

    Raises:
        RefusedError: It is no record, or one that cannot be opened here.
    """
    try:
        found = await tasks.run(weigh_record, str(received.paths[0]), await _videos(store), limits_of(settings))
        saved, summary = Record.model_validate(found["record"]), found["summary"]
        row = RunRow(
            id=new_name(),
            title=received.names[0].removesuffix(".pft") or found["title"],
            experiment=saved.experiment,
            tracker=saved.tracker,
            seed=saved.seed,
            frames=summary["frames"],
            position=saved.computed - 1,
            head=saved.computed - 1,
            outcome=outcome(summary),
            summary=summary,
            bookmarks=[],
            created=now(),
        )
        received.paths[0].replace(store.files.record(row.id))
        await asyncio.to_thread(store.add_run, row, found["thumbnail"])
        return row
    finally:
        await asyncio.to_thread(shutil.rmtree, folder, ignore_errors=True)


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
    branch = BranchSpec(
        id=FIRST,
        title="Main",
        tracker=saved.tracker,
        first_tracker=saved.tracker,
        timeline=[ChangeModel(frame=change.frame, values=change.values) for change in saved.timeline],
        head=saved.computed - 1,
        position=min(row.position, saved.computed - 1),
    )
    return SessionSpec(
        id=new_name(),
        experiment=saved.experiment,
        seed=saved.seed,
        frames=saved.frames,
        branch=FIRST,
        branches={FIRST: branch},
        bookmarks=[Bookmark(**{**mark, "branch": FIRST}) for mark in row.bookmarks],
        created=now(),
        **await _recording(store, saved.reference),
    )


async def _recording(store: Store, reference: dict[str, Any]) -> dict[str, Any]:
    """Return what a spec says of the recording of a saved run."""
    if reference.get("kind") == "simulated":
        return {}
    upload = await asyncio.to_thread(store.upload_of, str(reference.get("sha256")))
    if upload is None:
        name = reference.get("name", "a recording")
        raise ConflictError(f"The run was made on {name}, which is not here any more; upload it first.")
    return {
        "upload": upload.id,
        "upload_name": upload.name,
        "box": None if reference.get("points") else reference["box"],
        "points": reference.get("points") or None,
        "start": reference["start"],
        "truth": reference.get("truth") or None,
    }


def outcome(summary: dict[str, Any]) -> str:
    """Say in a few words what came of a run."""
    frames, lost = summary["frames"], summary.get("lost_frames")
    if summary.get("success") is None:
        return f"{frames} frames"
    if not lost:
        return f"Kept for {frames} frames"
    return f"Lost in {lost} of {frames} frames, first in frame {summary['first_lost_frame']}"


async def _videos(store: Store) -> dict[str, tuple[str, str | None]]:
    return await asyncio.to_thread(store.videos)
