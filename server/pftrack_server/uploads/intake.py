"""Intake: from newly arrived files to a usable upload.

Every frame is decoded once, in a confined process, before an upload can be used; files that fail are deleted. An
untrusted file may crash a decoder, keep it busy for ever, or unpack to more memory than there is. The outcome is always
an index of its frames, or a `RefusedError` with a sentence.
"""

import asyncio
import contextlib
import re
import threading
from collections.abc import Callable, Container, Coroutine, Mapping
from dataclasses import replace
from itertools import chain, count
from pathlib import Path
from typing import Any, Final, ParamSpec, TypeVar

import structlog

from pftrack.core.model.source import FrameIndex
from pftrack.core.refusal import ConflictError, RefusedError
from pftrack.process import MEBIBYTE, Budget, Ending
from pftrack.sources.limits import DEFAULT_LIMITS, HEAD_BYTES, Limits, natural_order
from pftrack.sources.results.parts import part_names
from pftrack.sources.results.writing import LARGEST_FILE_BYTES
from pftrack.sources.sequence import Recording
from pftrack_server.core.errors import disk_full
from pftrack_server.core.resource_limits import mebibytes
from pftrack_server.core.settings import Settings
from pftrack_server.jobs.child_tasks import ChildTasks, ending_message
from pftrack_server.jobs.functions import index_frames
from pftrack_server.store.database import UploadRow
from pftrack_server.store.files import new_name, now
from pftrack_server.store.store import Store
from pftrack_server.uploads.multipart import LONGEST_NAME, Received

BUDGET = Budget(cpu_seconds=120, silence_s=240, file_bytes=0, answer_bytes=8 * MEBIBYTE)


async def probe(
    tasks: ChildTasks,
    path: Path,
    limits: Limits,
    *,
    budget: Budget = BUDGET,
    columns: Mapping[str, int] | None = None,
    stopped: Callable[[], bool] | None = None,
) -> FrameIndex:
    """Decode a sequence of pictures once, in a process of its own, without waiting in a queue.

    Args:
        tasks: Runs the process.
        path: The file or folder.
        limits: Limits of its size.
        budget: Limits of decoding.
        columns: Column numbers of a table by their meaning; its header is rewritten to name them.
        stopped: Called ten times a second; returns true to stop decoding.

    Raises:
        RefusedError: The file is not a sequence of pictures, is broken, exceeds the limits, or crashes its decoder.
        ApiError: Decoding took too long, or was stopped (503).
    """
    if columns is not None:
        budget = replace(budget, file_bytes=LARGEST_FILE_BYTES)
    question = str(path), limits, budget.memory_bytes, columns
    answer = await tasks.run_beside(index_frames, *question, budget=budget, stopped=stopped)
    try:
        return FrameIndex.from_json(str(answer))
    except ValueError:
        # A decoder that a hostile file controls may answer anything.
        raise RefusedError(ending_message(Ending.CRASHED, budget)) from None


LIGHT_BYTES: Final = 16 * MEBIBYTE
"""Size up to which an upload is probably decoded in a moment, bytes."""
BYTES_A_SECOND: Final = MEBIBYTE
"""Decoding speed of a slow machine, bytes/s."""

Given = ParamSpec("Given")
Result = TypeVar("Result")

log = structlog.get_logger(__name__)


def limits_of(settings: Settings) -> Limits:
    """Return the limits of a sequence on this server."""
    return replace(
        DEFAULT_LIMITS, frames=settings.max_frames, pixels=settings.max_pixels, file_bytes=settings.max_upload_bytes
    )


def check_room(store: Store, settings: Settings, wanted_bytes: int) -> None:
    """Make sure that there is room for one more upload.

    Raises:
        ConflictError: The limit of uploads is reached.
        ApiError: All uploads together would be too large (507).
    """
    if store.count(UploadRow) >= settings.max_uploads:
        raise ConflictError(f"The server keeps at most {settings.max_uploads} uploads; delete one first.")
    used = store.uploads_bytes()
    if used + wanted_bytes > settings.max_uploads_bytes:
        raise disk_full(
            f"Uploads take {mebibytes(used)} of {mebibytes(settings.max_uploads_bytes)}, and this one has "
            f"{mebibytes(wanted_bytes)}; delete one first."
        )


async def recording_of(store: Store, settings: Settings, tasks: ChildTasks, upload: str) -> Recording:
    """Return an upload with its index; if the index is damaged or missing, decode the upload again.

    Raises:
        RefusedError: The upload itself is damaged.
        ApiError: Decoding it again takes too long (503).
    """
    path, limits = store.files.upload(upload), limits_of(settings)
    text = await asyncio.to_thread(_read_index, store, upload)
    if text is None:
        log.warning("the index of an upload is damaged or missing; the upload is decoded again", upload=upload)
        text = (await probe(tasks, path, limits)).to_json()
        with contextlib.suppress(OSError):
            await asyncio.to_thread(store.files.keep_index, upload, text)
    return Recording(str(path), text, limits)


