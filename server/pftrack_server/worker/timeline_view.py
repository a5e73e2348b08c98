"""The view of a timeline: what each change did, and the thresholds as they changed, so that a page computes neither."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pftrack.core.model.parameters import Declaration, Value, flat
from pftrack.core.model.recipe import Change
from pftrack.experiments.own.code import with_digests
from pftrack.runs.run import Run
from pftrack_server.schemas.snapshot import ChangePublic, ThresholdPublic, ThresholdStep

TRACKER = "tracker"


def describe_timeline(run: Run) -> dict[str, Any]:
    """Return what a snapshot tells of a run's recipe, without the truth, and of its timeline, by field."""
    changes, first = run.timeline.changes, {**flat(run.parameters_at(0)), "tracker": run.tracker, "seed": run.seed}
    declared = run.experiment.declarations(type(run.setup.parameters))
    return {
        "recipe": with_digests(run.recipe.with_footage(truth=None)),
        "timeline": timeline_view(changes, first),
        "thresholds": threshold_views(changes, first, declared),
    }


def timeline_view(timeline: Sequence[Change], first: Mapping[str, Value]) -> list[ChangePublic]:
    """Return the changes of a run, those after its first frame with the values that they replaced.

    Args:
        timeline: The changes.
        first: The values in force in frame 0, the tracker's name among them.
    """
    known = dict(first)
    changes = []
    for change in timeline:
        before = {name: known[name] for name in change.values if name in known} if change.frame > 0 else {}
        changes.append(ChangePublic(frame=change.frame, values=dict(change.values), before=before))
        known |= change.values
    return changes


def threshold_views(
    timeline: Sequence[Change], first: Mapping[str, Value], declarations: Sequence[Declaration]
) -> list[ThresholdPublic]:
    """Return the thresholds that a tracker of the run reads.

    Args:
        timeline: The changes.
        first: The values in force in frame 0, the tracker's name among them.
        declarations: Of the parameters.
    """
    course = list(_course(timeline, first))
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


def _read(declaration: Declaration, values: Mapping[str, Value]) -> float | None:
    """Return the value that the tracker in charge reads."""
    value = values.get(declaration.name)
    if isinstance(value, str | None) or (declaration.trackers and values.get(TRACKER) not in declaration.trackers):
        return None
    return float(value)


def _course(timeline: Sequence[Change], first: Mapping[str, Value]) -> Iterator[tuple[int, dict[str, Value]]]:
    """Yield the values in force from each frame on in which something changed."""
    known = dict(first)
    for index, change in enumerate(timeline):
        if index == 0 and change.frame > 0:
            yield 0, dict(known)
        known |= change.values
        yield change.frame, dict(known)
    if not timeline:
        yield 0, known
