"""Opening: from a row of a sweep to a live session that computes the same numbers, paused shortly before the loss."""

from pftrack.core.model.recipe import Footage
from pftrack.runs.loss import APPROACH_FRAMES, approach
from pftrack.sweep import Plan
from pftrack_server.errors import ConflictError, RefusedError
from pftrack_server.schemas.spec import SessionSpec
from pftrack_server.schemas.sweep_views import RowPublic
from pftrack_server.sessions.create import new_spec
from pftrack_server.store import Store
from pftrack_server.store.tables import UploadRow
from pftrack_server.sweeps.results import Results


def session_spec(store: Store, sweep: str, plan: Plan, results: Results, run: int, tracker: str | None) -> SessionSpec:
    """Return the spec of a session with exactly one run of a sweep, or the same with another method.

    The session stands ten frames before the first lost frame; with another method that lost nothing, where the run of
    the row would. It is computed to ten frames after it, so that one can ask at once why it was lost.

    Raises:
        NotFoundError: The sweep has no such run.
        RefusedError: It has no such method.
        ConflictError: The run could not be computed, or its recording is no longer here.
    """
    row = results.row(run)
    if row.problem is not None:
        raise ConflictError(f"This run could not be computed: {row.problem}.")
    method = tracker or row.tracker
    if method not in plan.wiring.trackers:
        known = ", ".join(plan.wiring.trackers)
        raise RefusedError(
            f"tracker must be one of {known}, got {method}.", field="tracker", bound=f"one of {known}", value=method
        )
    single = plan.single(run)
    loss, last = _loss(plan, results, row, method), plan.frames - 1
    position, computed = (0, 0) if loss is None else (min(approach(loss), last), min(loss + APPROACH_FRAMES, last))
    recipe = single.recipe.model_copy(update={"tracker": method})
    upload = None if plan.footage is None else upload_of(store, plan).id
    return new_spec(recipe, sweep=sweep, upload=upload, position=position, computed=computed)


def upload_of(store: Store, plan: Plan) -> UploadRow:
    """Return the upload on which the runs of a plan are.

    Raises:
        ConflictError: It is no longer here.
    """
    footage = plan.footage or Footage()
    found = store.upload_of(footage.sha256 or "")
    if found is None:
        name = footage.name or "a recording"
        raise ConflictError(f"The sweep is on {name}, which is no longer on this server; upload it first.")
    return found


def _loss(plan: Plan, results: Results, row: RowPublic, method: str) -> int | None:
    """Return the first lost frame of the run that is opened; if it loses nothing, that of the row."""
    if method == row.tracker or method not in plan.trackers:
        return row.first_lost_frame
    twin = row.run + plan.trackers.index(method) - plan.trackers.index(row.tracker)
    other = results.row(twin).first_lost_frame
    return row.first_lost_frame if other is None else other
