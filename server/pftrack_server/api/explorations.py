"""Explorations of a session: what would have saved its run, and what runs with other seeds do, as it is found."""

from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Path

from pftrack_server.api.dependencies import ASession, TheExplorations
from pftrack_server.schemas.explorations import ExplorationCreate, ExplorationPublic
from pftrack_server.sessions.explorations import exploration_view

router = APIRouter(prefix="/sessions/{session}/explorations", tags=["sessions"])

Name = Annotated[str, Path(max_length=64)]


@router.post("", status_code=HTTPStatus.ACCEPTED)
async def explore(session: ASession, body: ExplorationCreate, explorations: TheExplorations) -> ExplorationPublic:
    """Begin to try what would have saved the active branch, or what its settings do with other seeds."""
    return exploration_view(await explorations.explore(session, body))


@router.get("/{name}")
async def show_exploration(session: ASession, name: Name, explorations: TheExplorations) -> ExplorationPublic:
    """Tell what an exploration has found so far; one that nobody asks for is dropped after 150 s."""
    return exploration_view(explorations.of(session, name))


@router.delete("/{name}", status_code=HTTPStatus.NO_CONTENT)
async def cancel_exploration(session: ASession, name: Name, explorations: TheExplorations) -> None:
    """Stop an exploration, and forget what it has found."""
    await explorations.cancel(explorations.of(session, name).id)
