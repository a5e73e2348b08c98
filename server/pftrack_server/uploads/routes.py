"""Routes of uploads: videos, GIFs, sets of pictures and tables; every frame is decoded before use."""

import asyncio
import re
import shutil
import threading
from http import HTTPStatus
from typing import Annotated, Any, TypeVar

from fastapi import APIRouter, Depends, Path, Query, Request
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError
from starlette.responses import Response

from pftrack.core.model.setup import Grade
from pftrack.core.refusal import RefusedError
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.experiment import Experiment
from pftrack.sources.results.table import Preview, preview
from pftrack.sources.truth import LARGEST_FILE_BYTES
from pftrack_server.core import requests
from pftrack_server.core.bodies import RequestBody
from pftrack_server.core.errors import not_found
from pftrack_server.core.requests import MULTIPART, AName, SettingsNow, TakesFiles, Ticket, service
from pftrack_server.jobs.child_tasks import TheTasks
from pftrack_server.jobs.functions import TargetSearch, find_mark, frame_jpeg, weigh_target
from pftrack_server.store.database import UploadRow
from pftrack_server.store.store import AStore
from pftrack_server.uploads.intake import check_room, recording_of, take_in
from pftrack_server.uploads.multipart import receive
from pftrack_server.uploads.truth import TruthPublic, discard_truth, load_truth, store_truth, table_of

Read = TypeVar("Read")


class SuitabilityPublic(BaseModel):
    """A judgement, before tracking, whether a target can be followed."""

    value: float = Field(description="Suitability, 0 to 1, higher is better")
    grade: Grade = Field(description="Suitability in words")
    remark: str = Field(description="Finding, a sentence")
    advice: list[str] = Field(description="Advice, a sentence each")
    better: dict[str, Any] | None = Field(description="A better mark of the same target; null if unknown")
    picture: str | None = Field(description="Likelihood over the picture as a data URL; null if unavailable")


class UploadPublic(BaseModel):
    """An upload and its content."""

    model_config = ConfigDict(from_attributes=True)

    id: str
    name: str
    kind: str
    frames: int
    width: int
    height: int
    frame_rate_hz: float
    duration_s: float
    sha256: str
    warnings: list[str]
    size_bytes: int
    created: str


class TableHead(RequestBody):
    """The beginning of a table with unknown column names."""

    text: Annotated[str, Field(max_length=65_536, description="Its first lines")]


class SightingPublic(BaseModel):
    """The result of a search for a target in an upload.

    While `mark` is null and `looked` is less than `of`, the search can continue.
    """

    frame: int = Field(description="Frame where it was found, or the last searched frame")
    mark: dict[str, Any] | None = Field(description="The found target's mark; null if it was not found")
    placed: list[str] = Field(description="Handles of the mark placed by a model, not found in the picture")
    remarks: list[str] = Field(description="Points to check, or why nothing was found")
    looked: int = Field(description="Number of searched frames")
    of: int = Field(description="Number of frames to search")


router = APIRouter(prefix="/uploads", tags=["uploads"])

KEPT_S = 600
"""How long a browser may cache the judgement of a target, s."""

Number = Annotated[int, Query(ge=0, le=10_000_000)]


def _upload(upload: AName, store: AStore) -> UploadRow:
    return store.find(UploadRow, upload)


AnUpload = Annotated[UploadRow, Depends(_upload)]


def _experiment(experiment: Annotated[str, Query(max_length=64)]) -> Experiment:
    found = EXPERIMENTS.get(experiment)
    if found is None or not found.accepts_video:
        able = ", ".join(each.id for each in EXPERIMENTS.values() if each.accepts_video)
        raise RefusedError(f"Experiment must be one that takes a video: {able}.", field="experiment", value=experiment)
    return found


ForExperiment = Annotated[Experiment, Depends(_experiment)]


Mark = Annotated[str, Query(max_length=10_000, description="A mark of one of the experiment's kinds, as JSON")]
Hint = Annotated[str | None, Query(max_length=10_000, description="A mark of one of the experiment's hints, as JSON")]
Columns = Annotated[
    str | None,
    Query(max_length=1000, description="Column numbers of a table by meaning, as JSON; see `/uploads/table`"),
]
MARK, PLACES = TypeAdapter(dict[str, Any]), TypeAdapter(dict[str, int])


def _read(field: str, text: str, form: TypeAdapter[Read]) -> Read:
    """Read the JSON object in a query parameter."""
    try:
        return form.validate_json(text)
    except ValidationError:
        what = "a mark" if form is MARK else "column numbers by meaning"
        raise RefusedError(f"{field.capitalize()} must be {what} as a JSON object.", field, value=text) from None


@router.post("", status_code=HTTPStatus.CREATED, openapi_extra=MULTIPART, dependencies=[TakesFiles])
async def add_upload(
    request: Request,
    store: AStore,
    settings: SettingsNow,
    stopping: Annotated[threading.Event, service(threading.Event)],
    tasks: TheTasks,
    columns: Columns = None,
    ticket: Ticket = None,
) -> UploadPublic:
    """Upload a video, an animation, a sequence of pictures, a table of tracks, or results of a tracker."""
    places = None if columns is None else _read("columns", columns, PLACES)
    announced = request.headers.get("content-length", "")
    wanted_bytes = min(int(announced), settings.max_upload_bytes) if announced.isdecimal() else 0
    await asyncio.to_thread(check_room, store, settings, wanted_bytes)
    folder = store.files.new_incoming()
    received = await receive(
        request, folder, store.disk_budget, most_bytes=settings.max_upload_bytes, most_files=settings.max_upload_files
    )
    try:
        taking = take_in(store, settings, tasks, folder, received, stopping.is_set, ticket, places)
        row = await requests.unless_client_gone(request, taking)
    finally:
        await asyncio.to_thread(shutil.rmtree, folder, ignore_errors=True)
    return UploadPublic.model_validate(row)


