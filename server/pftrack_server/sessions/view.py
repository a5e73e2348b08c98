"""The view of a session: what everybody outside sees of it."""

from pydantic import TypeAdapter

from pftrack.experiments import Plot, Reading
from pftrack.model.layer import Layer
from pftrack.model.palette import BRANCHES, hexadecimal
from pftrack.model.parameters import Declaration
from pftrack.model.series import Series
from pftrack_server.schemas.controls import controls_of
from pftrack_server.schemas.measures import MeasurePublic
from pftrack_server.schemas.messages import BranchPublic, ExportPublic, Phase, SessionPublic, TrackerPublic
from pftrack_server.schemas.spec import Goal, SessionSpec
from pftrack_server.sessions.timeline_view import threshold_views, timeline_view
from pftrack_server.worker.protocol import SessionInfo

__all__ = ["DECLARATIONS", "EXPORTS", "LAYERS", "PLOTS", "READINGS", "SERIES", "branch_views", "last_of", "view"]

SERIES, LAYERS = TypeAdapter(list[Series]), TypeAdapter(list[Layer])
MEASURES: TypeAdapter[list[MeasurePublic]] = TypeAdapter(list[MeasurePublic])
EXPORTS: TypeAdapter[list[ExportPublic]] = TypeAdapter(list[ExportPublic])
PLOTS, READINGS = TypeAdapter(list[Plot]), TypeAdapter(list[Reading])
DECLARATIONS: TypeAdapter[list[Declaration]] = TypeAdapter(list[Declaration])


def view(
    spec: SessionSpec,
    card: SessionInfo,
    state: Phase,
    message: str | None,
    measured: dict[str, float],
    *,
    playing: bool,
) -> SessionPublic:
    """Return a session as everybody outside sees it."""
    active = spec.active
    declarations = DECLARATIONS.validate_python(card.declarations)
    return SessionPublic(
        id=spec.id,
        recipe=active.recipe,
        title=card.title,
        unit=card.unit,
        target=card.target,
        series=SERIES.validate_python(card.series),
        plots=PLOTS.validate_python(card.plots),
        readings=READINGS.validate_python(card.readings),
        measures=MEASURES.validate_python(card.measures),
        measured=measured,
        success_measure=card.success_measure,
        exports=EXPORTS.validate_python(card.exports),
        about=card.about,
        watch=card.watch,
        tracker=active.tracker,
        frames=card.frames,
        position=active.position,
        computed=active.computed,
        goal=last_of(active.goal),
        playing=playing,
        speed=spec.speed,
        state=state,
        message=message,
        remark=spec.remark,
        parameters=spec.values,
        declarations=declarations,
        controls=controls_of(declarations, spec.values),
        trackers=[TrackerPublic(id=name, title=title) for name, title in card.trackers.items()],
        layers=LAYERS.validate_python(card.layers),
        timeline=timeline_view(active, card.declarations),
        thresholds=threshold_views(active, card.declarations),
        branch=active.id,
        branches=branch_views(spec),
        bookmarks=spec.bookmarks,
        sweep=spec.sweep,
        upload=spec.upload,
        width=card.width,
        height=card.height,
        frame_rate_hz=card.frame_rate_hz,
        created=spec.created,
        page=f"/session/{spec.id}",
        viewer=f"/viz/{spec.id}/",
    )


def last_of(goal: Goal | None) -> int | None:
    """Return the frame that a run passes last on its way to a goal."""
    return None if goal is None else max(goal)


def branch_views(spec: SessionSpec) -> list[BranchPublic]:
    """Return the branches as the page lists them, in the colours of the scene: active one, second run, the others."""
    order = sorted(spec.branches, key=lambda name: (name != spec.branch, name != spec.second))
    colours = {name: hexadecimal(BRANCHES[place % len(BRANCHES)]) for place, name in enumerate(order)}
    return [
        BranchPublic(
            id=branch.id,
            title=branch.title,
            parent=branch.parent,
            frame=branch.frame,
            tracker=branch.tracker,
            colour=colours[branch.id],
        )
        for branch in spec.branches.values()
    ]
