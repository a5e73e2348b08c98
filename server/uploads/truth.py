"""Truths: tables of what is truly so in an upload, read once in a confined process and kept beside it.

A truth belongs to an upload and a kind of truth, so that every session that begins on that upload is measured by it,
whoever begins it.
"""

import asyncio
import json
import shutil
from pathlib import Path
from typing import Any

from pftrack.experiment import Experiment
from pftrack.files import write_whole
from server.errors import ConflictError
from server.schemas.uploads import TruthPublic
from server.store import Store
from server.store.tables import UploadRow
from server.tasks.child_tasks import ChildTasks
from server.tasks.functions import read_truth
from server.uploads.multipart import Received

__all__ = ["forget_truth", "keep_truth", "kept_truth", "rows_of"]


async def keep_truth(
    store: Store, tasks: ChildTasks, upload: UploadRow, experiment: Experiment, folder: Path, received: Received
) -> TruthPublic:
    """Keep a table that has just arrived, in place of one of its kind that was there.

    Raises:
        RefusedError: It is no such table, or has nothing to say of this upload.
        ConflictError: The upload was deleted while the table was read.
    """
    try:
        read = await tasks.run(read_truth, str(received.paths[0]), experiment.id, upload.frames)
    finally:
        await asyncio.to_thread(shutil.rmtree, folder, ignore_errors=True)
    try:
        await asyncio.to_thread(write_whole, _place(store, upload.id, experiment), json.dumps(read).encode())
    except FileNotFoundError:
        raise ConflictError("The upload was deleted in the meantime.") from None
    return TruthPublic(**read)


def kept_truth(store: Store, upload: str, experiment: Experiment) -> TruthPublic | None:
    """Return in short what is kept, if anything is."""
    kept = _kept(store, upload, experiment)
    return TruthPublic(**kept) if kept else None


def rows_of(store: Store, upload: str, experiment: Experiment) -> dict[int, tuple[float, ...]] | None:
    """Return what is kept, by number of the frame, if anything is."""
    kept = _kept(store, upload, experiment)
    return {int(frame): tuple(row) for frame, row in kept["rows"].items()} if kept else None


def forget_truth(store: Store, upload: str, experiment: Experiment) -> None:
    """Keep it no longer."""
    _place(store, upload, experiment).unlink(missing_ok=True)


def _kept(store: Store, upload: str, experiment: Experiment) -> dict[str, Any] | None:
    try:
        kept: dict[str, Any] = json.loads(_place(store, upload, experiment).read_bytes())
    except FileNotFoundError:
        return None
    return kept


def _place(store: Store, upload: str, experiment: Experiment) -> Path:
    return store.files.truth(upload, experiment.truth.form.several if experiment.truth else "none")
