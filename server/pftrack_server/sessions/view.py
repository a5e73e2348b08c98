"""The view of a session: what everybody outside sees of it."""

from pftrack.core.model.palette import BRANCHES, hexadecimal
from pftrack_server.schemas.controls import controls_of
from pftrack_server.schemas.description import SessionDescription
from pftrack_server.schemas.messages import SessionPublic
from pftrack_server.schemas.snapshot import BranchPublic, SessionSnapshot
from pftrack_server.schemas.spec import SessionSpec


def view(spec: SessionSpec, description: SessionDescription, snapshot: SessionSnapshot) -> SessionPublic:
    """Return a session as everybody outside sees it: what is fixed of it, what moves, and where it is found."""
    return SessionPublic.model_construct(
        **vars(description),
        **vars(snapshot),
        id=spec.id,
        controls=controls_of(description.declarations, snapshot.parameters),
        sweep=spec.sweep,
        upload=spec.upload,
        created=spec.created,
        page=f"session/{spec.id}",
        thumbnail=f"api/v1/sessions/{spec.id}/thumbnail.png",
        viewer=f"viz/{spec.id}/",
    )


def branch_views(spec: SessionSpec) -> list[BranchPublic]:
    """Return the branches as the page lists them, in the colours of the scene: active one, second run, the others."""
    order = sorted(spec.branches, key=lambda name: (name != spec.branch, name != spec.run.second))
    colours = {name: hexadecimal(BRANCHES[place % len(BRANCHES)]) for place, name in enumerate(order)}
    return [
        BranchPublic(
            id=name,
            title=branch.title,
            parent=branch.parent,
            frame=branch.frame,
            tracker=branch.run.tracker,
            colour=colours[name],
        )
        for name, branch in spec.branches.items()
    ]