def _read_index(store: Store, upload: str) -> str | None:
    try:
        text = store.files.index(upload)
        FrameIndex.from_json(text)
    except (OSError, ValueError):
        return None
    return text


async def take_in(
    store: Store,
    settings: Settings,
    tasks: ChildTasks,
    folder: Path,
    received: Received,
    stopped: Callable[[], bool],
    ticket: str | None = None,
    columns: Mapping[str, int] | None = None,
) -> UploadRow:
    """Decode arrived files and store them, unless the server stops or the client leaves meanwhile.

    Args:
        store: The store.
        settings: The server's limits.
        tasks: Decodes them in turn; small ones pass large ones.
        folder: Folder of the files.
        received: The files.
        stopped: Called at intervals; returns true to give up.
        ticket: Name with which the client asks for its place in the queue.
        columns: Column numbers of a table by their meaning, as a person chose.

    Raises:
        RefusedError: The files are not a sequence of pictures, or exceed the limits.
        ConflictError: The limit of uploads is reached.
        ApiError: There is no room for this upload (507).
    """
    await asyncio.to_thread(check_room, store, settings, received.size_bytes)
    content, names, title = await _to_the_end(_arrange, folder, received, by_hand=columns is not None)

    def look() -> Coroutine[Any, Any, FrameIndex]:
        return probe(tasks, content, limits_of(settings), columns=columns, stopped=stopped)

    heavy_s = received.size_bytes / BYTES_A_SECOND
    try:
        if received.size_bytes > LIGHT_BYTES:
            async with tasks.queues.heavy.place(ticket, weight_s=heavy_s):
                found = await look()
        else:
            found = await tasks.queues.take_turn(look, ticket, weight_s=heavy_s)
    except RefusedError as error:
        # The message names files by their original names.
        error.args = (re.sub(r"\b\d{6}\b", lambda found: names.get(found[0], found[0]), str(error)),)
        raise

    def keep() -> UploadRow:
        with _keeping:
            check_room(store, settings, received.size_bytes)
            return _keep(store, _row(found, received, title), found, content)

    return await _to_the_end(keep)


async def _to_the_end(work: Callable[Given, Result], *arguments: Given.args, **options: Given.kwargs) -> Result:
    """Run work in a thread and return only after its end, even if cancelled meanwhile."""
    working = asyncio.ensure_future(asyncio.to_thread(work, *arguments, **options))
    try:
        return await asyncio.shield(working)
    except asyncio.CancelledError:
        await asyncio.wait((working,))
        raise


_keeping = threading.Lock()
"""Without it, two concurrent uploads would both find the last place free."""


def _keep(store: Store, row: UploadRow, index: FrameIndex, content: Path) -> UploadRow:
    row.name = _free_name(row.name, {each.name for each in store.all(UploadRow)})
    target = store.files.upload(row.id)
    target.parent.mkdir(mode=0o700)
    try:
        store.files.keep_index(row.id, index.to_json())
        content.replace(target)
        store.add(row)
    except BaseException:
        store.files.remove("uploads", row.id)
        raise
    return row


def _free_name(name: str, taken: Container[str]) -> str:
    """Return a name, with the first free number if it is taken: "walk.mp4 (2)"."""
    numbered = (f"{name[: LONGEST_NAME - 10]} ({number})" for number in count(2))
    return next(each for each in chain([name[:LONGEST_NAME]], numbered) if each not in taken)


def _arrange(folder: Path, received: Received, *, by_hand: bool) -> tuple[Path, dict[str, str], str]:
    """Return the path of one file, or a folder of several: results with their clip, or pictures in order.

    Pictures are in the natural order of their names. Also returned are a mapping from the names in the folder to the
    original ones, and a title for the whole. No message names a single file; a name in a message comes from the file
    itself.

    Raises:
        RefusedError: The files do not belong together.
    """
    files = dict(zip(received.names, received.paths, strict=True))
    if len(received.paths) == 1:
        return received.paths[0], {}, received.names[0]
    inside = folder / "files"
    inside.mkdir()
    if (parts := part_names({name: _head(path) for name, path in files.items()}, by_hand=by_hand)) is not None:
        for part, name in parts.items():
            files[name].rename(inside / part)
        return inside, {}, f"{parts['results']} on {parts['clip']}" if "clip" in parts else parts["results"]
    named = sorted(zip(received.names, received.paths, strict=True), key=lambda pair: natural_order(pair[0]))
    for number, (_, path) in enumerate(named):
        path.rename(inside / f"{number:06d}")
    title = f"{received.names[0]} and {len(received.names) - 1} more"
    return inside, {f"{number:06d}": name for number, (name, _) in enumerate(named)}, title


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(HEAD_BYTES)


def _row(found: FrameIndex, received: Received, title: str) -> UploadRow:
    return UploadRow(
        id=new_name(),
        name=title,
        kind=found.kind,
        frames=found.frame_count,
        width=found.width,
        height=found.height,
        frame_rate_hz=found.frame_rate_hz,
        duration_s=found.duration_s,
        sha256=found.sha256,
        warnings=list(found.warnings),
        size_bytes=received.size_bytes,
        created=now(),
    )
