"""Comparisons: outlined before they begin, so that what cannot be compared is refused at once, and kept under a name.

The store keeps the recipes of a comparison's runs; their results are computed again when it is opened.
"""

from collections.abc import Sequence
from typing import Literal, NamedTuple

from pydantic import BaseModel, Field, TypeAdapter

from pftrack.core.model.recipe import Recipe
from pftrack.core.refusal import ConflictError, RefusedError
from pftrack.experiments import find as find_experiment
from pftrack.output.exports.comparisons import COMPARISON_FORMATS
from pftrack.output.exports.formats import FileKind
from pftrack.runs.comparison import MOST_RUNS, ComparisonOutline, ComparisonResult, Setting
from pftrack_server.core.bodies import FrameNumber, GivenTitle, RequestBody
from pftrack_server.core.errors import gone
from pftrack_server.core.settings import Settings
from pftrack_server.jobs.jobs import Job, OnStep
from pftrack_server.sessions.worker.protocol import WorkerConfig
from pftrack_server.store import Store
from pftrack_server.store.database import ComparisonRow
from pftrack_server.store.files import new_name, now
from pftrack_server.work.run_functions import compare_runs, outline_comparison
from pftrack_server.work.sources import ComparedRun, House, NamedRun, find_run


class ComparedPublic(BaseModel):
    """One of the runs of a comparison."""

    name: str = Field(description="By what is special about it")
    title: str | None = Field(description="What people call it, where it has such a name")
    colour: str
    first: int = Field(description="Its frame that is the first of those that are compared")
    recipe: Recipe
    shown: Recipe = Field(description="The same, no longer than what is compared")
    upload: str | None


class RunComparisonPublic(BaseModel):
    """What is known of a comparison; its frames are those in common, counted from 0 on."""

    unit: str
    frames: int
    runs: list[ComparedPublic]
    settings: tuple[Setting, ...] = Field(description="What differs, and that alone")
    exports: list[FileKind] = Field(description="Files that can be made of it")
    found: ComparisonResult | None = Field(None, description="Results of the runs, once they are computed")


class ComparisonJob(Job[RunComparisonPublic]):
    """A comparison of runs; its steps are frames of all of them."""

    kind: Literal["comparison"] = "comparison"


Arrangement = Literal["side", "over"]
"""Side by side, or one over the other."""


class SavedRun(RequestBody):
    """What makes a run of a saved comparison."""

    recipe: Recipe


class SavedComparisonCreate(RequestBody):
    """A comparison to keep."""

    title: GivenTitle
    runs: list[SavedRun] = Field(min_length=2, max_length=MOST_RUNS)
    position: FrameNumber = Field(0, description="The frame to begin at, of those that all runs have")
    arrangement: Arrangement = "side"


class SavedComparisonPublic(BaseModel):
    """A saved comparison."""

    id: str
    title: str
    experiments: list[str] = Field(description="Of its runs, each once")
    trackers: list[str] = Field(description="Of its runs, in order; empty where the recipe names none")
    created: str
    page: str


class SavedComparisonDetail(SavedComparisonPublic):
    """A saved comparison with all that makes it again."""

    runs: list[SavedRun]
    position: int
    arrangement: Arrangement


OUTLINE, RESULT = TypeAdapter(ComparisonOutline), TypeAdapter(ComparisonResult)


class Prepared(NamedTuple):
    """Runs that can be compared."""

    named: list[NamedRun]
    configs: list[WorkerConfig]
    outline: ComparisonOutline


async def prepare(house: House, runs: Sequence[ComparedRun]) -> Prepared:
    """Return what makes runs, and what is known of them beside each other before they are computed.

    Raises:
        RefusedError: They are too few or too many, one is not as it should be, or they have nothing in common.
        ApiError: One is not here (404).
        ConflictError: The recording of one is not here.
        ApiError: Their experiment is still being compiled (503).
    """
    if not 2 <= len(runs) <= MOST_RUNS:
        raise RefusedError(f"Expected two to four runs to compare, got {len(runs)}.", field="runs", value=len(runs))
    named = [await find_run(run, house) for run in runs]
    for experiment in dict.fromkeys(each.spec.recipe.experiment for each in named):
        await house.wait_for(experiment)
    configs = [await house.config(each.spec) for each in named]
    return Prepared(named, configs, OUTLINE.validate_python(await house.tasks.run(outline_comparison, configs)))


async def compare(house: House, runs: Sequence[ComparedRun]) -> ComparisonJob:
    """Begin to compare runs, once it is known that they can be compared.

    Raises:
        ApiError: They cannot; see `prepare`; too much is under way (503).
    """
    house.jobs.check_room(ComparisonJob)
    named, configs, outline = await prepare(house, runs)
    described = zip(named, outline.names, outline.colours, outline.firsts, strict=True)
    known = RunComparisonPublic(
        unit=outline.unit,
        frames=outline.frames,
        runs=[
            ComparedPublic(
                name=name,
                title=each.title,
                colour=colour,
                first=first,
                recipe=each.spec.recipe,
                shown=each.spec.recipe.model_copy(update={"frames": first + outline.frames}),
                upload=each.spec.upload,
            )
            for each, name, colour, first in described
        ],
        settings=outline.settings,
        exports=list(COMPARISON_FORMATS),
    )

    async def work(on_step: OnStep) -> RunComparisonPublic:
        found = RESULT.validate_python(await house.compute(on_step, compare_runs, configs))
        return known.model_copy(update={"found": found})

    return house.jobs.begin(ComparisonJob(id=new_name(), name=" ".join(outline.names), result=known), work)


def save(store: Store, settings: Settings, body: SavedComparisonCreate) -> ComparisonRow:
    """Keep a comparison.

    Raises:
        ConflictError: There are as many as there may be.
        RefusedError: The experiment of a run is unknown.
        ParameterError: A run names a tracker or a parameter that its experiment does not have.
        ApiError: The disk has no room (507).
    """
    if store.count(ComparisonRow) >= settings.max_comparisons:
        raise ConflictError(f"The server keeps at most {settings.max_comparisons} comparisons; delete one first.")
    for run in body.runs:
        find_experiment(run.recipe.experiment).check_names(run.recipe)
    # The truth belongs to the upload, from which the maker of the run takes it.
    runs = [{"recipe": run.recipe.with_footage(path=None, truth=None).as_dict()} for run in body.runs]
    content = {"runs": runs, "position": body.position, "arrangement": body.arrangement}
    row = ComparisonRow(id=new_name(), title=body.title, content=content, created=now())
    store.disk_budget.check()
    store.add(row)
    return row


def saved_view(row: ComparisonRow) -> SavedComparisonPublic:
    """Return a comparison as lists show it; a recipe that cannot be read any more is left out."""
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
        ApiError: What is kept cannot be read (410).
    """
    try:
        return SavedComparisonDetail.model_validate({**row.content, **saved_view(row).model_dump()})
    except ValueError:
        raise gone("The stored data of this comparison is damaged; it can only be deleted.") from None
