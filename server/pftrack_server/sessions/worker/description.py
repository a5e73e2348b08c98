"""Descriptions that a worker sends of its run, and drawings of its frames.

The unchanging part of a run is sent once. Its timeline is sent with the effect of each change, and thresholds with
their changes, so that a page computes neither. A frame is drawn together with what a person inspects in it.
"""

import base64
import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.analysis.fitting import fittable
from pftrack.core.model.drawing import COLOURS, Drawing, Key, drawn_keys
from pftrack.core.model.faults import without_faults
from pftrack.core.model.likelihood import Contributions, Genealogy, LikelihoodMap, Part, Patches
from pftrack.core.model.parameters import Declaration, Value, flat, with_role
from pftrack.core.model.preset import Preset
from pftrack.core.model.recipe import Change, Move
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.experiments.own.code import with_digests
from pftrack.experiments.own.extension import parameters_of
from pftrack.experiments.shared.loss_probability import LOSS_PROBABILITY
from pftrack.output.displays import draw_arrows, draw_likelihood, draw_place
from pftrack.output.exports.formats import exports_of
from pftrack.runs.inspection import Inspection
from pftrack.runs.run import Run
from pftrack.vision.rendering import png
from pftrack_server.core.panel import TrackerPublic
from pftrack_server.sessions import spec
from pftrack_server.sessions.worker import protocol

MOST_LINES = 60
"""Most lines of a genealogy; more cannot be distinguished on a page."""


def describe(run: Run) -> spec.SessionDescription:
    """Return the unchanging part of a session whose active branch is this run."""
    experiment, setup, source, footage = run.experiment, run.setup, run.source, run.recipe.footage
    told = (LOSS_PROBABILITY,) if experiment.quality.loss_probability.models_on(footage) else ()
    width, height = source.size
    preset = _preset_of(run)
    # The sliders of a person's own filter come first.
    own = [name for tracker, texts in experiment.filters.items() for name in parameters_of(tracker, texts)]
    truth = experiment.video.truth if footage else None
    return spec.SessionDescription(
        **vars(experiment.display) | {"unit": experiment.judge.unit, "target": experiment.texts.target},
        title=experiment.title_on(footage),
        subject=footage.title if footage else preset.title if preset else "",
        series=[*experiment.all_series(), *told],
        measures=[spec.MeasurePublic(**measure.as_dict()) for measure in experiment.measures_on(setup.footage)],
        success_measure=setup.success,
        exports=list(exports_of(experiment)),
        about=[*own, *experiment.subjects(preset, footage)],
        watch=preset.watch if preset else "",
        truth_columns=list(truth.form.columns) if truth else [],
        truth_mark=spec.TruthMark(editor=truth.mark.editor(), parts=list(truth.parts))
        if truth and truth.mark
        else None,
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
        width=width,
        height=height,
        frame_rate_hz=source.frame_rate_hz,
        frames=run.frames,
    )


def _preset_of(run: Run) -> Preset | None:
    """Return the preset that a run begins as; None on a recording."""
    if run.recipe.footage is not None:
        return None
    values, defaults = flat(run.parameters_at(0)), flat(run.setup.parameters)
    return run.experiment.preset_of(run.tracker_at(0), run.recipe.seed, values, defaults)


def describe_timeline(run: Run) -> dict[str, Any]:
    """Return the snapshot fields that come from a run's recipe (without the truth) and its timeline."""
    changes, first = run.timeline.changes, {**flat(run.parameters_at(0)), "tracker": run.tracker, "seed": run.seed}
    declared = run.experiment.declarations(type(run.setup.parameters))
    return {
        "recipe": with_digests(run.recipe.with_footage(truth=None)),
        "timeline": timeline_view(changes, first),
        "thresholds": threshold_views(changes, first, declared),
    }


def timeline_view(timeline: Sequence[Change], first: Mapping[str, Value]) -> list[spec.ChangePublic]:
    """Return the changes of a run; those after its first frame include the values that they replaced.

    Args:
        timeline: The changes.
        first: The values in frame 0, including the tracker's name.
    """
    known = dict(first)
    changes = []
    for change in timeline:
        values = {name: value for name, value in change.values.items() if name != "move"}
        before = {name: known[name] for name in values if name in known} if change.frame > 0 else {}
        moved = [Move.model_validate(move).words for move in change.values.get("move", ())]
        changes.append(spec.ChangePublic(frame=change.frame, values=values, before=before, moved=moved))
        known |= values
    return changes


