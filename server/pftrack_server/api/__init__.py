"""The handlers for classes and lessons, as one router."""

from fastapi import APIRouter

from pftrack_server.api import follow, follows, lectures, lessons, polls

__all__ = ["router"]

router = APIRouter()
for part in (lessons, follows, follow, polls, lectures):
    router.include_router(part.router)
