"""Middleware that restores a request as the browser sent it before a proxy changed it, and answers HEAD as GET.

Headers of a trusted proxy replace parts of the request: `X-Forwarded-Proto` the scheme, `X-Forwarded-Host` the host;
`X-Forwarded-Prefix` is the prefix that the proxy removed from the path, which comes before the server's own base path.
The restored request is as the browser sent it, so no other code deals with proxies. From an address that is not a named
proxy, or with a foreign Host, these headers are ignored: another site's page, opened on the machine of the proxy, could
send them too. A person who opens a page through a proxy that is not named is shown the missing setting, since the
addresses of the page would be wrong.

Paths outside the base path do not exist.

Every resource with GET also answers HEAD (RFC 9110, section 9.3.2). FastAPI's routes know only GET, so the app receives
a GET, and only the head of the answer is sent.
"""

import ipaddress
from http import HTTPStatus

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from pftrack_server.core.base_path import address_of, encode_path, read_base_path, route_path
from pftrack_server.core.settings import Settings
from pftrack_server.web.security import Hosts, refuse

SCHEMES = {
    "http": {"http": "http", "https": "https"},
    "websocket": {"http": "ws", "ws": "ws", "https": "wss", "wss": "wss"},
}
"""Accepted values of a proxy's scheme by type of request; a websocket's may have either name."""


class BasePath:
    """ASGI middleware that gives every request the scheme, host and path that the browser requested."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._base = settings.base_path
        self._proxies = [ipaddress.ip_network(proxy) for proxy in settings.trusted_proxies]
        self._hosts = Hosts(settings)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on a request within the base path, and refuse any other."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        if prefix := self._untold_prefix(scope):
            message = (
                f"A proxy removes {prefix} from the addresses of this server: "
                f"start the server with PFTRACK_TRUSTED_PROXIES={_client(scope)}, so that its pages include it."
            )
            await refuse(scope, receive, send, HTTPStatus.BAD_REQUEST, message)
            return
        try:
            scope = self._as_sent(scope)
        except ValueError as error:
            message = f"The proxy in front of this server sent an invalid X-Forwarded-Prefix: {error}."
            await refuse(scope, receive, send, HTTPStatus.BAD_REQUEST, message)
            return
        root, path = scope["root_path"], scope["path"]
        if path.startswith(f"{root}/"):
            await self._app(scope, receive, send if root == self._base else _with_relative_redirections(scope, send))
        elif path == root and scope["type"] == "http":
            query = scope["query_string"].decode("latin-1")
            await RedirectResponse(address_of(scope, f"?{query}" if query else ""))(scope, receive, send)
        else:
            message = "This path is outside the server; its addresses have another prefix."
            await refuse(scope, receive, send, HTTPStatus.NOT_FOUND, message)

    def _untold_prefix(self, scope: Scope) -> str:
        """Return the prefix that an unnamed proxy removes from a page's path; the page's addresses would be wrong."""
        headers = Headers(scope=scope)
        prefix = _last(headers, "x-forwarded-prefix").removesuffix("/")
        is_page = scope["type"] == "http" and "text/html" in headers.get("accept", "")
        is_told = self._is_trusted(scope, headers) or prefix == encode_path(self._base)
        if not is_page or is_told or self._hosts.refusal(headers) or _client(scope) is None:
            return ""
        return prefix

    def _as_sent(self, scope: Scope) -> Scope:
        """Return the scope of a request as the browser sent it.

        Raises:
            ValueError: The proxy's prefix is not valid.
        """
        headers = Headers(scope=scope)
        if not self._is_trusted(scope, headers):
            return {**scope, "root_path": self._base}
        prefix = read_base_path(_last(headers, "x-forwarded-prefix"))
        scheme = SCHEMES[scope["type"]].get(_last(headers, "x-forwarded-proto").lower(), scope["scheme"])
        sent = {
            **scope,
            "scheme": scheme,
            "root_path": prefix + self._base,
            "path": prefix + scope["path"],
            "raw_path": encode_path(prefix).encode() + scope.get("raw_path", b""),
        }
        if host := _last(headers, "x-forwarded-host"):
            sent["headers"] = list(scope["headers"])
            MutableHeaders(scope=sent)["host"] = host
        return sent

    def _is_trusted(self, scope: Scope, headers: Headers) -> bool:
        """Return whether a request comes from a named proxy."""
        address = _client(scope)
        is_proxy = address is not None and any(address in proxy for proxy in self._proxies)
        return is_proxy and self._hosts.refusal(headers) is None


def _with_relative_redirections(scope: Scope, send: Send) -> Send:
    """Send redirections without the prefix that a proxy removed: some proxies add it to every path themselves."""
    root = address_of(scope)
    up = "./" + "../" * (route_path(scope).count("/") - 1)

    async def send_relative(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            if (place := headers.get("location", "")).startswith(root):
                headers["location"] = up + place.removeprefix(root)
        await send(message)

    return send_relative


def _client(scope: Scope) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """Return the IP address of a request's client, if it has one."""
    try:
        address = ipaddress.ip_address((scope.get("client") or [""])[0])
    except ValueError:
        return None
    # A server that listens on IPv4 and IPv6 sees IPv4 addresses in the form of IPv6.
    return getattr(address, "ipv4_mapped", None) or address


def _last(headers: Headers, name: str) -> str:
    """Return the nearest proxy's value of a header: each proxy appends its own."""
    return headers.getlist(name)[-1].rpartition(",")[2].strip() if name in headers else ""


class HeadAsGet:
    """ASGI middleware that answers HEAD with the head of the answer to GET."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return
        ended = False

        async def receive_until_ended() -> Message:
            return {"type": "http.disconnect"} if ended else await receive()

        async def send_head(message: Message) -> None:
            nonlocal ended
            if message["type"] != "http.response.body":
                await send(message)
            elif not ended:
                ended = True
                await send({"type": "http.response.body", "body": b""})

        await self._app({**scope, "method": "GET"}, receive_until_ended, send_head)
