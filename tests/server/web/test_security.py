"""Access to a server by Host, Origin and token, for requests and websockets alike."""

import socket
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
from fastapi import FastAPI
from pydantic import SecretStr, ValidationError
from websockets.sync.client import connect
from websockets.typing import Origin

from pftrack_server.core.settings import Settings
from pftrack_server.web.security import Guard
from tests.server.host import Server, begin, error_of, granted, own_server, refused_socket
from tests.server.sessions.test_duplex import hear
from tests.session_requests import session_request

TOKEN = "a token that is long enough"
BROWSER = {"accept": "text/html,application/xhtml+xml"}
FOREIGN = ["http://evil.example", "https://127.0.0.1.evil.example", "null", "http://[", "file://", "http://127.0.0.1:1"]


closed = own_server(token=SecretStr(TOKEN))
"""A server that asks for a token."""


@pytest.fixture
def nobody(closed: Server) -> Iterator[httpx.Client]:
    """A client of that server, which has no token yet."""
    with httpx.Client(base_url=closed.url, timeout=60, verify=False) as client:  # noqa: S501 - a local server
        yield client


# Origin.


def test_foreign_pages_do_and_hear_nothing(server: Server, client: httpx.Client) -> None:
    """A changing request of another site's page is refused, a websocket before it is accepted.

    A browser is believed when it says that a request comes from elsewhere; the own page may do everything.
    """
    body = session_request({"experiment": "ball"})
    for site in ("cross-site", "same-site"):
        error_of(client.post("/api/v1/sessions", json=body, headers={"sec-fetch-site": site}), 403)
    session = granted(client.post("/api/v1/sessions", json=body, headers={"origin": server.origin}))["id"]
    with connect(f"{server.ws}/api/v1/sessions/{session}/stream", origin=Origin(server.origin)) as stream:
        assert hear(stream)["type"] == "hello"
    url = f"/api/v1/sessions/{session}"
    paths = ["/api/v1/sessions", f"{url}/commands", "/api/v1/uploads", "/api/v1/sweeps"]
    for origin in FOREIGN:
        for method, path in [*(("POST", path) for path in paths), ("DELETE", url), ("PUT", "/")]:
            error_of(client.request(method, path, headers={"origin": origin}, json={}), 403)
        for path in (f"{url}/stream", f"/viz/{session}", f"/viz/{session}/"):
            assert refused_socket(server.ws + path, origin=Origin(origin)) == 403, (origin, path)
    assert client.get(url).status_code == 200


def test_names_of_the_host(server: Server, client: httpx.Client) -> None:
    """All names of this machine are accepted; any other is refused, even if the Origin agrees, on sockets too."""
    for host in ("localhost", "LOCALHOST:80", "127.0.0.1", "[::1]:8000"):
        assert client.get("/healthz", headers={"host": host}).status_code == 200
    for host in ("evil.example", "evil.example:8000", "", "127.0.0.1.evil.example", "[::2]:80"):
        for path in ("/", "/healthz"):
            error_of(client.get(path, headers={"host": host}), 400)
    address = f"ws://evil.example:{server.port}{server.base}/api/v1/sessions/any/stream"
    with socket.create_connection(("127.0.0.1", server.port)) as raw:
        assert refused_socket(address, sock=raw, origin=Origin(f"http://evil.example:{server.port}")) == 400


# Token.


def test_nothing_without(closed: Server, nobody: httpx.Client) -> None:
    """If a token is required, only health checks answer without it; a token in the address opens pages only."""
    assert nobody.get("/healthz").status_code == 200
    for path in ["/", "/api/v1/sessions", "/metrics", "/docs", "/static/shared/style.css", "/viz/x/", "/?token=wrong"]:
        error_of(nobody.get(path), 401)
    for known in ({}, {"token": TOKEN}):
        error_of(nobody.get("/api/v1/sessions", params=known), 401)
        error_of(nobody.post("/api/v1/sessions", params=known, json=session_request({"experiment": "ball"})), 401)
    for path in ["/api/v1/sessions/x/stream", "/viz/x"]:
        assert refused_socket(closed.ws + path) == 401


