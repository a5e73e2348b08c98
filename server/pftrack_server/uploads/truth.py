"""Truths: tables of what is truly so in an upload, read once in a confined process and kept beside it.

A truth belongs to an upload and a kind of truth, so that every session that begins on that upload is measured by it,
no matter who begins it.
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
    """Summary of the truth that is known of an upload."""

    frames: int = Field(description="How many frames there is truth of")
    first: int
    last: int
    warnings: list[str]


log = structlog.get_logger(__name__)


class StoredTruth(TruthPublic):
    """What is kept beside an upload: the summary, which alone is answered, and the rows by number of the frame."""

    rows: dict[int, tuple[float, ...]]


async def store_truth(
    store: Store, tasks: ChildTasks, upload: UploadRow, experiment: Experiment, folder: Path, received: Received
) -> TruthPublic:
    """Keep a table that has just arrived, in place of one of its kind that was there.

    Raises:
        RefusedError: The table is of another kind, or says nothing of this upload.
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
    """Return what is kept, by number of the frame, if anything is."""
    kept = load_truth(store, upload, experiment)
    return kept.rows if kept else None


def table_of(store: Store, upload: str, experiment: Experiment) -> str | None:
    """Return what is kept as the text of a file that may be given again, if anything is."""
    rows = rows_of(store, upload, experiment)
    return write_table(rows, experiment.video.truth.form) if rows and experiment.video.truth else None


def discard_truth(store: Store, upload: str, experiment: Experiment) -> None:
    """Keep it no longer."""
    _place(store, upload, experiment).unlink(missing_ok=True)


def load_truth(store: Store, upload: str, experiment: Experiment) -> StoredTruth | None:
    """Return what is kept, if anything is."""
    place = _place(store, upload, experiment)
    try:
        return StoredTruth.model_validate_json(place.read_bytes())
    except FileNotFoundError:
        return None
    except ValueError:
        log.warning("the truth of an upload is damaged and left out; send it again", upload=upload)
        return None


def _place(store: Store, upload: str, experiment: Experiment) -> Path:
    return store.files.truth(upload, experiment.video.truth.form.several if experiment.video.truth else "none")
