"""Access: the one place that checks every request and websocket that comes by the link of a class.

Their addresses begin with `/f/` and the link. No other address gives these rights, so nobody is a follower by accident,
and a lecturer who opens the link in the same browser stays a lecturer elsewhere. The guard reads the link, checks that
its class still runs and that its role may make the request (`roles`), and adds the link to the base path, so that the
app sees the usual address. A socket ends when its class ends, or when the class no longer follows its content.
"""

import contextlib
import html

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from pftrack_server.core import errors
from pftrack_server.core.base_path import GUEST, LINKS, address_of, encode_path, route_path
from pftrack_server.core.errors import ApiError, forbidden, unauthorized
from pftrack_server.core.frontend import FRONTEND
from pftrack_server.teaching.follow import LECTURER, Participant
from pftrack_server.teaching.follows import Follows
from pftrack_server.teaching.roles import Standing, is_allowed

COOKIE = "pftrack_seat"
PAGE = "/follow"
"""Path of the followers' page in the app."""
ELSEWHERE = "The class no longer follows this."
REFUSAL = FRONTEND / "follow" / "refused.html"
"""Page of a refused link; it needs no other file, since without a valid link none is served."""


class AccessGuard:
    """ASGI middleware that checks requests by the link of a class, and passes all others on."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check one request or websocket that comes by a link."""
        if scope["type"] not in {"http", "websocket"} or not route_path(scope).startswith(f"{LINKS}/"):
            await self._app(scope, receive, send)
            return
        try:
            participant, inner = self._admit(scope)
            if route_path(inner) == "/":
                await RedirectResponse(address_of(inner, _start_address(participant)))(scope, receive, send)
            elif scope["type"] == "websocket":
                await self._serve_socket(participant, inner, receive, send)
            else:
                await self._app(inner, receive, _send_with_seat(participant, inner, send))
        except ApiError as error:
            await _refuse(scope, receive, send, error)

    def _admit(self, scope: Scope) -> tuple[Participant, Scope]:
        """Return the participant, and the request's scope for the app.

        Raises:
            ApiError: The link or the request is refused.
        """
        follows = _follows(scope)
        link, _, rest = route_path(scope).removeprefix(f"{LINKS}/").partition("/")
        claim, follow = follows.resolve(link)
        path = f"/{rest}"
        if path == "/" and claim.role == "follower" and link == claim.link:
            path = PAGE
        kept = HTTPConnection(scope).cookies.get(COOKIE, "")
        seat = LECTURER if claim.role == "owner" else follows.links.read_seat(claim.follow, kept)
        role: Standing = claim.role if seat is not None else "stranger"
        participant = Participant(
            follow, claim, seat if seat is not None else follows.links.new_seat(claim.follow), role
        )
        method = "WS" if scope["type"] == "websocket" else scope["method"]
        if path != "/" and not is_allowed(role, participant.reach, method, path):
            if role == "stranger":
                raise unauthorized("Open the link of the class first; its page lets this browser in.")
            raise forbidden("Followers may watch, answer and try a copy; this is for the lecturer.")
        follow.forks.touch(participant.seat, path)
        root = f"{scope['root_path']}{LINKS}/{claim.link}"
        whole = root + path
        address = {"root_path": root, "path": whole, "raw_path": encode_path(whole).encode()}
        return participant, {**scope, **address, GUEST: participant}

    async def _serve_socket(self, participant: Participant, scope: Scope, receive: Receive, send: Send) -> None:
        _follows(scope).check_room()
        follow = participant.follow
        with follow.followers.take(participant.seat, route_path(scope), follow.content.wanted.most_followers) as hold:
            try:
                async with hold:
                    await self._app(scope, receive, send)
            except TimeoutError:
                if not hold.expired():
                    raise
                closing = {"type": "websocket.close", "code": errors.ENDED, "reason": follow.ended or ELSEWHERE}
                # A browser learns the reason only on an accepted socket; this one may be accepted or closed already.
                for message in ({"type": "websocket.accept"}, closing):
                    with contextlib.suppress(RuntimeError, OSError):
                        await send(message)


def _follows(scope: Scope) -> Follows:
    found: Follows = scope["app"].state.services[Follows]
    return found


def _start_address(participant: Participant) -> str:
    """Return a participant's first page, relative to the base: the followers' page, or what the lecturer shows."""
    shown = participant.follow.content
    if participant.claim.role == "follower":
        return ""
    session = next(iter(shown.sessions), None)
    return f"session/{session}" if session else f"learn/{shown.lesson_id}"


def _send_with_seat(participant: Participant, scope: Scope, send: Send) -> Send:
    """Give a new browser a seat, together with its first page."""
    if participant.role != "stranger" or route_path(scope) != PAGE:
        return send
    carrier = Response()
    carrier.set_cookie(
        COOKIE,
        participant.seat,
        path=address_of(scope).removesuffix("/"),  # the followers' page may be requested without the slash
        httponly=True,
        samesite="lax",
        secure=scope["scheme"] == "https",
    )

    async def send_with_cookie(message: Message) -> None:
        if message["type"] == "http.response.start":
            MutableHeaders(scope=message).append("set-cookie", carrier.headers["set-cookie"])
        await send(message)

    return send_with_cookie


async def _refuse(scope: Scope, receive: Receive, send: Send, error: ApiError) -> None:
    if scope["type"] == "websocket":
        with contextlib.suppress(WebSocketDisconnect):
            await errors.close(WebSocket(scope, receive, send), error.status, str(error))
        return
    is_page = scope["method"] == "GET" and "text/html" in Headers(scope=scope).get("accept", "")
    answer = (
        HTMLResponse(REFUSAL.read_text(encoding="utf-8").replace("{message}", html.escape(str(error))), error.status)
        if is_page
        else errors.response(error.status, errors.detail_of(error))
    )
    answer.headers["Cache-Control"] = "no-store"
    await answer(scope, receive, send)
