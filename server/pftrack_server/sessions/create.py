"""From a recipe to the spec of a new session."""

from collections.abc import Sequence
from typing import Any

from pydantic import Field

from pftrack.core.model.recipe import Footage, Recipe
from pftrack.core.refusal import RefusedError
from pftrack.experiments import find as find_experiment
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.own.code import with_digests
from pftrack_server.core.bodies import FrameNumber, RequestBody
from pftrack_server.sessions.spec import FIRST, Bookmark, BranchSpec, RunSnapshot, SessionSpec
from pftrack_server.store import Store
from pftrack_server.store.database import UploadRow
from pftrack_server.store.files import new_name, now
from pftrack_server.uploads.truth import rows_of


class SessionCreate(RequestBody):
    """A new session."""

    recipe: Recipe
    upload: str | None = Field(None, max_length=64, description="Name of the footage's upload; optional with its hash")
    position: FrameNumber = 0
    id: str | None = Field(None, pattern=r"^[0-9a-f]{16}$", description="Name chosen by the client, to end it with")


def as_spec(body: SessionCreate, store: Store) -> SessionSpec:
    """Return the spec of a requested session; the worker checks its parameters.

    Raises:
        ParameterError: The experiment is unknown, or the data about the target are inconsistent.
        RefusedError: The upload or the mark is missing.
    """
    recipe = body.recipe
    experiment = find_experiment(recipe.experiment)
    found = footage_in(store, experiment, body.upload, recipe.footage)
    if found is None:
        return new_spec(recipe, name=body.id, position=body.position)
    footage, upload = found
    recipe = recipe.model_copy(update={"footage": footage})
    return new_spec(recipe, name=body.id, upload=upload.id, position=body.position)


def footage_in(
    store: Store, experiment: Experiment, upload: str | None, given: Footage | None
) -> tuple[Footage, UploadRow] | None:
    """Return the requested footage, completed from its upload, and the upload; None for each if none was requested.

    Args:
        store: Holds the uploads.
        experiment: Experiment to run on the footage.
        upload: Name of the upload, if given.
        given: The request's data about footage and target.

    Raises:
        ParameterError: The data about the target are inconsistent, or the experiment takes no such recording.
        RefusedError: The upload or the mark is missing.
    """
    found = _upload(store, upload, given)
    if found is None:
        return None
    footage = given or Footage()
    experiment.check_footage(found.kind)
    _check_mark(footage, experiment, found.kind)
    known: dict[str, Any] = {"sha256": found.sha256, "name": found.name}
    if footage.truth is None:
        known["truth"] = rows_of(store, found.id, experiment)
    return footage.model_copy(update=known), found


def new_spec(
    recipe: Recipe,
    *,
    name: str | None = None,
    upload: str | None = None,
    sweep: str | None = None,
    position: int = 0,
    computed: int | None = None,
    bookmarks: Sequence[Bookmark] = (),
) -> SessionSpec:
    """Return the spec of a new session for a recipe.

    Args:
        recipe: The run's recipe.
        name: Name of the session; unguessable by default.
        upload: Name of the upload that holds the recipe's footage.
        sweep: Name of the sweep that the run belongs to.
        position: Frame to show.
        computed: Last frame to compute; by default the frame to show.
        bookmarks: Initial bookmarks.
    """
    run = RunSnapshot(
        branch=FIRST,
        recipe=with_digests(recipe.with_footage(truth=None)),
        tracker=recipe.tracker or find_experiment(recipe.experiment).default_tracker,
        computed=position if computed is None else computed,
        position=position,
    )
    return SessionSpec(
        id=name or new_name(),
        sweep=sweep,
        upload=upload,
        truth=recipe.footage and recipe.footage.truth,
        branches={FIRST: BranchSpec(title="Main", run=run)},
        bookmarks=list(bookmarks),
        created=now(),
    )


def _upload(store: Store, upload: str | None, footage: Footage | None) -> UploadRow | None:
    """Return the upload of some footage, or None if no footage is given."""
    sha256 = footage and footage.sha256
    if upload is None and footage is None:
        return None
    if upload is None and sha256 is None:
        raise RefusedError("upload is missing; upload the recording first, then name it", field="upload", bound="given")
    found = store.get(UploadRow, upload) if upload else None
    found = found or (store.upload_of(sha256) if sha256 else None)
    if found is None or sha256 not in {None, found.sha256}:
        name = (footage and footage.name) or "the recording"
        raise RefusedError(f"The upload is missing; upload {name} first.", field="upload", value=upload or sha256)
    return found


def _check_mark(footage: Footage, experiment: Experiment, kind: str) -> None:
    """Refuse a mark that the experiment does not take, or a missing mark that it needs."""
    if footage.mark is not None:
        experiment.video.mark(footage.mark)
    elif experiment.video.needs_mark(kind):
        kinds = " or ".join(kind.name() for kind in experiment.video.marks)
        raise RefusedError(f"mark is missing; give a mark of the target, as {kinds}", field="mark", bound=kinds)
