"""A request as the browser has sent it, whatever a proxy has made of it; and HEAD, which is answered as GET.

What a trusted proxy says takes the place of what the request itself says: `X-Forwarded-Proto` that of the scheme,
`X-Forwarded-Host` that of the host, and `X-Forwarded-Prefix` is what the proxy has taken off the path, which comes
before the server's own base path. From here on the request is as the browser has sent it, so that nothing else knows
of proxies. From any other address than a named one, or with a Host that is not this server's, these headers count for
nothing: a page of a stranger, opened on the machine of the proxy, could send them as well. Only somebody who opens a
page is told which setting is missing, since the addresses of the page would lead nowhere.

What lies outside the base does not exist.

Whatever can be fetched can be asked for its headers alone (RFC 9110, section 9.3.2). FastAPI's routes know GET alone,
so everything behind sees a GET, and of the answer only the head goes out.
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
"""What a proxy's scheme is for each type of request: that of a websocket is called by either name."""


class BasePath:
    """ASGI middleware that gives every request the scheme, host and path that the browser has asked for."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._base = settings.base_path
        self._proxies = [ipaddress.ip_network(proxy) for proxy in settings.trusted_proxies]
        self._hosts = Hosts(settings)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on a request within the base, and refuse any other."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        if prefix := self._untold_prefix(scope):
            message = (
                f"A proxy takes {prefix} off the addresses of this server: "
                f"start the server with PFTRACK_TRUSTED_PROXIES={_client(scope)}, so that its pages have it."
            )
            await refuse(scope, receive, send, HTTPStatus.BAD_REQUEST, message)
            return
        try:
            scope = self._as_sent(scope)
        except ValueError as error:
            message = f"The proxy in front of this server has sent a wrong X-Forwarded-Prefix: {error}."
            await refuse(scope, receive, send, HTTPStatus.BAD_REQUEST, message)
            return
        root, path = scope["root_path"], scope["path"]
        if path.startswith(f"{root}/"):
            await self._app(scope, receive, send if root == self._base else _with_relative_redirections(scope, send))
        elif path == root and scope["type"] == "http":
            query = scope["query_string"].decode("latin-1")
            await RedirectResponse(address_of(scope, f"?{query}" if query else ""))(scope, receive, send)
        else:
            message = "This path is outside the server; its addresses begin with another one."
            await refuse(scope, receive, send, HTTPStatus.NOT_FOUND, message)

    def _untold_prefix(self, scope: Scope) -> str:
        """Return what a proxy that was not named takes off the path of a page, whose addresses would lead nowhere."""
        headers = Headers(scope=scope)
        prefix = _last(headers, "x-forwarded-prefix").removesuffix("/")
        is_page = scope["type"] == "http" and "text/html" in headers.get("accept", "")
        is_told = self._is_trusted(scope, headers) or prefix == encode_path(self._base)
        if not is_page or is_told or self._hosts.refusal(headers) or _client(scope) is None:
            return ""
        return prefix

    def _as_sent(self, scope: Scope) -> Scope:
        """Return a request as the browser has sent it.

        Raises:
            ValueError: The prefix that a proxy has taken off is none.
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
        """Tell whether a request comes by a proxy that was named."""
        address = _client(scope)
        is_proxy = address is not None and any(address in proxy for proxy in self._proxies)
        return is_proxy and self._hosts.refusal(headers) is None


def _with_relative_redirections(scope: Scope, send: Send) -> Send:
    """Send what redirects without the prefix that a proxy has taken off: some put it before every path themselves."""
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
    """Return the address from which a request comes, if it has one."""
    try:
        address = ipaddress.ip_address((scope.get("client") or [""])[0])
    except ValueError:
        return None
    # A server that listens for both kinds sees addresses of the older kind in the form of the newer one.
    return getattr(address, "ipv4_mapped", None) or address


def _last(headers: Headers, name: str) -> str:
    """Return what the nearest proxy says: each puts what it adds behind what was there."""
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
