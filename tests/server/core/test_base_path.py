"""The base path of a server, and the headers of a named proxy."""

from typing import Any
from unittest.mock import AsyncMock
from urllib.parse import urljoin, urlsplit

import httpx
import pytest
from pydantic import ValidationError
from websockets.sync.client import connect

from pftrack_server.core.base_path import address_of, encode_path, read_base_path, route_path
from pftrack_server.core.settings import Settings
from pftrack_server.web.middleware import BasePath
from tests.apart import run
from tests.conftest import BASE
from tests.server.host import begin, error_of, refused_socket
from tests.server.sessions.test_duplex import hear

TOKEN = "a token that is long enough"
PROXY, STRANGER = "192.0.2.7", "192.0.2.8"
HOST = "127.0.0.1:8000"
FORWARDED = {"x-forwarded-proto": "https", "x-forwarded-host": "lab.example", "x-forwarded-prefix": "/out%20side"}


PATHS = {
    "": "",
    "/": "",
    "/any/prefix/": "/any/prefix",
    "/@/space%20word/": "/@/space word",
    "/@/space word": "/@/space word",
    "/m%C3%BCller;1": "/müller;1",
}
NONE = {
    "https://lab.example/prefix": 'begins with "/"',
    "//lab.example": "no empty part",
    "/a//b": "no empty part",
    "/a/%2e%2e/b": 'no ".."',
    "/.": 'no "."',
    "/a?b": r'without "\?"',
    "/a%2Fb": "no slash within a part",
    "/a\\b": "no backslash",
    "/a%0d%0ab": "no control character",
    "/a%ff": "UTF-8",
}


@pytest.mark.parametrize(("text", "path"), PATHS.items())
def test_a_base_path_is_read_and_encoded(text: str, path: str) -> None:
    """It is kept decoded and encoded in one way, which is read as the same path again."""
    assert read_base_path(text) == path
    assert read_base_path(encode_path(path)) == path
    assert not set(encode_path(path)) & set(' ;,"<>ü')


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        *(("base_path", text, reason) for text, reason in NONE.items()),
        # Anybody could own a name.
        *(("trusted_proxies", text, "address or network") for text in ("proxy.example", "10.0.0.1/8", "127.0.0.1, *")),
    ],
)
def test_a_wrong_setting_is_refused(name: str, text: str, reason: str) -> None:
    """The refusal has the reason and the given text."""
    with pytest.raises(ValidationError, match=reason) as refusal:
        Settings.model_validate({name: text})
    assert repr(text) in str(refusal.value)


def _seen(path: str, headers: dict[str, str], *, client: str = PROXY, kind: str = "http", **settings: Any) -> Any:
    """Return the request that the app sees behind a proxy, or the status of an earlier answer."""
    app, send = AsyncMock(), AsyncMock()
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
    if app.await_args:
        return app.await_args.args[0]
    answer = send.await_args_list[0].args[0]
    return answer["status"], dict(answer["headers"]).get(b"location", b"").decode()


@pytest.mark.parametrize(
    ("who", "is_believed"),
    [
        ({"client": PROXY}, True),
        ({"client": f"::ffff:{PROXY}"}, True),
        ({"trusted_proxies": "198.51.100.1,192.0.2.0/24"}, True),  # a network stands for all its addresses
        ({"trusted_proxies": "192.0.2.8/31,2001:db8::/32"}, False),
        ({"client": STRANGER}, False),
        ({"client": "127.0.0.1"}, False),
        ({"client": "testclient"}, False),
        ({"trusted_proxies": ""}, False),
        ({"host": "evil.example"}, False),  # a stranger's page, on the machine of the proxy
    ],
)
def test_only_a_named_proxy_is_believed(who: dict[str, Any], is_believed: bool) -> None:
    """From a named proxy, scheme, host and removed prefix are those that the browser used; otherwise the request's."""
    host = who.pop("host", HOST)
    seen = _seen("/work", {**FORWARDED, "host": host}, **who)
    out = ("https", "lab.example", "/out side", "/out side/work")
    told = seen["scheme"], dict(seen["headers"])[b"host"].decode(), seen["root_path"], seen["path"]
    assert told == (out if is_believed else ("http", host, "", "/work"))
    assert seen["raw_path"] == encode_path(seen["path"]).encode()
    assert (route_path(seen), address_of(seen, "x")) == ("/work", f"{'/out%20side' if is_believed else ''}/x")


def test_its_prefix_comes_before_the_servers_own() -> None:
    """A proxy that removes a part of the path leaves the server's own part; without its slash it redirects there.

    A wrong prefix is refused, rather than leading browsers elsewhere.
    """
    seen = _seen("/in/side/work", FORWARDED, base_path="/in/side")
    assert (seen["root_path"], seen["path"]) == ("/out side/in/side", "/out side/in/side/work")
    assert _seen("/in", FORWARDED, base_path="/in/") == (307, "/out%20side/in/")
    for prefix in ("outside", "//evil.example", "/a/../b"):
        assert _seen("/", {"x-forwarded-prefix": prefix}) == (400, "")


@pytest.mark.parametrize("proto", ["https", "wss", "http, HTTPS"])
def test_a_websocket_is_as_secure_as_its_page(proto: str) -> None:
    """Its scheme has either name, and the nearest proxy decides."""
    assert _seen("/x", {"x-forwarded-proto": proto}, kind="websocket")["scheme"] == "wss"


def test_a_page_tells_which_setting_is_missing() -> None:
    """Without it the page's addresses would lead nowhere; pages that work without it are not refused."""
    page = {"x-forwarded-prefix": "/user/ann/proxy/8000", "accept": "text/html"}
    assert _seen("/", page, trusted_proxies="") == (400, "")
    assert _seen("/", page, client="testclient")["root_path"] == ""
    assert _seen("/in/", {**page, "x-forwarded-prefix": "/in"}, client=STRANGER, base_path="/in")["path"] == "/in/"
    assert _seen("/", {**page, "host": "evil.example"}, client=STRANGER)["path"] == "/"


def test_nothing_is_outside(start_server: Any) -> None:
    """Addresses outside the base do not exist, even those that begin with the same letters."""
    with start_server(base_path="/any/prefix") as (server, client):
        for path in ("/", "/work", "/any/prefixes/", "/any/", "/static/shared/style.css"):
            error_of(httpx.get(server.origin + path), 404)
        for path in ("/any/viz/x", "/any/prefix"):
            assert refused_socket(f"ws://127.0.0.1:{server.port}{path}") == 404
        bare = httpx.get(f"{server.origin}/any/prefix?x=1")
        assert (bare.status_code, bare.headers["location"]) == (307, "/any/prefix/?x=1")
        assert client.get("healthz").status_code == 200


@pytest.mark.parametrize("base", ["", BASE], ids=["root", "base"])
def test_all_addresses_lie_below_the_base(start_server: Any, base: str) -> None:
    """Pages, scripts, sessions, cookies and links of a class have the server's base, and without one the root.

    A redirection does not name a prefix that a proxy removed: some proxies put it before each address themselves.
    """
    with start_server(base_path=base, token=TOKEN, trusted_proxies="127.0.0.1") as (server, client):
        printed = server.app.state.services.settings.link(server.port).replace("localhost", "127.0.0.1")
        behind = httpx.get(printed, headers={"x-forwarded-prefix": "/out%20side"})
        assert behind.headers["location"].startswith("./")
        assert f"Path=/out%20side{base}/;" in behind.headers["set-cookie"]
        welcome = client.get(printed)
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
