"""Where a server is: its base path, and what a proxy says, if it is one that was named."""

from typing import Any
from urllib.parse import urljoin, urlsplit

import httpx
import pytest
from pydantic import ValidationError
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from pftrack_server.core.base_path import address_of, encode_path, read_base_path, route_path
from pftrack_server.core.settings import Settings
from pftrack_server.web.middleware import BasePath
from tests.apart import run
from tests.conftest import BASE
from tests.server.host import begin, error_of
from tests.server.sessions.test_duplex import hear

TOKEN = "a token that is long enough"
PROXY, STRANGER = "192.0.2.7", "192.0.2.8"
HOST = "127.0.0.1:8000"
FORWARDED = {"x-forwarded-proto": "https", "x-forwarded-host": "lab.example", "x-forwarded-prefix": "/out%20side"}


PATHS = {
    "": "",
    "/": "",
    "/any/prefix": "/any/prefix",
    "/any/prefix/": "/any/prefix",
    "/@/space%20word/": "/@/space word",
    "/@/space word": "/@/space word",
    "/m%C3%BCller;1": "/müller;1",
}
NONE = {
    "prefix": 'begins with "/"',
    "https://lab.example/prefix": 'begins with "/"',
    "//lab.example": "no empty part",
    "/a//b": "no empty part",
    "/a/../b": 'no ".."',
    "/a/%2e%2e/b": 'no ".."',
    "/.": 'no "."',
    "/a?b": r'without "\?"',
    "/a#b": 'without "#"',
    "/a%2Fb": "no slash within a part",
    "/a\\b": "no backslash",
    "/a%0d%0ab": "no control character",
    "/a%ff": "UTF-8",
}


@pytest.mark.parametrize(("text", "path"), PATHS.items())
def test_what_is_a_base_path(text: str, path: str) -> None:
    """It is kept decoded, and comes back encoded in one way, which is read as the same again."""
    assert read_base_path(text) == path
    assert read_base_path(encode_path(path)) == path
    assert not set(encode_path(path)) & set(' ;,"<>ü')


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        *(("base_path", text, reason) for text, reason in NONE.items()),
        # A name may belong to anybody.
        *(("trusted_proxies", text, "address or network") for text in ("proxy.example", "10.0.0.1/8", "127.0.0.1, *")),
    ],
)
def test_a_setting_that_is_none(name: str, text: str, reason: str) -> None:
    """It is refused with what is wrong, and with what was given."""
    with pytest.raises(ValidationError, match=reason) as refusal:
        Settings.model_validate({name: text})
    assert repr(text) in str(refusal.value)


def test_an_address_and_its_route() -> None:
    """What a route is called by stands behind the base, which is encoded in addresses."""
    scope = {"root_path": "/space word", "path": "/space word/session/1"}
    assert route_path(scope) == "/session/1"
    assert address_of(scope) == "/space%20word/"
    assert address_of(scope, "session/1") == "/space%20word/session/1"
    assert (route_path({"path": "/x"}), address_of({"path": "/x"})) == ("/x", "/")


def _seen(path: str, headers: dict[str, str], *, client: str = PROXY, kind: str = "http", **settings: Any) -> Any:
    """Return the request that the app sees behind a proxy, or with which status it is answered before."""
    seen: list[Any] = []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        seen.append(scope)

    async def send(message: Any) -> None:
        if message["type"] == "http.response.start":
            seen.append((message["status"], dict(message["headers"]).get(b"location", b"").decode()))

    scope = {
        "type": kind,
        "method": "GET",
        "scheme": {"http": "http", "websocket": "ws"}[kind],
        "path": path,
        "raw_path": path.encode(),
        "query_string": b"",
        "client": (client, 1234),
        "headers": [(name.encode(), value.encode()) for name, value in {"host": HOST, **headers}.items()],
    }
    wanted = {"base_path": "", "trusted_proxies": PROXY, "token": TOKEN, **settings}
    run(BasePath(app, Settings(**wanted))(scope, None, send))  # type: ignore[arg-type]  # nothing is read
    (one,) = seen
    return one


def _told(scope: Any) -> tuple[str, str, str, str]:
    """Return scheme, host, base and path of a request."""
    return scope["scheme"], dict(scope["headers"])[b"host"].decode(), scope["root_path"], scope["path"]


OUT = ("https", "lab.example", "/out side", "/out side/work")
HERE = ("http", HOST, "", "/work")
EVIL = ("http", "evil.example", "", "/work")
"""What an app is told of a request: scheme, host, base and path."""


@pytest.mark.parametrize(
    ("who", "told"),
    [
        ({"client": PROXY}, OUT),
        ({"client": f"::ffff:{PROXY}"}, OUT),
        ({"trusted_proxies": "198.51.100.1,192.0.2.0/24"}, OUT),  # a network stands for all its addresses
        ({"trusted_proxies": "192.0.2.8/31,2001:db8::/32"}, HERE),
        ({"client": STRANGER}, HERE),
        ({"client": "127.0.0.1"}, HERE),
        ({"client": "testclient"}, HERE),
        ({"trusted_proxies": ""}, HERE),
        ({"headers": {"host": "evil.example"}}, EVIL),  # a page of a stranger, on the machine of the proxy
    ],
)
def test_a_named_proxy_is_believed_and_nobody_else(who: dict[str, Any], told: tuple[str, ...]) -> None:
    """Scheme, host and what was taken off the path are those that the browser has used.

    From any address but a named proxy's, or for another server, the request's own word counts.
    """
    seen = _seen("/work", FORWARDED | who.pop("headers", {}), **who)
    assert _told(seen) == told
    assert seen["raw_path"] == encode_path(told[-1]).encode()