@pytest.mark.parametrize("token", [TOKEN, "Übers Meer → und zurück", 'salt & pepper; 100% "a=b+c\\,#d'])
async def test_a_right_token_becomes_a_cookie(token: str) -> None:
    """A token may have any characters, and only the right one becomes a cookie, even where no token is required.

    Behind TLS a browser sends the cookie over encrypted lines only.
    """
    settings = Settings(token=SecretStr(token))
    transport = httpx.ASGITransport(Guard(FastAPI(), settings))
    for scheme in ("http", "https"):
        async with httpx.AsyncClient(transport=transport, base_url=f"{scheme}://localhost") as client:
            assert (await client.get("/")).status_code == 401
            assert "set-cookie" not in (await client.get("/healthz?token=wrong")).headers
            welcome = await client.get(f"/healthz?{urlsplit(settings.link(80)).query}")
            assert ("secure" in welcome.headers["set-cookie"].lower()) is (scheme == "https")
            assert (await client.get("/")).status_code == 404  # let through to an app without pages


def test_the_link_becomes_a_cookie(closed: Server, nobody: httpx.Client) -> None:
    """The link trades its token for a cookie that scripts cannot read, and takes it out of the address.

    With the cookie, another site's page still changes nothing.
    """
    welcome = nobody.get("/session/new", params={"token": TOKEN, "x": "1"})
    assert welcome.status_code == 303
    assert welcome.headers["location"] == f"{closed.base}/session/new?x=1"
    cookie = welcome.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=lax" in cookie
    assert nobody.get("/").status_code == 200
    session = begin(nobody)
    cookies = "; ".join(f"{name}={value}" for name, value in nobody.cookies.items())
    address = f"{closed.ws}/api/v1/sessions/{session['id']}/stream"
    with connect(address, additional_headers={"cookie": cookies}) as socket:
        assert hear(socket)["type"] == "hello"
    error_of(nobody.post("/api/v1/sessions", json=session_request({}), headers={"origin": FOREIGN[0]}), 403)


def test_a_form_keeps_the_rest_of_the_address(closed: Server, nobody: httpx.Client) -> None:
    """The form for the token leads to the address of the link with all of its query."""
    asked = {"of": "hit rate", "x": "", "evil": '"><script>', "token": "an old token"}
    page = nobody.get("/sweep/1", params=asked, headers=BROWSER)
    assert page.status_code == 401
    assert page.headers["content-type"].startswith("text/html")
    assert "token is not valid" in page.text
    assert 'name="token"' in page.text
    assert "requires a token" in nobody.get("/session/new", headers=BROWSER).text
    assert '<input type="hidden" name="of" value="hit rate">' in page.text
    assert '<input type="hidden" name="x" value="">' in page.text
    assert "<script>" not in page.text
    assert "an old token" not in page.text
    known = nobody.get("/sweep/1", params={**asked, "token": TOKEN}, headers=BROWSER)
    assert known.headers["location"] == f"{closed.base}/sweep/1?of=hit+rate&x=&evil=%22%3E%3Cscript%3E"


def test_bearer(closed: Server) -> None:
    """Programs give the token as a bearer; an Accept header of a browser changes no answer of the interface.

    The redirect after the link never leads to another site.
    """
    sessions = f"{closed.url}/api/v1/sessions"
    assert httpx.get(sessions, headers={"authorization": f"Bearer {TOKEN}"}).status_code == 200
    for headers in ({"authorization": "Bearer wrong"}, BROWSER):
        error_of(httpx.get(sessions, headers=headers), 401)
    for path in ("//evil.example/", "/\\evil.example", "///evil.example"):
        location = httpx.get(f"{closed.url}{path}?token={TOKEN}").headers["location"]
        assert location.startswith("/")
        assert location[1] not in "/\\"


# Settings.