def threshold_views(
    timeline: Sequence[Change], first: Mapping[str, Value], declarations: Sequence[Declaration]
) -> list[spec.ThresholdPublic]:
    """Return the thresholds that a tracker of the run reads.

    Args:
        timeline: The changes.
        first: The values in frame 0, including the tracker's name.
        declarations: Declarations of the parameters.
    """
    known = dict(first)
    course = {0: known}
    for change in timeline:
        course[change.frame] = known = {**known, **change.values}
    views = [
        spec.ThresholdPublic(
            name=item.name,
            of=item.threshold_of,
            steps=[spec.ThresholdStep(frame=frame, value=_read(item, values)) for frame, values in course.items()],
        )
        for item in declarations
        if item.role == "threshold"
    ]
    return [view for view in views if any(step.value is not None for step in view.steps)]


def _read(declaration: Declaration, values: Mapping[str, Value]) -> float | None:
    """Return the value that the tracker of these values reads."""
    value = values.get(declaration.name)
    if isinstance(value, str | None) or (declaration.trackers and values.get("tracker") not in declaration.trackers):
        return None
    return float(value)


def with_loss(rows: Sequence[dict[str, Any]], probabilities: Sequence[float]) -> list[dict[str, Any]]:
    """Return diagnostics with the probability that the target is lost, where it is known.

    Args:
        rows: Diagnostics of any frames.
        probabilities: Probability by frame number; NaN where unknown.
    """
    known = ((row, probabilities[row["frame"]]) for row in rows)
    return [
        row if math.isnan(one) else row | {"series": {**row["series"], LOSS_PROBABILITY.name: one}}
        for row, one in known
    ]


