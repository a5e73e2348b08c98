"""Saved comparisons: the recipes of their runs under a name. What came of them is computed again when one is opened."""

from pftrack_server.errors import ConflictError, DamagedError
from pftrack_server.experiments import find_experiment
from pftrack_server.schemas.comparisons import SavedComparisonCreate, SavedComparisonDetail, SavedComparisonPublic
from pftrack_server.settings import Settings
from pftrack_server.store import Store
from pftrack_server.store.files import new_name, now
from pftrack_server.store.tables import ComparisonRow


def save(store: Store, settings: Settings, body: SavedComparisonCreate) -> ComparisonRow:
    """Keep a comparison.

    Raises:
        ConflictError: There are as many as there may be.
        RefusedError: The experiment of a run is unknown.
        ParameterError: A run names a tracker or a parameter that its experiment does not have.
        DiskFullError: The disk has no room.
    """
    if store.count(ComparisonRow) >= settings.max_comparisons:
        raise ConflictError(f"The server keeps at most {settings.max_comparisons} comparisons; delete one first.")
    for run in body.runs:
        find_experiment(run.recipe.experiment).check_names(run.recipe)
    # The truth belongs to the upload, from which whoever makes the run takes it.
    runs = [{"recipe": run.recipe.with_footage(path=None, truth=None).as_dict()} for run in body.runs]
    content = {"runs": runs, "position": body.position, "arrangement": body.arrangement}
    row = ComparisonRow(id=new_name(), title=body.title, content=content, created=now())
    store.add_comparison(row)
    return row


def saved_view(row: ComparisonRow) -> SavedComparisonPublic:
    """Return a comparison as lists show it; of a recipe that is no longer one, nothing is told."""
    runs = row.content.get("runs")
    recipes = [run.get("recipe", {}) for run in runs if isinstance(run, dict)] if isinstance(runs, list) else []
    named = [recipe for recipe in recipes if isinstance(recipe, dict)]
    return SavedComparisonPublic(
        id=row.id,
        title=row.title,
        experiments=list(dict.fromkeys(str(recipe.get("experiment", "")) for recipe in named)),
        trackers=[str(recipe.get("tracker") or "") for recipe in named],
        created=row.created,
        page=f"compare?saved={row.id}",
    )


def detail_view(row: ComparisonRow) -> SavedComparisonDetail:
    """Return a comparison with all that makes it again.

    Raises:
        DamagedError: What is kept cannot be read.
    """
    try:
        return SavedComparisonDetail.model_validate({**row.content, **saved_view(row).model_dump()})
    except ValueError:
        raise DamagedError("The stored data of this comparison is damaged; it can only be deleted.") from None
