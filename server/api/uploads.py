"""Uploads: videos, GIFs and sets of pictures, taken in only after every frame of them was decoded once."""

import asyncio
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Path, Request
from starlette.responses import Response

from server.api.dependencies import AManager, AnErrands, AnUpload, AStore, SettingsNow, TheServices
from server.api.models import UploadView
from server.errors import ConflictError
from server.sessions.jobs import frame_jpeg
from server.store.intake import limits_of, take_in
from server.uploading import receive

__all__ = ["router"]

router = APIRouter(prefix="/uploads", tags=["uploads"])

MULTIPART = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["file"],
                    "properties": {"file": {"type": "array", "items": {"type": "string", "format": "binary"}}},
                }
            }
        },
    }
}


@router.post("", status_code=HTTPStatus.CREATED, openapi_extra=MULTIPART)
async def add_upload(request: Request, store: AStore, settings: SettingsNow, services: TheServices) -> UploadView:
    """Take in a video, an animated GIF, or several pictures that make a sequence."""
    folder = store.files.new_incoming()
    received = await receive(
        request, folder, most_bytes=settings.max_upload_bytes, most_files=settings.max_upload_files
    )
    loop = asyncio.get_running_loop()
    row = await loop.run_in_executor(
        services.probing, take_in, store, settings, folder, received, services.stopping.is_set
    )
    return UploadView.model_validate(row)


@router.get("")
def list_uploads(store: AStore) -> list[UploadView]:
    """List all uploads, the newest first."""
    return [UploadView.model_validate(row) for row in store.uploads()]


@router.get("/{upload}")
def show_upload(upload: AnUpload) -> UploadView:
    """Tell what was found in an upload."""
    return UploadView.model_validate(upload)


@router.delete("/{upload}", status_code=HTTPStatus.NO_CONTENT)
async def remove_upload(upload: AnUpload, store: AStore, manager: AManager) -> None:
    """Delete an upload that no session needs."""
    if manager.uses(upload.id):
        raise ConflictError("A session runs on this upload; end the session first.")
    await asyncio.to_thread(store.remove_upload, upload.id)


@router.get("/{upload}/frames/{frame}.jpg", response_class=Response, responses={200: {"content": {"image/jpeg": {}}}})
async def show_frame(
    upload: AnUpload,
    frame: Annotated[int, Path(ge=0, le=10_000_000)],
    store: AStore,
    settings: SettingsNow,
    errands: AnErrands,
) -> Response:
    """Return a frame of an upload, decoded in a confined process."""
    path = store.files.preview(upload.id, frame)
    if path.exists():
        picture = await asyncio.to_thread(path.read_bytes)
    else:
        where, index = str(store.files.upload(upload.id)), store.files.index(upload.id)
        picture = await errands.run(frame_jpeg, where, index, frame, limits_of(settings))
        await asyncio.to_thread(store.files.keep_preview, upload.id, frame, picture)
    return Response(picture, media_type="image/jpeg", headers={"Cache-Control": "max-age=86400"})