class FrameView:
    """Draws frames; remembers what is inspected and the legend so far."""

    def __init__(self) -> None:
        """Begin with nothing inspected and an empty legend."""
        self._wanted = protocol.Inspect()
        self._inspection: Inspection | None = None
        self._particle: tuple[int, int] | None = None
        self._map: tuple[Any, LikelihoodMap | None] = None, None
        self._legend: tuple[str, dict[tuple[str, Key], None]] = "", {}

    def draw(self, run: Run, other: Diagnostics | None) -> Drawing:
        """Return the drawing of a run's shown frame, without invalid primitives.

        Args:
            run: The shown run.
            other: Diagnostics of the same frame in another run, for comparison.
        """
        step = _step_to_draw(run)
        past = run.diagnostics[: step.frame.index + 1]
        drawing = without_faults(run.experiment.draw(step, past, other))
        wanted = self._wanted
        if wanted.likelihood or wanted.pulls or wanted.place is not None or self._particle is not None:
            drawing = self._draw_looked_at(run, drawing)
        drawn = dict.fromkeys(drawn_keys(drawing, run.experiment.display.layers))
        if self._legend[0] != step.tracker:
            self._legend = step.tracker, {}
        # A key stays in the legend once drawn, since the legend would flicker otherwise; keys of the first frame, whose
        # belief may be of another kind, do not stay.
        if step.frame.index > 0:
            self._legend[1].update(drawn)
        legend = sorted({**self._legend[1], **drawn}, key=lambda entry: list(COLOURS).index(entry[1].colour))
        return dataclasses.replace(drawing, legend=tuple(legend))

    def inspect(self, run: Run, wanted: protocol.Inspect) -> protocol.InspectionPublic:
        """Inspect something else from now on, and return the findings in the shown frame.

        Raises:
            ParameterError: The particle does not exist, or the tracker has no likelihood of places; nothing has
                changed.
        """
        inspection = self._inspect(run)
        particle = None
        if wanted.picks and wanted.place is not None:
            nearest = inspection.nearest(np.array(wanted.place))
            particle = None if nearest is None else (run.position, nearest)
        elif wanted.particle is not None:
            particle = (run.position if wanted.frame is None else wanted.frame, wanted.particle)
        place = None if wanted.place is None or particle is not None else np.array(wanted.place)
        followed = None if particle is None else inspection.follow(particle[1], particle[0])
        if followed is not None:
            finding = inspection.at_particle(followed)
        else:
            finding = inspection.at_estimate() if place is None else inspection.at_place(place)
        self._wanted = wanted.model_copy(update={"place": None if place is None else wanted.place})
        self._particle = particle if followed is None else (run.position, followed)
        subject = "place" if place is not None else "estimate"
        if particle is not None:
            subject = "gone" if followed is None else "particle"
        found = self._find_map(run, _size(run)) if wanted.likelihood else None
        lineage = inspection.genealogy(followed) if wanted.genealogy else None
        model = inspection.tracker.model
        return protocol.InspectionPublic(
            frame=run.position,
            subject=subject,
            place=None if finding.place is None or not np.isfinite(finding.place).all() else tuple(finding.place),
            title=finding.title,
            has_map=model is not None and model.has_place,
            scale=None if found is None else found.range,
            log_likelihood=finding.log_likelihood,
            impossible=finding.log_likelihood == -math.inf,
            parts=[_part(each) for each in finding.parts],
            state=[protocol.StateValue(name=one.name, unit=one.unit, value=value) for one, value in finding.state],
            particle=finding.particle,
            update=[_part(each) for each in inspection.update_parts()],
            courses=inspection.courses(),
            genealogy=None if lineage is None else _genealogy(lineage),
        )

    def _draw_looked_at(self, run: Run, drawing: Drawing) -> Drawing:
        """Return a drawing of the shown frame together with what is inspected."""
        inspection, wanted = self._inspect(run), self._wanted
        if wanted.likelihood and (found := self._find_map(run, (drawing.width, drawing.height))) is not None:
            drawing = draw_likelihood(drawing, found)
        if wanted.pulls:
            told = (part for part in inspection.update_parts() if isinstance(part, Contributions))
            arrows = [arrow for part in told for arrow in part.arrows]
            drawing = draw_arrows(drawing, arrows) if arrows else drawing
        if self._particle is not None:
            frame, particle = self._particle
            followed = inspection.follow(particle, frame)
            if followed is None:
                return drawing
            self._particle = run.position, followed
            finding = inspection.at_particle(followed)
            if finding.place is not None and finding.particle is not None and np.isfinite(finding.place).all():
                return draw_place(drawing, finding.place, finding.particle.path)
        elif wanted.place is not None:
            return draw_place(drawing, np.array(wanted.place), np.empty((0, 2)))
        return drawing

    def _inspect(self, run: Run) -> Inspection:
        if self._inspection is None or self._inspection.run is not run:
            self._inspection, self._map = Inspection(run), (None, None)
        return self._inspection

    def _find_map(self, run: Run, size: tuple[int, int]) -> LikelihoodMap | None:
        inspection = self._inspect(run)
        of = run.position, run.current.tracker, size, inspection.parameters
        if self._map[0] != of:
            self._map = of, inspection.map(size)
        return self._map[1]


def _genealogy(found: Genealogy) -> protocol.GenealogyPublic:
    return protocol.GenealogyPublic(
        first=found.frames[0],
        counts=found.counts.tolist(),
        coalesced=found.coalesced,
        lines=np.round(found.lines(MOST_LINES), 4).T.tolist(),
    )


def _part(part: Part) -> protocol.PartPublic:
    if isinstance(part, Patches):
        return protocol.PatchesPublic(
            title=part.title, expected=_address(part.expected_rgb), found=_address(part.found_rgb)
        )
    return part


def _address(image_rgb: NDArray[np.uint8]) -> str | None:
    if not image_rgb.size:
        return None
    return f"data:image/png;base64,{base64.b64encode(png(np.ascontiguousarray(image_rgb))).decode()}"


def _step_to_draw(run: Run) -> Step:
    """Return the shown step, with the values that only affect drawing, and moved beliefs, as for the next frame."""
    step, following = run.current, run.parameters_at(run.position + 1)
    shown = {item.name: getattr(following, item.name) for item in with_role(type(following), "drawing")}
    parameters = step.parameters.model_copy(update=shown) if shown else step.parameters
    return dataclasses.replace(step, state=run.moved, parameters=parameters)


def _size(run: Run) -> tuple[int, int]:
    """Return width and height of the shown frame's drawing, px."""
    image = run.current.frame.image_rgb
    if image is not None:
        return image.shape[1], image.shape[0]
    step = _step_to_draw(run)
    drawing = run.experiment.draw(step, run.diagnostics[: step.frame.index + 1])
    return drawing.width, drawing.height
