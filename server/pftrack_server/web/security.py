"""Security: checks of every request before any other code sees it.

Three checks are in one ASGI middleware, because FastAPI's own http middleware never sees a websocket:

1. *Host* must be a name of this server. A page of another site whose name was rebound to 127.0.0.1 sends its own.
2. *Origin* of every state-changing request and of every websocket must be the server itself. Programs other than
browsers send none, and a page cannot trick them.
3. *Token*, if other machines can reach the server: given once in the link, then as an HttpOnly cookie. A program sends
it as a bearer; an address that keeps it would end up in histories and logs. A person without it sees a page that asks
for it. Followers of a class have none; `pftrack_server.teaching.access` checks all addresses below `/f/`.

Scheme, host and path are already those that the browser used (`pftrack_server.web.middleware`). Answers are only for
holders of the token, so caches on the way must not store them unless a header allows it.
"""

import hashlib
import hmac
import html
from urllib.parse import parse_qsl, quote, unquote, urlencode, urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from pftrack_server.core import errors
from pftrack_server.core.base_path import LINKS, address_of, encode_path, route_path
from pftrack_server.core.frontend import FRONTEND
from pftrack_server.core.log import RateLimitedLogger
from pftrack_server.core.settings import Settings

SAFE_METHODS = {"GET", "HEAD", "OPTIONS"}
OPEN_PATHS = {"/healthz", "/readyz"}
PAGE_POLICY = (
    "default-src 'self'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "font-src 'self' data:; media-src 'self' blob:; connect-src 'self'; frame-src 'self'; worker-src 'self' blob:; "
    "object-src 'none'; base-uri 'self'; form-action 'self'; frame-ancestors 'self'"
)
HEADERS = {
    "Content-Security-Policy": PAGE_POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "X-Frame-Options": "SAMEORIGIN",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
    "Cache-Control": "private, no-cache",
}
WEEK_SECONDS = 7 * 24 * 3600
UNKNOWN = 401
TOKEN_PAGE = FRONTEND / "gallery" / "token.html"
"""Page of a refused request; it needs no other file, since without a token none is served."""


class Hosts:
    """The host names of a server."""

    def __init__(self, settings: Settings) -> None:
        self._names = {host.strip("[]").lower() for host in settings.hosts}

    def refusal(self, headers: Headers) -> str | None:
        """Return why a request's Host header is refused; None if it is allowed."""
        if len(headers.getlist("host")) > 1:
            return "Expected one Host header, got several."
        if "*" in self._names or _name(headers.get("host", "")) in self._names:
            return None
        return "This server does not answer to that Host name; add it to PFTRACK_ALLOWED_HOSTS if it should."