@router.post("/table")
def look_at_table(head: TableHead) -> Preview:
    """Return the columns of a table, so that a person can name them before uploading it with `columns`."""
    return preview(head.text)


@router.get("")
def list_uploads(store: AStore) -> list[UploadPublic]:
    """List all uploads, newest first."""
    return [UploadPublic.model_validate(row) for row in store.all(UploadRow)]


@router.get("/{upload}")
def show_upload(upload: AnUpload) -> UploadPublic:
    """Return an upload and its content."""
    return UploadPublic.model_validate(upload)


@router.get("/{upload}/frames/{frame}.jpg", response_class=Response, responses={200: {"content": {"image/jpeg": {}}}})
async def show_frame(
    upload: AnUpload,
    frame: Annotated[int, Path(ge=0, le=10_000_000)],
    store: AStore,
    settings: SettingsNow,
    tasks: TheTasks,
) -> Response:
    """Return a frame of an upload, decoded in a confined process."""
    path = store.files.preview(upload.id, frame)
    if path.exists():
        picture = await asyncio.to_thread(path.read_bytes)
    else:
        recording = await recording_of(store, settings, tasks, upload.id)
        picture = await tasks.run(frame_jpeg, recording, frame)
        await asyncio.to_thread(store.files.keep_preview, upload.id, frame, picture)
    return requests.kept_picture(picture, "image/jpeg")


@router.get("/{upload}/mark")
async def find_target(
    upload: AnUpload,
    experiment: ForExperiment,
    frame: Number,
    store: AStore,
    settings: SettingsNow,
    tasks: TheTasks,
    hint: Hint = None,
    last: Number | None = None,
    looked: Number = 0,
) -> SightingPublic:
    """Search for an experiment's target from a frame on, or by a hint there; ask again with `looked` to continue."""
    experiment.check_footage(upload.kind)
    shown = None if hint is None else _read("hint", hint, MARK)
    question = TargetSearch(experiment.id, frame, last, looked, shown)
    recording = await recording_of(store, settings, tasks, upload.id)
    return SightingPublic(**await tasks.run(find_mark, recording, question))


@router.get("/{upload}/suitability")
async def weigh(
    upload: AnUpload,
    experiment: ForExperiment,
    frame: Number,
    store: AStore,
    settings: SettingsNow,
    tasks: TheTasks,
    mark: Mark,
    answer: Response,
) -> SuitabilityPublic:
    """Judge whether the trackers of an experiment can follow a target, before tracking."""
    experiment.check_footage(upload.kind)
    target = _read("mark", mark, MARK)
    recording = await recording_of(store, settings, tasks, upload.id)
    found = SuitabilityPublic(**await tasks.run(weigh_target, recording, experiment.id, frame, target))
    # An upload never changes, so a page may reuse the answer.
    answer.headers["Cache-Control"] = f"private, max-age={KEPT_S}"
    return found


@router.put("/{upload}/truth", openapi_extra=MULTIPART, dependencies=[TakesFiles])
async def give_truth(
    request: Request, upload: AnUpload, experiment: ForExperiment, store: AStore, tasks: TheTasks
) -> TruthPublic:
    """Store a truth table for an upload; later sessions are measured by it."""
    folder = store.files.new_incoming()
    received = await receive(request, folder, store.disk_budget, most_bytes=LARGEST_FILE_BYTES, most_files=1)
    return await store_truth(store, tasks, upload, experiment, folder, received)


@router.get("/{upload}/truth")
def show_truth(upload: AnUpload, experiment: ForExperiment, store: AStore) -> TruthPublic | None:
    """Summarise an upload's truth of an experiment's kind; null if there is none."""
    return load_truth(store, upload.id, experiment)


@router.get("/{upload}/truth.csv", response_class=Response, responses={200: {"content": {"text/csv": {}}}})
def fetch_truth(upload: AnUpload, experiment: ForExperiment, store: AStore) -> Response:
    """Return an upload's truth as a table that can be uploaded again."""
    table = table_of(store, upload.id, experiment)
    if table is None:
        raise not_found("No truth was given for this upload, or it is of another kind.")
    stem = re.sub(r"\.\w+(?=( \(\d+\))?$)", "", upload.name)
    name = re.sub(r"[^A-Za-z0-9_.]+", "-", stem).strip("-.")
    given = f'attachment; filename="{name or upload.id}-truth.csv"'
    return Response(table, media_type="text/csv", headers={"Content-Disposition": given, "Cache-Control": "no-store"})


@router.delete("/{upload}/truth", status_code=HTTPStatus.NO_CONTENT)
def remove_truth(upload: AnUpload, experiment: ForExperiment, store: AStore) -> None:
    """Delete an upload's truth."""
    discard_truth(store, upload.id, experiment)
