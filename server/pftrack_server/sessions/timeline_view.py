"""The view of a timeline: what each change did, and the thresholds as they changed, so that a page computes neither."""

from collections.abc import Iterator, Sequence

from pftrack.model.parameters import Declaration, Value
from pftrack_server.schemas.messages import ChangePublic, ThresholdPublic, ThresholdStep
from pftrack_server.schemas.spec import BranchSpec

__all__ = ["threshold_views", "timeline_view"]

TRACKER = "tracker"

Declarations = Sequence[Declaration]


def timeline_view(branch: BranchSpec, declarations: Declarations) -> list[ChangePublic]:
    """Return the changes of a branch, those after its first frame with the values that they replaced."""
    known = _first(branch, declarations)
    changes = []
    for change in branch.recipe.timeline:
        before = {name: known[name] for name in change.values if name in known} if change.frame > 0 else {}
        changes.append(ChangePublic(frame=change.frame, values=dict(change.values), before=before))
        known |= change.values
    return changes


def threshold_views(branch: BranchSpec, declarations: Declarations) -> list[ThresholdPublic]:
    """Return the thresholds that a tracker of the branch reads."""
    course = list(_course(branch, declarations))
    views = [
        ThresholdPublic(
            name=item.name,
            of=item.threshold_of,
            steps=[ThresholdStep(frame=frame, value=_read(item, values)) for frame, values in course],
        )
        for item in declarations
        if item.role == "threshold"
    ]
    return [view for view in views if any(step.value is not None for step in view.steps)]


def _read(declaration: Declaration, values: dict[str, Value]) -> float | None:
    """Return the value that the tracker in charge reads."""
    value = values.get(declaration.name)
    if isinstance(value, str | None) or (declaration.trackers and values.get(TRACKER) not in declaration.trackers):
        return None
    return float(value)


def _course(branch: BranchSpec, declarations: Declarations) -> Iterator[tuple[int, dict[str, Value]]]:
    """Yield the values in force from each frame on in which something changed."""
    known = _first(branch, declarations)
    for index, change in enumerate(branch.recipe.timeline):
        if index == 0 and change.frame > 0:
            yield 0, dict(known)
        known |= change.values
        yield change.frame, dict(known)
    if not branch.recipe.timeline:
        yield 0, known


def _first(branch: BranchSpec, declarations: Declarations) -> dict[str, Value]:
    """Return the values that the branch began with; of what was never stored, the default."""
    defaults = {item.name: item.default for item in declarations}
    return {**defaults, **branch.first_values, TRACKER: branch.recipe.tracker or branch.tracker}
