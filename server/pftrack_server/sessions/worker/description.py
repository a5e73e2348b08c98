"""What a worker tells of its run: what is fixed of it, and its timeline with what each change did.

Thresholds are told as they changed, so that a page computes neither.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from pftrack.analysis.fitting import fittable
from pftrack.core.model.parameters import Declaration, Value, flat
from pftrack.core.model.preset import Preset
from pftrack.core.model.recipe import Change
from pftrack.experiments.own.code import with_digests
from pftrack.experiments.own.extension import parameters_of
from pftrack.experiments.shared.loss_probability import LOSS_PROBABILITY
from pftrack.output.exports.formats import exports_of
from pftrack.runs.run import Run
from pftrack_server.sessions.spec import (
    ChangePublic,
    MeasurePublic,
    SessionDescription,
    ThresholdPublic,
    ThresholdStep,
    TrackerPublic,
    TruthMark,
)


def describe(run: Run) -> SessionDescription:
    """Return what is fixed of a session whose active branch is this run."""
    experiment, setup, source, footage = run.experiment, run.setup, run.source, run.recipe.footage
    told = (LOSS_PROBABILITY,) if experiment.quality.loss_probability.models_on(footage) else ()
    width, height = source.size
    preset = _preset_of(run)
    # Whoever writes a filter wants its sliders at hand.
    own = [name for tracker, texts in experiment.filters.items() for name in parameters_of(tracker, texts)]
    truth = experiment.video.truth if footage else None
    return SessionDescription(
        title=experiment.title_on(footage),
        subject=footage.title if footage else preset.title if preset else "",
        unit=experiment.unit,
        target=experiment.target,
        series=[*experiment.all_series(), *told],
        plots=list(experiment.plots),
        readings=list(experiment.readings),
        measures=[MeasurePublic(**measure.as_dict()) for measure in experiment.measures_on(setup.footage)],
        success_measure=setup.success,
        exports=list(exports_of(experiment)),
        about=[*own, *experiment.subjects(preset, footage)],
        watch=preset.watch if preset else "",
        truth_columns=list(truth.form.columns) if truth else [],
        truth_mark=TruthMark(editor=truth.mark.editor(), parts=list(truth.parts)) if truth and truth.mark else None,
        declarations=list(experiment.declarations(type(setup.parameters))),
        trackers=[
            TrackerPublic(id=name, title=tracker.title, replays=tracker.replays)
            for name, tracker in experiment.trackers.items()
        ],
        fittable={
            name: [it.name for it in numbers]
            for name in experiment.trackers
            if (numbers := fittable(experiment, name, type(setup.parameters)))
        },
        layers=list(experiment.layers),
        worlds=list(experiment.worlds),
        width=width,
        height=height,
        frame_rate_hz=source.frame_rate_hz,
        frames=run.frames,
    )


def _preset_of(run: Run) -> Preset | None:
    """Return the preset that a run begins as; a recording is none."""
    if run.recipe.footage is not None:
        return None
    values, defaults = flat(run.parameters_at(0)), flat(run.setup.parameters)
    return run.experiment.preset_of(run.tracker_at(0), run.recipe.seed, values, defaults)


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
    known = dict(first)
    course = {0: known}
    for change in timeline:
        course[change.frame] = known = {**known, **change.values}
    views = [
        ThresholdPublic(
            name=item.name,
            of=item.threshold_of,
            steps=[ThresholdStep(frame=frame, value=_read(item, values)) for frame, values in course.items()],
        )
        for item in declarations
        if item.role == "threshold"
    ]
    return [view for view in views if any(step.value is not None for step in view.steps)]


def _read(declaration: Declaration, values: Mapping[str, Value]) -> float | None:
    """Return the value that the tracker in charge reads."""
    value = values.get(declaration.name)
    if isinstance(value, str | None) or (declaration.trackers and values.get("tracker") not in declaration.trackers):
        return None
    return float(value)


def with_loss(rows: Sequence[dict[str, Any]], probabilities: Sequence[float]) -> list[dict[str, Any]]:
    """Return diagnostics with the probability that the target is lost, where that is known.

    Args:
        rows: Of any frames.
        probabilities: By the number of the frame; NaN where it is not known.
    """
    known = ((row, probabilities[row["frame"]]) for row in rows)
    return [
        row if math.isnan(one) else row | {"series": {**row["series"], LOSS_PROBABILITY.name: one}}
        for row, one in known
    ]
