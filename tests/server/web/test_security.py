"""Who may speak to a server: Host, Origin and token, for requests and websockets alike."""

import socket
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
from pydantic import SecretStr, ValidationError
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from pftrack_server.core.settings import Settings
from pftrack_server.web.security import Guard
from tests.apart import run
from tests.server.host import Server, begin, error_of, running
from tests.server.sessions.test_duplex import hear
from tests.session_requests import session_request

TOKEN = "a token that is long enough"
BROWSER = {"accept": "text/html,application/xhtml+xml"}
FOREIGN = ["http://evil.example", "https://127.0.0.1.evil.example", "null", "http://[", "file://", "http://127.0.0.1:1"]


@pytest.fixture(scope="module")
def closed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server that asks for a token."""
    with running(Settings(data_dir=tmp_path_factory.mktemp("closed"), token=SecretStr(TOKEN))) as server:
        yield server


@pytest.fixture
def nobody(closed: Server) -> Iterator[httpx.Client]:
    """A client of that server, which has no token yet."""
    with httpx.Client(base_url=closed.url, timeout=60, verify=False) as client:  # noqa: S501 - a local server
        yield client


# Origin.


def test_foreign_pages_do_and_hear_nothing(server: Server, client: httpx.Client) -> None:
    """A request of another site's page that changes something is refused, a websocket before it is accepted."""
    session = begin(client)["id"]
    url = f"/api/v1/sessions/{session}"
    paths = ["/api/v1/sessions", f"{url}/commands", "/api/v1/uploads", "/api/v1/sweeps"]
    for origin in FOREIGN:
        for method, path in [*(("POST", path) for path in paths), ("DELETE", url), ("PUT", "/")]:
            error_of(client.request(method, path, headers={"origin": origin}, json={}), 403)
        for path in (f"{url}/stream", f"/viz/{session}", f"/viz/{session}/"):
            with pytest.raises(InvalidStatus) as refusal, connect(server.ws + path, origin=Origin(origin)):
                pass
            assert refusal.value.response.status_code == 403, (origin, path)
    assert client.get(url).status_code == 200


def test_a_browsers_own_word(server: Server, client: httpx.Client) -> None:
    """It is believed when it says that a request comes from elsewhere; the own page may do and hear everything."""
    body = session_request({"experiment": "ball"})
    for site in ("cross-site", "same-site"):
        error_of(client.post("/api/v1/sessions", json=body, headers={"sec-fetch-site": site}), 403)
    answer = client.post("/api/v1/sessions", json=body, headers={"origin": server.origin})
    assert answer.status_code == 201
    stream = f"{server.ws}/api/v1/sessions/{answer.json()['id']}/stream"
    with connect(stream, origin=Origin(server.origin)) as socket:
        assert hear(socket)["type"] == "hello"


def test_names_of_the_host(server: Server, client: httpx.Client) -> None:
    """Every name of this machine is the server's; any other is refused, even if the Origin agrees, on sockets too."""
    for host in ("localhost", "LOCALHOST:80", "127.0.0.1", "[::1]:8000"):
        assert client.get("/healthz", headers={"host": host}).status_code == 200
    for host in ("evil.example", "evil.example:8000", "", "127.0.0.1.evil.example", "[::2]:80"):
        for path in ("/", "/healthz"):
            error_of(client.get(path, headers={"host": host}), 400)
    address = f"ws://evil.example:{server.port}{server.base}/api/v1/sessions/any/stream"
    origin = Origin(f"http://evil.example:{server.port}")
    with (
        socket.create_connection(("127.0.0.1", server.port)) as raw,
        pytest.raises(InvalidStatus) as refusal,
        connect(address, sock=raw, origin=origin),
    ):
        pass
    assert refusal.value.response.status_code == 400


def _answered(path: str, token: str, scheme: str = "http") -> dict[str, str]:
    """Return the headers with which the guard answers a link, or lets it pass."""
    sent: list[Any] = []

    async def send(message: Any) -> None:
        sent.append(message)

    async def app(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})

    asked = {"query_string": f"token={token}".encode(), "headers": [(b"host", b"localhost")]}
    scope = {"type": "http", "method": "GET", "scheme": scheme, "path": path, **asked}
    run(Guard(app, Settings(token=SecretStr(TOKEN)))(scope, None, send))  # type: ignore[arg-type]  # nothing is read
    return {name.decode(): value.decode() for name, value in sent[0]["headers"]}


# Token.


def test_nothing_without(closed: Server, nobody: httpx.Client) -> None:
    """Where a token is asked for, only health checks answer without it; an address opens pages only."""
    assert nobody.get("/healthz").status_code == 200
    style = "/static/shared/style.css"
    for path in ["/", "/api/v1/sessions", "/metrics", "/docs", style, "/viz/x/", "/?token=wrong"]:
        error_of(nobody.get(path), 401)
    for known in ({}, {"token": TOKEN}):
        error_of(nobody.get("/api/v1/sessions", params=known), 401)
        error_of(nobody.post("/api/v1/sessions", params=known, json=session_request({"experiment": "ball"})), 401)
    for path in ["/api/v1/sessions/x/stream", "/viz/x"]:
        with pytest.raises(InvalidStatus) as refusal, connect(closed.ws + path):
            pass
        assert refusal.value.response.status_code == 401


def test_a_wrong_token_is_never_traded_for_the_right_one() -> None:
    """Also where nobody is asked for a token, only the right one becomes a cookie.

    Behind TLS a browser never sends it over a line that others can read.
    """
    for path in ("/healthz", "/readyz"):
        assert "set-cookie" not in _answered(path, "wrong")
        assert "set-cookie" in _answered(path, TOKEN)
    for scheme, secure in (("http", False), ("https", True)):
        assert ("secure" in _answered("/", TOKEN, scheme)["set-cookie"].lower()) is secure


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
    foreign = {"origin": "http://evil.example"}
    error_of(nobody.post("/api/v1/sessions", json=session_request({}), headers=foreign), 403)