def test_others_need_a_token() -> None:
    """A server that others can reach has a token, a random one by default, which its link contains.

    A server for this machine alone has none.
    """
    for host in ("0.0.0.0", "192.168.1.5", "::", "example.org"):
        settings = Settings(host=host)
        assert len(settings.token.get_secret_value()) >= 32
        assert settings.token.get_secret_value() in settings.link(80)
        assert settings.token.get_secret_value() not in repr(settings)
        assert settings.token != Settings(host=host).token
    for host in ("127.0.0.1", "::1", "localhost", "127.8.9.1"):
        assert Settings(host=host).token is None
        assert "token" not in Settings(host=host).link(80)


def test_unsafe_combinations(monkeypatch: pytest.MonkeyPatch) -> None:
    """Unsafe combinations are refused at start; names of hosts are given with commas between."""
    for unsafe in ({"token": "short"}, {"allowed_hosts": ("*",)}, {"surprise": 1}):
        with pytest.raises(ValidationError):
            Settings(**unsafe)
    for text, words in (('["one.example"]', "comma-separated names"), ("pftrack.example", "set PFTRACK_TOKEN, too")):
        monkeypatch.setenv("PFTRACK_ALLOWED_HOSTS", text)
        with pytest.raises(ValidationError, match=words):
            Settings()
    monkeypatch.setenv("PFTRACK_TOKEN", "sixteen characters")
    for text, names in ((" one.example, two.example ,", ("one.example", "two.example")), ("", ())):
        monkeypatch.setenv("PFTRACK_ALLOWED_HOSTS", text)
        assert Settings().allowed_hosts == names


# Answers.


def test_headers(server: Server, client: httpx.Client, session: dict[str, Any]) -> None:
    """Every answer forbids framing by others, sniffing, foreign scripts, and reading by pages of other sites.

    Viser's client may run its inline scripts, and connect to this server only.
    """
    for path in ("/", "/api/v1/experiments", "/nowhere", "/healthz", "/docs"):
        headers = client.get(path, headers={"origin": FOREIGN[0]}).headers
        assert "access-control-allow-origin" not in headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["x-frame-options"] == "SAMEORIGIN"
        assert "frame-ancestors 'self'" in headers["content-security-policy"]
        assert "unsafe-eval" not in headers["content-security-policy"]
    answer = client.get(f"/viz/{session['id']}/")
    policy = answer.headers["content-security-policy"]
    assert "connect-src 'self'" in policy
    assert "'unsafe-eval'" not in policy
    assert b"<html" in answer.content
    assert client.get(f"/viz/{session['id']}").headers["location"] == f"{server.base}/viz/{session['id']}/"
    error_of(client.get("/viz/0123456789abcdef/"), 404)


@pytest.mark.parametrize(
    "path",
    [
        "/static/../server/app.py",
        "/static/..%2f..%2fetc/passwd",
        "/static/shared/../../../../../../etc/passwd",
        "/api/v1/runs/..%2f..%2fpftrack.sqlite/download",
        "/api/v1/uploads/..%2f../frames/0.jpg",
        "/api/v1/runs/%00/download",
        "/session.html%00",
    ],
)
def test_names_never_become_paths(server: Server, client: httpx.Client, path: str) -> None:
    """No address leads to a file outside the server's own."""
    address = httpx.URL(server.url).copy_with(raw_path=(server.base + path).encode())
    answer = client.send(client.build_request("GET", address))
    error_of(answer, answer.status_code)
    assert answer.status_code in {404, 422}


def test_errors_have_one_shape(client: httpx.Client, server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    """Errors of routes, methods and files have it, and so has a fault of the server, without its path and stack."""
    for method, path, status in (
        ("GET", "/nowhere", 404),
        ("GET", "/static/nothing.js", 404),
        ("PUT", "/api/v1/sessions", 405),
        ("POST", "/api/v1/sessions", 422),
        ("POST", "/api/v1/uploads", 400),
    ):
        error_of(client.request(method, path), status)
    with monkeypatch.context() as within:
        within.setattr(server.manager, "get", lambda _: 1 / 0)
        answer = client.get("/api/v1/sessions/x")
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert "failed unexpectedly" in error_of(answer, 500)["message"]
