"""Routes of experiments: their list with pictures, other packages, the glossary, and own filters."""

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
    """A citation of a place in a publication."""

    key: str = Field(description="Name of the publication in BibTeX")
    short: str = Field(description="Family names, year and place")
    text: str = Field(description="The whole reference as plain text")
    bibtex: str


class ExperimentPublic(BaseModel):
    """An experiment on the start page."""

    id: str
    title: str
    clip_title: str = Field(description="Title on a recording")
    family: str = Field(description="Kind of quantity that it estimates; a family is listed together")
    question: str
    references: list[CitationPublic] = Field(description="Sources, the main one first")
    description: str
    accepts_video: bool
    footage: list[str] = Field(description="Kinds of recording that it takes, as in an upload's kind")
    target: str = Field(description="The target, one word")
    marks: list[Editor] = Field(description="Kinds of mark that it takes in a recording, the default one first")
    unmarked: list[str] = Field(description="Kinds of recording in which the target need not be marked")
    finds: str | None = Field(description="Kind of mark that it finds by itself; null if a person marks the target")
    hints: list[str] = Field(description="Kinds of mark with which a person can hint at the target")
    suits: bool = Field(description="Whether it can judge a target's suitability before tracking")
    advice: str = Field(description="Advice for marking the target")
    truth_columns: list[str] = Field(description="Columns of a truth table for a recording; empty if it takes none")
    default_tracker: str
    frames: int
    trackers: list[dict[str, str]]
    presets: tuple[Preset, ...]
    thumbnail: str | None = Field(description="Address of a small picture; null if it has none")


class ExperimentDetail(ExperimentPublic):
    """An experiment with all its parameters."""

    declarations: list[Declaration]
    layers: list[Layer]
    worlds: list[World]
    parameter_schema: dict[str, Any] = Field(serialization_alias="schema")
    loss_trackers: list[str] = Field(description="Trackers that can give the probability of a loss")


router = APIRouter(tags=["experiments"])


@router.get("/experiments")
def list_experiments(filters: TheFilters) -> list[ExperimentPublic]:
    """List all experiments."""
    return [ExperimentPublic(**_fields(ExperimentPublic, experiment, filters)) for experiment in EXPERIMENTS.values()]


@router.get("/plugins")
def list_plugins() -> tuple[Plugin, ...]:
    """List the experiments from other packages, and why some of them cannot be used."""
    return EXPERIMENTS.plugins


@router.get("/experiments/{experiment}")
def show_experiment(
    experiment: AnExperiment,
    filters: TheFilters,
    recording: Annotated[
        Kind | None, Query(description="Kind of recording whose parameters to return instead of the scene's.")
    ] = None,
) -> ExperimentDetail:
    """Return an experiment with all its parameters."""
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
    responses={200: {"content": {"image/webp": {}}}, 304: {"description": "The client has this picture"}},
)
def show_thumbnail(request: Request, experiment: AnExperiment) -> Response:
    """Return an experiment's own small picture."""
    path = experiment.display.thumbnail
    if path is None or not path.is_file():
        raise not_found(f"The experiment {experiment.id} has no picture.")
    return StaticFiles().file_response(path, path.stat(), request.scope)


def _fields(model: type[ExperimentPublic], experiment: Experiment, filters: FilterFiles) -> dict[str, Any]:
    """Return the fields of a model, declared by an experiment or derived from it."""
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
    """List the glossary: words shared by all experiments, then those of each."""
    return [*GLOSSARY, *(each.glossary for each in EXPERIMENTS.values())]


class FilterUpdate(RequestBody):
    """A new text for a filter file."""

    text: str = Field(min_length=1, max_length=LONGEST_FILE)
    before: str = Field(max_length=100, description="Hash of the text that it replaces")


own_filters = APIRouter(prefix="/filters", tags=["filters"])


@own_filters.get("")
async def list_filters(filters: TheFilters) -> list[FilterPublic]:
    """List the filter files with their texts."""
    return await asyncio.to_thread(filters.views)


@own_filters.put("/{name}")
async def write_filter(name: AName, body: FilterUpdate, filters: TheFilters) -> FilterPublic:
    """Write a filter file, unless it was changed meanwhile; sessions continue with it, as after saving in an editor."""
    return await asyncio.to_thread(filters.write, name, body.text, body.before)