@pytest.mark.parametrize("token", ["Übers Meer → und zurück", 'salt & pepper; 100% "a=b+c\\,#d'])
def test_a_token_of_any_characters(start_server: Any, token: str) -> None:
    """A token may have any characters, also those that mean something in an address or a cookie."""
    with start_server(token=token) as (server, client):
        printed = server.app.state.services.settings.link(server.port)
        assert client.get(printed).status_code == 303
        assert client.get("/").status_code == 200


def test_a_form_keeps_the_rest_of_the_address(closed: Server, nobody: httpx.Client) -> None:
    """A person who types the token gets to where the link led, whatever stands in it."""
    asked = {"of": "hit rate", "x": "", "evil": '"><script>', "token": "an old token"}
    page = nobody.get("/sweep/1", params=asked, headers=BROWSER)
    assert page.status_code == 401
    assert page.headers["content-type"].startswith("text/html")
    assert "not this server" in page.text
    assert 'name="token"' in page.text
    assert "requires a token" in nobody.get("/session/new", headers=BROWSER).text
    assert '<input type="hidden" name="of" value="hit rate">' in page.text
    assert '<input type="hidden" name="x" value="">' in page.text
    assert "<script>" not in page.text
    assert "an old token" not in page.text
    known = nobody.get("/sweep/1", params={**asked, "token": TOKEN}, headers=BROWSER)
    assert known.headers["location"] == f"{closed.base}/sweep/1?of=hit+rate&x=&evil=%22%3E%3Cscript%3E"


def test_bearer(closed: Server) -> None:
    """Programs give the token as a bearer; what a browser calls itself changes no answer of the interface.

    The way from link to cookie leads nowhere else.
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
    """A server that others can reach has a token, made up if none is given, and tells it in its link.

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


def test_unsafe_combinations() -> None:
    """Unsafe combinations are refused at start."""
    hosts = {"allowed_hosts": ("pftrack.example",)}, {"allowed_hosts": ("*",)}
    for unsafe in ({"token": "short"}, *hosts, {"surprise": 1}):
        with pytest.raises(ValidationError):
            Settings(**unsafe)


def test_hosts_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Names of hosts are given with commas between; what is wrong with them, or goes with them, is told."""
    monkeypatch.setenv("PFTRACK_ALLOWED_HOSTS", '["one.example"]')
    with pytest.raises(ValidationError, match="comma-separated names"):
        Settings()
    monkeypatch.setenv("PFTRACK_ALLOWED_HOSTS", "pftrack.example")
    with pytest.raises(ValidationError, match="set PFTRACK_TOKEN, too"):
        Settings()
    monkeypatch.setenv("PFTRACK_TOKEN", "sixteen characters")
    assert Settings().allowed_hosts == ("pftrack.example",)
    for text, names in ((" one.example, two.example ,", ("one.example", "two.example")), ("", ())):
        monkeypatch.setenv("PFTRACK_ALLOWED_HOSTS", text)
        assert Settings().allowed_hosts == names


# Answers.


def test_headers(server: Server, client: httpx.Client, session: dict[str, Any]) -> None:
    """Every answer forbids framing by others, sniffing, and scripts from elsewhere.

    Viser's client may run its inline scripts, and connect to nothing but this server.
    """
    for path in ("/", "/api/v1/experiments", "/nowhere", "/healthz", "/docs"):
        headers = client.get(path).headers
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
        "/static/%2e%2e/server/app.py",
        "/static/..%2f..%2fetc/passwd",
        "/static/shared/../../../../../../etc/passwd",
        "/static//etc/passwd",
        "/api/v1/runs/..%2f..%2fpftrack.sqlite/download",
        "/api/v1/runs/%2e%2e/download",
        "/api/v1/uploads/..%2f../frames/0.jpg",
        "/api/v1/experiments/..%2f../thumbnail.webp",
        "/api/v1/sessions/..%2f..",
        "/api/v1/runs/%00/download",
        "/session.html%00",
    ],
)
def test_names_never_become_paths(server: Server, client: httpx.Client, path: str) -> None:
    """Whatever stands in an address, only the server's own files come back."""
    address = httpx.URL(server.url).copy_with(raw_path=(server.base + path).encode())
    answer = client.send(client.build_request("GET", address))
    error_of(answer, answer.status_code)
    assert answer.status_code in {404, 422}


def test_one_shape(client: httpx.Client) -> None:
    """Every error has the one shape, with a sentence."""
    for method, path, status in (
        ("GET", "/nowhere", 404),
        ("GET", "/api/v1/nowhere", 404),
        ("GET", "/api/v1/experiments/chess", 404),
        ("GET", "/static/nothing.js", 404),
        ("PUT", "/api/v1/sessions", 405),
        ("POST", "/healthz", 405),
        ("POST", "/api/v1/sessions", session_request(422)),
        ("GET", "/api/v1/uploads/x/frames/0.jpg", 404),
        ("POST", "/api/v1/uploads", 400),
    ):
        error_of(client.request(method, path), status)


def test_a_mistake_of_the_server(start_server: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A mistake of the server's own is told without path and stack."""
    with start_server() as (server, client):
        monkeypatch.setattr(server.manager, "get", lambda _: 1 / 0)
        answer = client.get("/api/v1/sessions/x")
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert "failed unexpectedly" in error_of(answer, 500)["message"]