class Guard:
    """ASGI middleware that admits allowed requests only, and adds the security headers to every answer."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._hosts = Hosts(settings)
        self._warnings = RateLimitedLogger(__name__)
        self._token = settings.token.get_secret_value() if settings.token else None
        digest = hashlib.sha256((self._token or "").encode()).hexdigest()
        # Browsers share cookies between the ports of a host: the name distinguishes two servers' cookies.
        self._cookie = f"pftrack_{digest[:8]}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check one request or websocket, then pass it on or refuse it."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        refusal = self._refusal(scope, headers)
        if refusal is not None:
            if scope["type"] == "websocket":
                path = route_path(scope)
                # A class's link is a secret, so it is not logged.
                told = f"{LINKS}/..." if path.startswith(f"{LINKS}/") else path
                self._warnings.warn("a websocket was refused", path=told, reason=refusal[1])
            await refuse(scope, receive, send, *refusal)
            return
        # Checked again, since some paths are open without a token.
        if self._token and _tokens_in_address(scope) and self._knows(scope, headers):
            await self._trade_token(scope)(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                answered = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    answered.setdefault(name, value)
            await send(message)

        await self._app(scope, receive, send_with_headers)

    def _refusal(self, scope: Scope, headers: Headers) -> tuple[int, str] | None:
        if misplaced := self._hosts.refusal(headers):
            return 400, misplaced
        changing = scope["type"] == "websocket" or scope["method"] not in SAFE_METHODS
        if changing and not _same_origin(headers):
            return 403, "This request comes from another site's page; open the server's own page instead."
        path = route_path(scope)
        is_open = path in OPEN_PATHS or path.startswith(f"{LINKS}/")
        if not self._token or is_open or self._knows(scope, headers):
            return None
        if _tokens_in_address(scope):
            return 401, "This link's token is not valid. If the server was restarted, open the link that it printed."
        return 401, "This server requires a token; open the link that it printed when it started."

    def _knows(self, scope: Scope, headers: Headers) -> bool:
        """Return whether a request carries the token: in its cookie, its bearer header or its link."""
        cookies = HTTPConnection(scope).cookies
        offered = [unquote(cookies[self._cookie])] if self._cookie in cookies else []
        scheme, _, credentials = headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer":
            offered.append(credentials)
        offered += _tokens_in_address(scope)
        expected = (self._token or "").encode()
        return any(hmac.compare_digest(value.encode("utf-8", "replace"), expected) for value in offered)

    def _trade_token(self, scope: Scope) -> Response:
        """Exchange the token of a link for a cookie, and remove it from the address."""
        rest = [(key, value) for key, value in _query(scope) if key != "token"]
        # One slash only: `//other.site` would lead to another site.
        path = address_of(scope, encode_path(route_path(scope).lstrip("/\\")))
        answer = RedirectResponse(f"{path}?{urlencode(rest)}" if rest else path, status_code=303, headers=HEADERS)
        answer.headers["Cache-Control"] = "no-store"
        answer.set_cookie(
            self._cookie,
            quote(self._token or "", safe=""),
            max_age=WEEK_SECONDS,
            path=address_of(scope),
            httponly=True,
            samesite="lax",
            secure=scope["scheme"] == "https",
        )
        return answer


async def refuse(scope: Scope, receive: Receive, send: Send, status: int, message: str) -> None:
    """Answer a refused request, or close a websocket before it is accepted."""
    if scope["type"] == "websocket" and "websocket.http.response" not in scope.get("extensions", {}):
        await send({"type": "websocket.close", "code": 1008, "reason": message})
        return
    wants_page = _is_page(scope) and "text/html" in Headers(scope=scope).get("accept", "")
    if status == UNKNOWN and wants_page:
        text = TOKEN_PAGE.read_text(encoding="utf-8").replace("{message}", message)
        text = text.replace("{rest}", _hidden_fields(scope))
        answer: Response = HTMLResponse(text, status, {**HEADERS, "Cache-Control": "no-store"})
    else:
        answer = errors.response(status, errors.shape(message), dict(HEADERS))
    await answer(scope, receive, send)


def _is_page(scope: Scope) -> bool:
    """Return whether a request may come from the address bar."""
    return scope["type"] == "http" and scope["method"] == "GET" and not route_path(scope).startswith("/api/")


def _tokens_in_address(scope: Scope) -> list[str]:
    """Return the tokens in the address of a page, where they become a cookie."""
    if not _is_page(scope):
        return []
    return [value for key, value in _query(scope) if key == "token"]


def _query(scope: Scope) -> list[tuple[str, str]]:
    return parse_qsl(scope["query_string"].decode("latin-1"), keep_blank_values=True)


def _hidden_fields(scope: Scope) -> str:
    """Return the address's other query fields as hidden fields: a form sends only its own fields."""
    fields = ((html.escape(key), html.escape(value)) for key, value in _query(scope) if key != "token")
    return "".join(f'<input type="hidden" name="{key}" value="{value}">' for key, value in fields)


def _same_origin(headers: Headers) -> bool:
    """Return whether a request comes from this server's own page, or from no page."""
    origin = headers.get("origin")
    if origin is None:
        return headers.get("sec-fetch-site", "none") in {"none", "same-origin"}
    try:
        parts = urlsplit(origin)
    except ValueError:
        return False
    if parts.scheme not in {"http", "https"}:
        return False
    default = ":443" if parts.scheme == "https" else ":80"
    return parts.netloc.lower().removesuffix(default) == headers.get("host", "").lower().removesuffix(default)


def _name(host: str) -> str:
    """Return the name of a Host header without its port."""
    if host.startswith("["):
        return host.partition("]")[0].strip("[").lower()
    return host.partition(":")[0].lower()
