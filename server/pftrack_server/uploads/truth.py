"""Truths: truth tables of uploads, read once in a confined process and stored next to the upload.

A truth belongs to an upload and a kind of truth: every session that begins on that upload is measured by it, no matter
who begins it.
"""

import asyncio
import shutil
from pathlib import Path

import structlog
from pydantic import BaseModel, Field

from pftrack.core.files import write_whole
from pftrack.core.refusal import ConflictError
from pftrack.experiments.experiment import Experiment
from pftrack.sources.truth import write_table
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.jobs.functions import read_truth
from pftrack_server.store import Store
from pftrack_server.store.database import UploadRow
from pftrack_server.uploads.multipart import Received


class TruthPublic(BaseModel):
    """Summary of an upload's truth."""

    frames: int = Field(description="Number of frames with truth")
    first: int
    last: int
    warnings: list[str]


log = structlog.get_logger(__name__)


class StoredTruth(TruthPublic):
    """The stored truth of an upload: the summary, which alone is returned to clients, and the rows by frame number."""

    rows: dict[int, tuple[float, ...]]


async def store_truth(
    store: Store, tasks: ChildTasks, upload: UploadRow, experiment: Experiment, folder: Path, received: Received
) -> TruthPublic:
    """Store an arrived table, in place of an earlier one of its kind.

    Raises:
        RefusedError: The table is of another kind, or has no frame of this upload.
        ConflictError: The upload was deleted while the table was read.
    """
    try:
        path, size = str(received.paths[0]), (upload.width, upload.height)
        read = StoredTruth(**await tasks.run(read_truth, path, experiment.id, upload.frames, size))
    finally:
        await asyncio.to_thread(shutil.rmtree, folder, ignore_errors=True)
    try:
        content = read.model_dump_json().encode()
        await asyncio.to_thread(write_whole, _place(store, upload.id, experiment), content)
    except FileNotFoundError:
        raise ConflictError("The upload was deleted in the meantime.") from None
    return read


def rows_of(store: Store, upload: str, experiment: Experiment) -> dict[int, tuple[float, ...]] | None:
    """Return the stored truth by frame number, or None."""
    kept = load_truth(store, upload, experiment)
    return kept.rows if kept else None


def table_of(store: Store, upload: str, experiment: Experiment) -> str | None:
    """Return the stored truth as the text of a file that can be uploaded again, or None."""
    rows = rows_of(store, upload, experiment)
    return write_table(rows, experiment.video.truth.form) if rows and experiment.video.truth else None


def discard_truth(store: Store, upload: str, experiment: Experiment) -> None:
    """Delete the stored truth."""
    _place(store, upload, experiment).unlink(missing_ok=True)


def load_truth(store: Store, upload: str, experiment: Experiment) -> StoredTruth | None:
    """Return the stored truth, or None."""
    place = _place(store, upload, experiment)
    try:
        return StoredTruth.model_validate_json(place.read_bytes())
    except FileNotFoundError:
        return None
    except ValueError:
        log.warning("the truth of an upload is damaged and ignored; upload it again", upload=upload)
        return None


def _place(store: Store, upload: str, experiment: Experiment) -> Path:
    return store.files.truth(upload, experiment.video.truth.form.several if experiment.video.truth else "none")
