"""Comparisons: runs beside each other, computed while whoever asked follows how far they are, and kept under a name."""

from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Path, Request

from pftrack_server.api.dependencies import AComparison, AStore, SettingsNow, TheComparisons, wait_until_gone
from pftrack_server.comparisons.saved import detail_view, save, saved_view
from pftrack_server.comparisons.service import comparison_view
from pftrack_server.errors import NotFoundError
from pftrack_server.schemas.comparisons import (
    ComparisonCreate,
    RunComparisonPublic,
    SavedComparisonCreate,
    SavedComparisonDetail,
    SavedComparisonPublic,
    SavedComparisonUpdate,
)
from pftrack_server.store.files import is_name
from pftrack_server.tasks.queue import unless_gone

router = APIRouter(prefix="/comparisons", tags=["comparisons"])

Name = Annotated[str, Path(max_length=64)]


@router.post("", status_code=HTTPStatus.ACCEPTED)
async def compare(body: ComparisonCreate, request: Request, comparisons: TheComparisons) -> RunComparisonPublic:
    """Compare two to four runs: what differs is told at once, what came of them when they have been computed."""
    return comparison_view(await unless_gone(comparisons.compare(body.runs), lambda: wait_until_gone(request)))


@router.post("/saved", status_code=HTTPStatus.CREATED)
def save_comparison(body: SavedComparisonCreate, store: AStore, settings: SettingsNow) -> SavedComparisonPublic:
    """Keep a comparison under a name."""
    return saved_view(save(store, settings, body))


@router.get("/saved")
def list_saved_comparisons(store: AStore) -> list[SavedComparisonPublic]:
    """List all saved comparisons, the newest first."""
    return [saved_view(row) for row in store.comparisons()]


@router.get("/saved/{saved}")
def show_saved_comparison(saved: AComparison) -> SavedComparisonDetail:
    """Tell what makes a saved comparison again."""
    return detail_view(saved)


@router.patch("/saved/{saved}")
def rename_comparison(saved: AComparison, body: SavedComparisonUpdate, store: AStore) -> SavedComparisonPublic:
    """Give a saved comparison another name."""
    store.rename_comparison(saved.id, body.title)
    saved.title = body.title
    return saved_view(saved)


@router.delete("/saved/{saved}", status_code=HTTPStatus.NO_CONTENT)
def remove_comparison(saved: Name, store: AStore) -> None:
    """Delete a saved comparison, also one whose entry in the database is damaged."""
    if not is_name(saved) or not store.remove_comparison(saved):
        raise NotFoundError("There is no such comparison; it may have been deleted.")


@router.get("/{name}")
async def show_comparison(name: Name, comparisons: TheComparisons) -> RunComparisonPublic:
    """Tell how far a comparison is, or what came of it; one that nobody asks for is dropped after 150 s."""
    return comparison_view(comparisons.get(name))


@router.delete("/{name}", status_code=HTTPStatus.NO_CONTENT)
async def cancel_comparison(name: Name, comparisons: TheComparisons) -> None:
    """Stop a comparison, or forget what came of it."""
    await comparisons.cancel(name)
