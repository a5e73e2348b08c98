"""Filters of the server's owner: their files, to be read, and written where this machine alone can reach the server."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Path
from pydantic import Field

from pftrack.core.model.parameters import LONGEST_FILE
from pftrack_server.core.bodies import RequestBody
from pftrack_server.store.filters import FilterPublic, TheFilters


class FilterUpdate(RequestBody):
    """A new text of a file."""

    text: str = Field(min_length=1, max_length=LONGEST_FILE)
    before: str = Field(max_length=100, description="Hash of the text that it takes the place of")


router = APIRouter(prefix="/filters", tags=["filters"])

Name = Annotated[str, Path(max_length=64)]


@router.get("")
async def list_filters(filters: TheFilters) -> list[FilterPublic]:
    """List the files with their texts."""
    return await asyncio.to_thread(filters.views)


@router.put("/{name}")
async def write_filter(name: Name, body: FilterUpdate, filters: TheFilters) -> FilterPublic:
    """Write a file, unless it was changed meanwhile; sessions go on with it as if an editor had saved it."""
    return await asyncio.to_thread(filters.write, name, body.text, body.before)