def test_its_prefix_comes_before_the_servers_own() -> None:
    """A proxy that takes off a part of the path leaves the server's own part in it; without its slash it leads there.

    The proxy is told of a prefix that is none, rather than leading browsers elsewhere.
    """
    seen = _seen("/in/side/work", FORWARDED, base_path="/in/side")
    assert _told(seen)[2:] == ("/out side/in/side", "/out side/in/side/work")
    assert _seen("/in", FORWARDED, base_path="/in/") == (307, "/out%20side/in/")
    for prefix in ("outside", "//evil.example", "/a/../b"):
        assert _seen("/", {"x-forwarded-prefix": prefix}) == (400, "")


@pytest.mark.parametrize("proto", ["https", "wss", "http, HTTPS"])
def test_a_websocket_is_as_secure_as_its_page(proto: str) -> None:
    """Its scheme goes by either name, and the nearest proxy has the last word."""
    assert _seen("/x", {"x-forwarded-proto": proto}, kind="websocket")["scheme"] == "wss"


def test_a_page_tells_which_setting_is_missing() -> None:
    """Its addresses would lead nowhere; one whose own path comes through, or of another server, is not refused."""
    page = {"x-forwarded-prefix": "/user/ann/proxy/8000", "accept": "text/html"}
    assert _seen("/", page, trusted_proxies="") == (400, "")
    assert _seen("/", page, client="testclient")["root_path"] == ""
    assert _seen("/in/", {**page, "x-forwarded-prefix": "/in"}, client=STRANGER, base_path="/in")["path"] == "/in/"
    assert _seen("/", {**page, "host": "evil.example"}, client=STRANGER)["path"] == "/"


class TestServer:
    def test_nothing_is_outside(self, start_server: Any) -> None:
        """What does not begin with the base is not there, also what begins with the same letters."""
        with start_server(base_path="/any/prefix") as (server, client):
            for path in ("/", "/work", "/any/prefixes/", "/any/", "/healthz", "/static/shared/style.css"):
                answer = httpx.get(server.origin + path)
                error_of(answer, 404)
                assert answer.headers["x-content-type-options"] == "nosniff"
            for path in ("/any/viz/x", "/any/prefix"):
                with pytest.raises(InvalidStatus) as refusal, connect(f"ws://127.0.0.1:{server.port}{path}"):
                    pass
                assert refusal.value.response.status_code == 404
            bare = httpx.get(f"{server.origin}/any/prefix?x=1")
            assert (bare.status_code, bare.headers["location"]) == (307, "/any/prefix/?x=1")
            assert client.get("healthz").status_code == 200

    @pytest.mark.parametrize("base", ["", BASE], ids=["root", "base"])
    def test_all_addresses_lie_below_the_base(self, start_server: Any, base: str) -> None:
        """Pages, scripts, sessions, cookies and links of a class are where the server is, at the root as well."""
        with start_server(base_path=base, token=TOKEN) as (server, client):
            assert server.url == server.origin + base
            printed = server.app.state.services.settings.link(server.port)
            welcome = client.get(printed.replace("localhost", "127.0.0.1"))
            assert welcome.headers["location"] == f"{base}/"
            assert f"Path={base}/;" in welcome.headers["set-cookie"]
            page = client.get("learn/9", follow_redirects=True)
            assert page.url == f"{server.url}/learn/sir"
            assert f'<base href="{base}/">' in page.text
            script = page.text.partition('<script type="module" src="')[2].partition('"')[0]
            assert client.get(urljoin(f"{server.url}/", script)).status_code == 200
            session = begin(client)
            assert client.get(session["viewer"]).status_code == 200
            cookie = "; ".join(f"{name}={value}" for name, value in client.cookies.items())
            address = f"{server.ws}/api/v1/sessions/{session['id']}/stream"
            with connect(address, origin=server.origin, additional_headers={"cookie": cookie}) as stream:  # type: ignore[arg-type]
                assert hear(stream)["session"]["page"] == session["page"]
            follow = client.post("api/v1/follows", json={"sessions": [session["id"]]}).json()
            links = [each["address"] for each in follow["links"]] + [follow["owner_link"]]
            assert all(link.startswith(f"{server.url}/f/") for link in links)
            follower = httpx.get(links[0])
            assert f'<base href="{urlsplit(links[0]).path}/">' in follower.text
            assert f"Path={urlsplit(links[0]).path};" in follower.headers["set-cookie"]
            begun = httpx.get(follow["owner_link"]).headers["location"]
            assert begun == f"{urlsplit(follow['owner_link']).path}/{session['page']}"

    def test_what_redirects_says_no_prefix_that_was_taken_off(self, start_server: Any) -> None:
        """Some proxies, as jupyter-server-proxy, put it before every path to which an answer leads."""
        with start_server(base_path="/in", token=TOKEN, trusted_proxies="127.0.0.1") as (server, client):
            prefix = {"x-forwarded-prefix": "/out%20side"}
            welcome = client.get(f"{server.url}/work?token={TOKEN}", headers=prefix)
            assert welcome.headers["location"] == "./work"
            assert "Path=/out%20side/in/;" in welcome.headers["set-cookie"]
            client.headers["authorization"] = f"Bearer {TOKEN}"
            assert client.get(f"{server.url}/learn/9", headers=prefix).headers["location"] == "./../learn/sir"
            assert client.get(f"{server.url}/learn/9").headers["location"] == "/in/learn/sir"
