"""Comparisons: outlined before they begin, so that incompatible runs are refused at once, and saved under a name.

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

    name: str = Field(description="Name by its special setting")
    title: str | None = Field(description="Title, if a person gave one")
    colour: str
    first: int = Field(description="Its frame that is compared first")
    recipe: Recipe
    shown: Recipe = Field(description="The recipe, cut to the compared frames")
    upload: str | None


class RunComparisonPublic(BaseModel):
    """A comparison; its frames are the common ones, counted from 0."""

    unit: str
    frames: int
    runs: list[ComparedPublic]
    settings: tuple[Setting, ...] = Field(description="The settings that differ")
    exports: list[FileKind] = Field(description="Kinds of files to export it as")
    found: ComparisonResult | None = Field(None, description="Results of the runs, once they are computed")


class ComparisonJob(Job[RunComparisonPublic]):
    """A comparison of runs; its steps are frames of all runs."""

    kind: Literal["comparison"] = "comparison"


Arrangement = Literal["side", "over"]
"""Arrangement: side by side, or one over the other."""


class SavedRun(RequestBody):
    """The recipe of a run of a saved comparison."""

    recipe: Recipe


class SavedComparisonCreate(RequestBody):
    """A comparison to save."""

    title: GivenTitle
    runs: list[SavedRun] = Field(min_length=2, max_length=MOST_RUNS)
    position: FrameNumber = Field(0, description="The first frame to show, among the common ones")
    arrangement: Arrangement = "side"


class SavedComparisonPublic(BaseModel):
    """A saved comparison."""

    id: str
    title: str
    experiments: list[str] = Field(description="Experiments of its runs, each once")
    trackers: list[str] = Field(description="Trackers of its runs, in order; empty for a default")
    created: str
    page: str


class SavedComparisonDetail(SavedComparisonPublic):
    """A saved comparison with its recipes."""

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
    """Return the configurations of runs, and the outline of their comparison before they are computed.

    Raises:
        RefusedError: There are too few or too many runs, one is invalid, or they have nothing in common.
        ApiError: A run does not exist (404).
        ConflictError: The recording of a run is missing.
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
    """Check that runs can be compared, and begin to compare them.

    Raises:
        ApiError: The runs cannot be compared, see `prepare`; or too many jobs are running (503).
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
    """Save a comparison.

    Raises:
        ConflictError: The limit of comparisons is reached.
        RefusedError: The experiment of a run is unknown.
        ParameterError: A run names a tracker or a parameter that its experiment does not have.
        ApiError: The disk has no room (507).
    """
    if store.count(ComparisonRow) >= settings.max_comparisons:
        raise ConflictError(f"The server keeps at most {settings.max_comparisons} comparisons; delete one first.")
    for run in body.runs:
        find_experiment(run.recipe.experiment).check_names(run.recipe)
    # The truth belongs to the upload, and is read from there when the run is made.
    runs = [{"recipe": run.recipe.with_footage(path=None, truth=None).as_dict()} for run in body.runs]
    content = {"runs": runs, "position": body.position, "arrangement": body.arrangement}
    row = ComparisonRow(id=new_name(), title=body.title, content=content, created=now())
    store.disk_budget.check()
    store.add(row)
    return row


def saved_view(row: ComparisonRow) -> SavedComparisonPublic:
    """Return a comparison for a list; a recipe that can no longer be read is left out."""
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
    """Return a comparison with its recipes.

    Raises:
        ApiError: The stored data cannot be read (410).
    """
    try:
        return SavedComparisonDetail.model_validate({**row.content, **saved_view(row).model_dump()})
    except ValueError:
        raise gone("The stored data of this comparison is damaged; it can only be deleted.") from None
