"""From a request to the spec of a new session."""

from pftrack.experiment import Experiment
from pftrack.experiments import EXPERIMENTS
from pftrack.parameters import ParameterError
from server.errors import RefusedError
from server.schemas.rest import SessionCreate
from server.schemas.spec import BranchSpec, ChangeModel, SessionSpec
from server.store import Store
from server.store.files import new_name, now
from server.uploads.truth import rows_of

__all__ = ["as_spec"]

FIRST = "b0"


def as_spec(body: SessionCreate, store: Store) -> SessionSpec:
    """Return the spec of a new session; its parameters are checked by the worker that makes the run.

    Raises:
        ParameterError: The experiment is unknown, or what is said of the target does not go together.
        RefusedError: There is no such upload.
    """
    if body.experiment not in EXPERIMENTS:
        raise ParameterError("experiment", body.experiment, f"one of {', '.join(EXPERIMENTS)}")
    experiment = EXPERIMENTS[body.experiment]
    _check_target(body, experiment)
    upload = store.upload(body.upload) if body.upload else None
    if body.upload and upload is None:
        raise RefusedError("There is no such upload; it may have been deleted.", field="upload", value=body.upload)
    timeline = [ChangeModel(frame=change.frame, values=change.values) for change in body.timeline]
    if body.parameters:
        timeline.insert(0, ChangeModel(frame=0, values=body.parameters))
    tracker = body.tracker or experiment.default_tracker
    branch = BranchSpec(
        id=FIRST,
        title="Main",
        tracker=tracker,
        first_tracker=body.tracker,
        timeline=timeline,
        head=body.position,
        position=body.position,
    )
    return SessionSpec(
        id=new_name(),
        experiment=body.experiment,
        seed=body.seed,
        frames=body.frames,
        upload=body.upload,
        upload_name=upload.name if upload else None,
        box=body.box,
        points=body.points or None,
        start=body.start,
        truth=rows_of(store, upload.id, experiment) if upload else None,
        branch=FIRST,
        branches={FIRST: branch},
        created=now(),
    )


def _check_target(body: SessionCreate, experiment: Experiment) -> None:
    """Refuse what is said of a target if it does not go together."""
    if body.upload is None:
        if body.box is not None or body.points:
            raise ParameterError("upload", None, "given: a target can only be marked in an upload")
    elif body.points and body.box is not None:
        raise ParameterError("box", body.box, "left out if points are given: they say where the target is")
    elif body.points and not experiment.features:
        raise ParameterError("points", ", ".join(body.points), f"left out: {experiment.id} follows a box")
    elif body.box is None and not body.points and experiment.accepts_video and not experiment.finds_target:
        raise ParameterError("box", None, "given: an upload and the box of its target belong together")
