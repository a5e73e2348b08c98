"""Comparisons: runs beside each other, computed while whoever asked can follow how far they are."""

from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Path, Request

from pftrack_server.api.dependencies import TheComparisons, wait_until_gone
from pftrack_server.comparisons.service import comparison_view
from pftrack_server.schemas.comparisons import ComparisonCreate, RunComparisonPublic
from pftrack_server.tasks.queue import unless_gone

__all__ = ["router"]

router = APIRouter(prefix="/comparisons", tags=["comparisons"])

Name = Annotated[str, Path(max_length=64)]


@router.post("", status_code=HTTPStatus.ACCEPTED)
async def compare(body: ComparisonCreate, request: Request, comparisons: TheComparisons) -> RunComparisonPublic:
    """Compare two to four runs: what differs is told at once, what came of them when they have been computed."""
    return comparison_view(await unless_gone(comparisons.compare(body.runs), lambda: wait_until_gone(request)))


@router.get("/{name}")
async def show_comparison(name: Name, comparisons: TheComparisons) -> RunComparisonPublic:
    """Tell how far a comparison is, or what came of it; one that nobody asks for is dropped after 150 s."""
    return comparison_view(comparisons.get(name))


@router.delete("/{name}", status_code=HTTPStatus.NO_CONTENT)
async def cancel_comparison(name: Name, comparisons: TheComparisons) -> None:
    """Stop a comparison, or forget what came of it."""
    await comparisons.cancel(name)
