"""Filters of the server's owner: their files, to be read, and written where this machine alone can reach the server."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Path

from pftrack_server.schemas.filters import FilterPublic, FilterUpdate
from pftrack_server.store.filters import TheFilters

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
