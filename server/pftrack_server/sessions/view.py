"""The view of a session: what everybody outside sees of it."""

from pftrack.model.palette import BRANCHES, hexadecimal
from pftrack_server.schemas.controls import controls_of
from pftrack_server.schemas.description import SessionDescription
from pftrack_server.schemas.messages import BranchPublic, Phase, SessionPublic
from pftrack_server.schemas.spec import Goal, SessionSpec
from pftrack_server.sessions.timeline_view import threshold_views, timeline_view

__all__ = ["branch_views", "last_of", "view"]


def view(
    spec: SessionSpec,
    description: SessionDescription,
    state: Phase,
    message: str | None,
    measured: dict[str, float],
    *,
    playing: bool,
) -> SessionPublic:
    """Return a session as everybody outside sees it."""
    active = spec.active
    return SessionPublic.model_construct(
        **vars(description),
        id=spec.id,
        recipe=active.recipe,
        measured=measured,
        tracker=active.tracker,
        position=active.position,
        computed=active.computed,
        goal=last_of(active.goal),
        playing=playing,
        speed=spec.speed,
        state=state,
        message=message,
        remark=spec.remark,
        parameters=spec.values,
        controls=controls_of(description.declarations, spec.values),
        timeline=timeline_view(active, description.declarations),
        thresholds=threshold_views(active, description.declarations),
        branch=active.id,
        branches=branch_views(spec),
        bookmarks=spec.bookmarks,
        sweep=spec.sweep,
        upload=spec.upload,
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
