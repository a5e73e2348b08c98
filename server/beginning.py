"""Beginnings: from what somebody wishes to the spec of a new session."""

from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.experiment import Experiment
from pftrack.parameters import ParameterError
from server.api.models import SessionWish
from server.errors import RefusedError
from server.sessions.spec import BranchSpec, ChangeModel, SessionSpec
from server.store import Store
from server.store.files import new_name, now
from server.truths import rows_of

__all__ = ["as_spec"]

FIRST = "b0"


def as_spec(wish: SessionWish, store: Store) -> SessionSpec:
    """Return the spec of a new session; its parameters are checked by the worker that makes the run.

    Raises:
        ParameterError: The experiment is unknown, or what is said of the target does not go together.
        RefusedError: There is no such upload.
    """
    if wish.experiment not in EXPERIMENTS:
        raise ParameterError("experiment", wish.experiment, f"one of {', '.join(EXPERIMENTS)}")
    experiment = EXPERIMENTS[wish.experiment]
    _check_target(wish, experiment)
    upload = store.upload(wish.upload) if wish.upload else None
    if wish.upload and upload is None:
        raise RefusedError("There is no such upload; it may have been deleted.", field="upload", value=wish.upload)
    timeline = [ChangeModel(frame=change.frame, values=change.values) for change in wish.timeline]
    if wish.parameters:
        timeline.insert(0, ChangeModel(frame=0, values=wish.parameters))
    tracker = wish.tracker or experiment.default_tracker
    branch = BranchSpec(
        id=FIRST,
        title="Main",
        tracker=tracker,
        first_tracker=wish.tracker,
        timeline=timeline,
        head=wish.position,
        position=wish.position,
    )
    return SessionSpec(
        id=new_name(),
        experiment=wish.experiment,
        seed=wish.seed,
        frames=wish.frames,
        upload=wish.upload,
        upload_name=upload.name if upload else None,
        box=wish.box,
        points=wish.points or None,
        start=wish.start,
        truth=rows_of(store, upload.id, experiment) if upload else None,
        branch=FIRST,
        branches={FIRST: branch},
        created=now(),
    )


def _check_target(wish: SessionWish, experiment: Experiment) -> None:
    """Refuse what is said of a target if it does not go together."""
    if wish.upload is None:
        if wish.box is not None or wish.points:
            raise ParameterError("upload", None, "given: a target can only be marked in an upload")
    elif wish.points and wish.box is not None:
        raise ParameterError("box", wish.box, "left out if points are given: they say where the target is")
    elif wish.points and not experiment.features:
        raise ParameterError("points", ", ".join(wish.points), f"left out: {experiment.id} follows a box")
    elif wish.box is None and not wish.points and experiment.accepts_video and not experiment.finds_target:
        raise ParameterError("box", None, "given: an upload and the box of its target belong together")
