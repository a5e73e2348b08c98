"""The queue: how many are before somebody whose file waits to be looked through."""

from typing import Annotated

from fastapi import APIRouter, Path

from pftrack_server.api.dependencies import TICKET, TheServices
from pftrack_server.schemas.queue import QueuePublic

router = APIRouter(prefix="/queue", tags=["uploads"])


@router.get("/{ticket}")
async def show_place(ticket: Annotated[str, Path(pattern=TICKET)], services: TheServices) -> QueuePublic:
    """Tell how many are before the request that was sent with a ticket; none once it is worked on."""
    return QueuePublic(before=services.queues.before(ticket))
