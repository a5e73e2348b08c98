"""Experiments: the list of them, and each in detail."""

import base64
import hashlib
from http import HTTPStatus
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from pftrack.core.model.source import Kind
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.experiment import Experiment
from pftrack_server.core.requests import AnExperiment
from pftrack_server.jobs.functions import draw_experiment
from pftrack_server.jobs.results import TheResults
from pftrack_server.schemas.experiments import ExperimentDetail, ExperimentPublic, PluginPublic, PresetPublic
from pftrack_server.store.filters import FilterFiles, TheFilters

router = APIRouter(prefix="/experiments", tags=["experiments"])
plugins = APIRouter(prefix="/plugins", tags=["experiments"])


@router.get("")
def list_experiments(filters: TheFilters) -> list[ExperimentPublic]:
    """List all experiments."""
    return [ExperimentPublic(**_public_fields(experiment, filters)) for experiment in EXPERIMENTS.values()]


@plugins.get("")
def list_plugins() -> list[PluginPublic]:
    """List the experiments that other packages add, and why some of them cannot be used."""
    return [PluginPublic.model_validate(plugin) for plugin in EXPERIMENTS.plugins]


@router.get("/{experiment}")
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
        **_public_fields(experiment, filters),
        declarations=list(experiment.declarations(model)),
        layers=list(experiment.layers),
        worlds=list(experiment.worlds),
        parameter_schema=model.model_json_schema(),
        loss_trackers=list(experiment.quality.loss_probability.models_on(recording)),
    )


@router.get(
    "/{experiment}/thumbnail.png",
    response_class=Response,
    responses={200: {"content": {"image/png": {}}}, 304: {"description": "It is the one that the client has"}},
)
async def draw_thumbnail(request: Request, experiment: AnExperiment, results: TheResults) -> Response:
    """Return a picture of an experiment: a real frame of a real run."""
    drawn = await results.get(experiment.id, draw_experiment, experiment.id)
    picture = base64.b64decode(drawn["png"])
    # A package's experiment may be another one at the server's next start, and a browser has to see that at once.
    tag = f'"{hashlib.sha256(picture).hexdigest()[:32]}"'
    headers = {"Cache-Control": "no-cache", "ETag": tag}
    if tag in request.headers.get("If-None-Match", ""):
        return Response(status_code=HTTPStatus.NOT_MODIFIED, headers=headers)
    return Response(picture, media_type="image/png", headers=headers)


def _public_fields(experiment: Experiment, filters: FilterFiles) -> dict[str, Any]:
    return {
        "id": experiment.id,
        "title": experiment.title,
        "clip_title": experiment.video.clip_title or experiment.title,
        "family": experiment.family,
        "question": experiment.question,
        "references": [citation.as_dict() for citation in experiment.references],
        "description": experiment.description,
        "accepts_video": experiment.accepts_video,
        "footage": list(experiment.video.footage),
        "default_tracker": experiment.default_tracker,
        "frames": experiment.frames,
        "trackers": [
            {"id": name, "title": tracker.title, "description": tracker.description}
            for name, tracker in experiment.trackers.items()
        ]
        + [
            {"id": each.name, "title": each.title, "description": f"The filter in {each.path.name}."}
            for each in filters.served
            if each.experiment == experiment.id
        ],
        "target": experiment.target,
        "marks": [kind.editor() for kind in experiment.video.marks],
        "unmarked": list(experiment.video.unmarked),
        "finds": experiment.video.finder.kind.name() if experiment.video.finder else None,
        "hints": [kind.name() for kind in experiment.video.finder.hints] if experiment.video.finder else [],
        "suits": experiment.video.suits is not None,
        "advice": experiment.video.advice,
        "truth_columns": list(experiment.video.truth.form.columns) if experiment.video.truth else [],
        "presets": [
            PresetPublic(
                name=preset.name,
                title=preset.title,
                tracker=preset.tracker,
                parameters=dict(preset.parameters),
                seed=preset.seed,
                about=list(preset.subjects),
                watch=preset.watch,
                tour=preset.tour,
            )
            for preset in experiment.presets
        ],
        "thumbnail": f"api/v1/experiments/{experiment.id}/thumbnail.png",
    }
