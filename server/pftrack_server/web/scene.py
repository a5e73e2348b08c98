"""The scene: viser's client and its websocket, at the session's own address and on the server's own port."""

import asyncio
from importlib import import_module

from fastapi import APIRouter, Request, WebSocket
from starlette.responses import RedirectResponse, Response

from pftrack_server.core.base_path import address_of, guest_of
from pftrack_server.core.errors import not_found
from pftrack_server.sessions.routes import ASession

router = APIRouter(prefix="/viz", include_in_schema=False)


@router.get("/client/{name}")
def client_file(request: Request, name: str) -> Response:
    """Return a file of viser's client; its name is made from its content, so browsers may cache it for ever."""
    from pftrack_server.viewer import client_asset  # noqa: PLC0415 - 15 MiB, imported when somebody first looks

    file = client_asset(name)
    if file is None:
        raise not_found("The client has no file of this name.")
    headers = {"Cache-Control": "public, max-age=31536000, immutable", "Vary": "Accept-Encoding"}
    if "gzip" in request.headers.get("accept-encoding", ""):
        return Response(file.packed, media_type=file.media_type, headers={**headers, "Content-Encoding": "gzip"})
    return Response(file.content, media_type=file.media_type, headers=headers)


@router.get("/{session}")
async def without_slash(request: Request, session: ASession) -> Response:
    """Redirect to the address from which the client finds its websocket."""
    return RedirectResponse(address_of(request.scope, f"viz/{session.spec.id}/"))


@router.get("/{session}/")
def page(session: ASession) -> Response:
    """Return viser's client."""
    from pftrack_server.viewer import CONTENT_SECURITY_POLICY, client_page  # noqa: PLC0415 - see `client_file`

    del session  # only its existence was to be checked
    headers = {"Content-Security-Policy": CONTENT_SECURITY_POLICY, "Cache-Control": "no-cache"}
    return Response(client_page(), media_type="text/html; charset=utf-8", headers=headers)


@router.websocket("/{session}")
@router.websocket("/{session}/")
async def websocket(websocket: WebSocket, session: ASession) -> None:
    """Connect a browser to the session's scene."""
    # In a thread, as in `client_file`, since it takes 0.3 s or more, and the page may come from an earlier server.
    viewer = await asyncio.to_thread(import_module, "pftrack_server.viewer")
    guest = guest_of(websocket.scope)
    looks_only = guest is not None and not guest.may_steer(session.spec.id)
    with session.scene_feed.watch():
        await viewer.bridge(websocket, session.open_scene(), looks_only=looks_only)
