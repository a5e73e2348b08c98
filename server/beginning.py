"""Beginnings: from what somebody wishes to the spec of a new session."""

from pftrack.experiments import EXPERIMENTS
from pftrack.parameters import ParameterError
from server.api.models import SessionWish
from server.errors import RefusedError
from server.sessions.spec import BranchSpec, ChangeModel, SessionSpec
from server.store import Store
from server.store.files import new_name, now

__all__ = ["as_spec"]

FIRST = "b0"


def as_spec(wish: SessionWish, store: Store) -> SessionSpec:
    """Return the spec of a new session; its parameters are checked by the worker that makes the run.

    Raises:
        ParameterError: The experiment is unknown, or upload and box do not come together.
        RefusedError: There is no such upload.
    """
    if wish.experiment not in EXPERIMENTS:
        raise ParameterError("experiment", wish.experiment, f"one of {', '.join(EXPERIMENTS)}")
    if (wish.upload is None) != (wish.box is None):
        missing = "box" if wish.box is None else "upload"
        raise ParameterError(missing, None, "given: an upload and the box of its target belong together")
    upload = store.upload(wish.upload) if wish.upload else None
    if wish.upload and upload is None:
        raise RefusedError("There is no such upload; it may have been deleted.", field="upload", value=wish.upload)
    timeline = [ChangeModel(frame=change.frame, values=change.values) for change in wish.timeline]
    if wish.parameters:
        timeline.insert(0, ChangeModel(frame=0, values=wish.parameters))
    tracker = wish.tracker or EXPERIMENTS[wish.experiment].default_tracker
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
        start=wish.start,
        branch=FIRST,
        branches={FIRST: branch},
        created=now(),
    )
