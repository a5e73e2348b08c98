"""What there is to choose from: experiments with their pictures, other packages, the words of all, own filters."""

import asyncio
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, Field
from starlette.responses import Response
from starlette.staticfiles import StaticFiles

from pftrack.core.model.drawing import Layer, World
from pftrack.core.model.glossary import GLOSSARY, Section
from pftrack.core.model.marks import Editor
from pftrack.core.model.parameters import LONGEST_FILE, Declaration
from pftrack.core.model.preset import Preset
from pftrack.core.model.source import Kind
from pftrack.experiments import EXPERIMENTS, Plugin
from pftrack.experiments.experiment import Experiment
from pftrack_server.core.bodies import RequestBody, fields_of
from pftrack_server.core.errors import not_found
from pftrack_server.core.requests import AName, AnExperiment
from pftrack_server.store.filters import FilterFiles, FilterPublic, TheFilters


class CitationPublic(BaseModel):
    """A place in a publication, as it can be cited."""

    key: str = Field(description="Name of the publication in BibTeX")
    short: str = Field(description="Family names, year and place")
    text: str = Field(description="The whole as plain text")
    bibtex: str


class ExperimentPublic(BaseModel):
    """An experiment as the start page shows it."""

    id: str
    title: str
    clip_title: str = Field(description="What it is called where a recording is tracked")
    family: str = Field(description="What kind of thing it estimates; those of one family stand together")
    question: str
    references: list[CitationPublic] = Field(description="What it comes from, the main one first")
    description: str
    accepts_video: bool
    footage: list[str] = Field(description="Kinds of recording that it takes, as an upload's kind names them")
    target: str = Field(description="What is tracked, one word")
    marks: list[Editor] = Field(description="Kinds of mark that it takes in a recording, the one to offer first")
    unmarked: list[str] = Field(description="Kinds of recording in which the target need not be marked all the same")
    finds: str | None = Field(description="Kind of mark that it finds itself; null if a person marks the target")
    hints: list[str] = Field(description="Kinds of mark by which a person may show it where to find the target")
    suits: bool = Field(description="Whether it can tell before tracking how suitable a target is")
    advice: str = Field(description="What a person who marks the target should know")
    truth_columns: list[str] = Field(description="What a table of truth for a recording has; empty if there is none")
    default_tracker: str
    frames: int
    trackers: list[dict[str, str]]
    presets: tuple[Preset, ...]
    thumbnail: str | None = Field(description="Where a small picture of it is; null if it brings none")


class ExperimentDetail(ExperimentPublic):
    """An experiment with everything that can be turned."""

    declarations: list[Declaration]
    layers: list[Layer]
    worlds: list[World]
    parameter_schema: dict[str, Any] = Field(serialization_alias="schema")
    loss_trackers: list[str] = Field(description="Trackers that can tell how probable it is that the target is lost")


router = APIRouter(tags=["experiments"])


@router.get("/experiments")
def list_experiments(filters: TheFilters) -> list[ExperimentPublic]:
    """List all experiments."""
    return [ExperimentPublic(**_fields(ExperimentPublic, experiment, filters)) for experiment in EXPERIMENTS.values()]


@router.get("/plugins")
def list_plugins() -> tuple[Plugin, ...]:
    """List the experiments that other packages add, and why some of them cannot be used."""
    return EXPERIMENTS.plugins


@router.get("/experiments/{experiment}")
def show_experiment(
    experiment: AnExperiment,
    filters: TheFilters,
    recording: Annotated[
        Kind | None, Query(description="Kind of a recording, whose parameters are wanted instead of the scene's.")
    ] = None,
) -> ExperimentDetail:
    """Tell everything about an experiment, its parameters included."""
    model = type(experiment.parameters_on(recording))
    return ExperimentDetail(
        **_fields(ExperimentDetail, experiment, filters)
        | {
            "declarations": experiment.declarations(model),
            "parameter_schema": model.model_json_schema(),
            "loss_trackers": list(experiment.quality.loss_probability.models_on(recording)),
        }
    )


@router.get(
    "/experiments/{experiment}/thumbnail.webp",
    response_class=Response,
    responses={200: {"content": {"image/webp": {}}}, 304: {"description": "It is the one that the client has"}},
)
def show_thumbnail(request: Request, experiment: AnExperiment) -> Response:
    """Return a small picture of an experiment, which it brings along."""
    path = experiment.display.thumbnail
    if path is None or not path.is_file():
        raise not_found(f"The experiment {experiment.id} brings no picture.")
    return StaticFiles().file_response(path, path.stat(), request.scope)


def _fields(model: type[ExperimentPublic], experiment: Experiment, filters: FilterFiles) -> dict[str, Any]:
    """Return the fields of a model: what an experiment declares by their names, and what follows from it."""
    video, finder = experiment.video, experiment.video.finder
    trackers = [(name, tracker.title, tracker.description) for name, tracker in experiment.trackers.items()]
    trackers += [
        (each.name, each.title, f"The filter in {each.path.name}.")
        for each in filters.served
        if each.experiment == experiment.id
    ]
    picture = experiment.display.thumbnail
    has_picture = picture is not None and picture.is_file()
    return fields_of(model, video, experiment.texts, experiment.display, experiment) | {
        "clip_title": video.clip_title or experiment.title,
        "references": [citation.as_dict() for citation in experiment.texts.references],
        "trackers": [dict(zip(("id", "title", "description"), each, strict=True)) for each in trackers],
        "marks": [kind.editor() for kind in video.marks],
        "finds": finder.kind.name() if finder else None,
        "hints": [kind.name() for kind in finder.hints] if finder else [],
        "suits": video.suits is not None,
        "truth_columns": video.truth.form.columns if video.truth else [],
        "thumbnail": f"api/v1/experiments/{experiment.id}/thumbnail.webp" if has_picture else None,
    }


@router.get("/glossary")
def show_glossary() -> list[Section]:
    """List all words with their meaning: those that all experiments share, then those of each."""
    return [*GLOSSARY, *(each.glossary for each in EXPERIMENTS.values())]


class FilterUpdate(RequestBody):
    """A new text of a file."""

    text: str = Field(min_length=1, max_length=LONGEST_FILE)
    before: str = Field(max_length=100, description="Hash of the text that it takes the place of")


own_filters = APIRouter(prefix="/filters", tags=["filters"])


@own_filters.get("")
async def list_filters(filters: TheFilters) -> list[FilterPublic]:
    """List the files with their texts."""
    return await asyncio.to_thread(filters.views)


@own_filters.put("/{name}")
async def write_filter(name: AName, body: FilterUpdate, filters: TheFilters) -> FilterPublic:
    """Write a file, unless it was changed meanwhile; sessions go on with it as if an editor had saved it."""
    return await asyncio.to_thread(filters.write, name, body.text, body.before)
