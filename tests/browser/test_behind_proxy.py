"""A server behind nginx with TLS, as docs/how-to/server.md sets it up: below the prefix, and as secure as the page."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlencode, urljoin, urlsplit

import cv2
import httpx
import numpy as np
import pytest

from tests.browser.class_room import lead, listen, visitor
from tests.browser.conftest import CHOSEN, TOKEN
from tests.browser.host import Server
from tests.browser.views import PARTICLES, SessionPage
from tests.conftest import BASE
from tests.nginx import NGINX, free_port, nginx, site

pytestmark = pytest.mark.skipif(NGINX is None, reason="needs Debian's nginx-light")

TAKEN_OFF = "/taken%20off"


class Behind(NamedTuple):
    """Where browsers find servers through nginx.

    Attributes:
        at_root: A server that trusts nginx, at the root.
        taken_off: The same server below a prefix that nginx takes off and reports.
        distrusted: The same in front of a server that does not trust nginx.
    """

    at_root: str
    taken_off: str
    distrusted: str


@pytest.fixture(scope="module")
def behind(tmp_path_factory: pytest.TempPathFactory, server: Server, beside_others: Server) -> Iterator[Behind]:
    trusting, other = (urlsplit(each.url).port or 0 for each in (beside_others, server))
    ports = [free_port() for _ in range(3)]
    sites = {
        ports[0]: site(ports[0], trusting, ""),
        ports[1]: site(ports[1], trusting, TAKEN_OFF, takes_off=True),
        ports[2]: site(ports[2], other, TAKEN_OFF, takes_off=True),
    }
    places = ("", TAKEN_OFF, TAKEN_OFF + BASE)
    with nginx(Path(tmp_path_factory.mktemp("nginx")), sites):
        yield Behind(*(f"https://localhost:{port}{place}" for port, place in zip(ports, places, strict=True)))


@pytest.fixture
def secure(chromium: Any, behind: Behind, beside_others: Server) -> Iterator[Any]:
    """A page of a browser outside, which has opened the link with the token."""
    context = visitor(chromium, CHOSEN.format("flat"), base_url=f"{behind.taken_off}/", color_scheme="light")
    page = context.new_page()
    errors: list[str] = []
    listen(page, errors.append)
    page.on("response", lambda answer: errors.append(f"{answer.status} {answer.url}") if answer.status >= 400 else None)
    page.goto(f"./?{urlencode({'token': TOKEN})}")
    yield page
    context.close()
    beside_others.end_sessions()
    assert errors == []


def test_a_session_plays_and_a_class_follows(behind: Behind, beside_others: Server, secure: Any) -> None:
    """Page, streams, scene, cookies, links and QR code are at the address that the proxy gives to the outside."""
    page, sockets = secure, []
    server, address = beside_others, behind.taken_off
    assert page.url == f"{address}/"
    (cookie,) = page.context.cookies()
    assert (cookie["secure"], cookie["httpOnly"]) == (True, True)
    assert cookie["path"] == f"{urlsplit(address).path}/"
    session = server.start_session(frames=40)
    page.on("websocket", lambda socket: sockets.append(socket.url))
    page.goto(f"{session['page']}?view=scene")
    shown = SessionPage(page, server)
    shown.until(lambda: shown.in_scene(PARTICLES, 0) > 0, "the scene has particles")
    page.locator(".play:enabled").click()
    shown.until(lambda: (shown.position or 0) > 3, "the page plays")
    place = address.replace("https", "wss")
    assert {url.partition("?")[0] for url in sockets} >= {
        f"{place}/api/v1/sessions/{session['id']}/stream",
        f"{place}/viz/{session['id']}",
    }
    assert all(url.startswith(f"{place}/") for url in sockets)

    link = f"https://{lead(page)}"
    assert link.startswith(f"{address}/f/")
    code = page.locator(".class-qr img")
    shown.until(lambda: code.evaluate("it => it.naturalWidth") > 0, "the code is drawn")
    picture = cv2.imdecode(np.frombuffer(code.screenshot(), np.uint8), cv2.IMREAD_GRAYSCALE)
    # The older `QRCodeDetector` cannot read one in fifty such codes.
    assert cv2.QRCodeDetectorAruco().detectAndDecode(picture)[0] == link

    follower = page.context.browser.new_page()
    follower.goto(link)
    follower.locator(".flat-canvas[data-frame]").wait_for()
    (seat,) = follower.context.cookies()
    assert (seat["secure"], seat["path"]) == (True, urlsplit(link).path)
    follower.context.close()


def test_the_page_says_what_a_proxy_must_pass_on(chromium: Any, beside_others: Server, tmp_path: Path) -> None:
    """Where no websocket comes through, a session says so within five seconds, with the remedy."""
    port, upstream = free_port(), urlsplit(beside_others.url).port or 0
    passing = re.sub(r" *proxy_set_header Upgrade .*\n", "", site(port, upstream, ""))
    session = beside_others.start_session(frames=5)
    with nginx(tmp_path, {port: passing}):
        page = chromium.new_page()
        page.goto(f"https://localhost:{port}/{session['page']}?{urlencode({'token': TOKEN})}", wait_until="commit")
        remedy = "a proxy must pass on websockets, with the headers Host, Upgrade"
        page.get_by_role("alert").filter(has_text=remedy).wait_for(timeout=60_000)
        page.close()
    beside_others.end_sessions()


def test_only_named_proxies_are_believed(behind: Behind) -> None:
    """A server that does not trust its proxy serves below its own base path, and names the missing setting.

    A browser cannot name a prefix: nginx empties the headers that it does not set.
    """
    with httpx.Client(verify=False, timeout=60) as client:  # noqa: S501
        trusted = client.get(behind.taken_off, headers={"authorization": "Bearer nothing"}, follow_redirects=False)
        assert urlsplit(urljoin(behind.taken_off, trusted.headers["location"])).path == f"{TAKEN_OFF}/"
        assert f'<base href="{BASE}/">' in client.get(f"{behind.distrusted}/").text
        told = client.get(f"{behind.distrusted}/", headers={"accept": "text/html"})
        assert told.status_code == 400
        assert f"removes {TAKEN_OFF} from the addresses" in told.json()["error"]["message"]
        assert "PFTRACK_TRUSTED_PROXIES=127.0.0.1" in told.json()["error"]["message"]

        headers = {"x-forwarded-prefix": "/made/up", "x-forwarded-host": "evil.example", "x-forwarded-proto": "http"}
        page = client.get(f"{behind.at_root}/", params={"token": TOKEN}, headers=headers)
        assert page.headers["location"] == "/"
        assert "secure" in page.headers["set-cookie"].lower()
