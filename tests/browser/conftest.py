"""Shared by the browser tests: one server, one chromium, and a page that must not complain."""

import shutil
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

import pytest

from tests.browser.class_room import Follower, listen, newcomers, visitor
from tests.browser.host import START_S, Server, until
from tests.browser.views import Gallery, SessionPage
from tests.conftest import CHROMIUM
from tests.installing import ROOT, install

Watch: TypeAlias = Callable[..., SessionPage]
EXAMPLE = ROOT / "examples" / "own_experiment"
WINDOW = {"width": 1280, "height": 800}
TOKEN = "salt & pepper, 100 %"
LIMITS = {"MAX_SESSIONS": "12", "MAX_PARTICLES": "2000", "MAX_SWEEP_RUNS": "100", "SWEEP_JOBS": "1"}
"""Limits of a server on which nothing takes long."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark everything here: it needs a browser, and software rendering needs patience."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.browser)
            item.add_marker(pytest.mark.timeout(480))
            if not CHROMIUM.exists():
                item.add_marker(pytest.mark.skip(reason="needs Debian's chromium at /usr/bin/chromium"))


@pytest.fixture(scope="session", autouse=True)
def _compiled(compiled: None) -> None:
    """Every server here is ready at once."""


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    server = Server(tmp_path_factory.mktemp("served"), PFTRACK_MAX_SESSIONS="8", PFTRACK_SWEEP_JOBS="1")
    yield server
    server.stop()


@pytest.fixture(scope="session")
def beside_others(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with its own root, token, limits, trusted proxy and packages.

    The packages are the example, one with a new kind of mark, and a broken one.
    """
    place = tmp_path_factory.mktemp("installed")
    shutil.copytree(EXAMPLE / "pftrack_turning", place / "pftrack_turning")
    install(place, "the-example", "", "turning = pftrack_turning:EXPERIMENT")
    install(place, "circled", Path(__file__).with_name("circled.py").read_text(), "circled = circled:EXPERIMENT")
    install(place, "a-broken-one", "raise RuntimeError('in vain')", "broken = a_broken_one:EXPERIMENT")
    different = {**LIMITS, "BASE_PATH": "/", "TRUSTED_PROXIES": "127.0.0.1"}
    variables = {f"PFTRACK_{name}": value for name, value in different.items()}
    server = Server(tmp_path_factory.mktemp("served"), installed=place, token=TOKEN, **variables)
    # A request that waits for that over 10 s is refused, which a page writes to its console.
    until(lambda: server.get("compilation")["finished"], "the packages' experiments are ready", START_S)
    yield server
    server.stop()


class Complaints(list[str]):
    """Complaints of the browser; a test that breaks things names those it expects."""

    expected: tuple[str, ...] = ()
    is_leaving = False

    def hear(self, text: str) -> None:
        # A page that is closed does not get what it was just fetching, which the scene's client writes to the console.
        if not (self.is_leaving and "Failed to fetch" in text):
            self.append(text)

    @property
    def unexpected(self) -> list[str]:
        return [text for text in self if not any(part in text for part in self.expected)]


@pytest.fixture
def complaints() -> Complaints:
    return Complaints()


# Left to itself a page shows the flat view here, where WebGL runs in software; that is also the faster one to test.
# It asks for a context of WebGL to find that out, which takes as long as a small test, unless somebody has chosen.
# All plots and the numbers are unfolded, as somebody may have left them. The start page fetches nothing ahead, which
# would be a hundred requests.
CHOSEN = """if (location.origin !== 'null') {{
    delete window.DOMParser;
    localStorage['pftrack-view'] ??= '{}';
    localStorage['pftrack-seen'] ??= 'ball fish growing hand head histogram linkage prism sine structure trajectories';
    localStorage['pftrack-side'] ??= JSON.stringify({{isAll: true, hasNumbers: true}});
}}"""


# A page that shows a loss has the server try changes for as long as the loss is shown, which takes a whole processor.
UNEXPLORED = """(() => {
    const ask = window.fetch;
    window.fetch = (what, ...more) =>
        String(what.url ?? what).endsWith('/explorations') ? new Promise(() => {}) : ask(what, ...more);
})();"""


@pytest.fixture(scope="session")
def contexts(chromium: Any) -> Iterator[Callable[[Server], Any]]:
    """The browser of a returning visitor of a server: the pages' files are in its cache."""

    @cache
    def context(server: Server) -> Any:
        made = visitor(chromium, viewport=WINDOW, base_url=f"{server.url}/", color_scheme="light")
        made.new_page()  # stays open: another one for each test to be cleared from would be another process
        return made

    yield context
    context.cache_clear()


@pytest.fixture
def unchosen(contexts: Callable[[Server], Any], server: Server, complaints: Complaints) -> Iterator[Any]:
    """A page of 1280 x 800 of a visitor without any choices yet; at the end its console must be clean."""
    context = contexts(server)
    if server.token:
        context.request.get("./", params={"token": server.token})  # trades it for a cookie
    page = context.new_page()
    # A browser remembers 250 files by itself, and the start page with what it fetches ahead has more.
    page.add_init_script("performance.setResourceTimingBufferSize(1000)")
    listen(page, complaints.hear)
    yield page
    complaints.is_leaving = True
    first, *opened = context.pages
    for each in opened:
        each.close()
    chosen = context.new_cdp_session(first)
    chosen.send("Storage.clearDataForOrigin", {"origin": server.origin, "storageTypes": "cookies,local_storage"})
    chosen.detach()
    server.end_sessions()
    assert complaints.unexpected == []


@pytest.fixture
def page(unchosen: Any, request: pytest.FixtureRequest) -> Any:
    """A fresh page with the flat view chosen, or the 3-D scene where the test is marked with `scene`.

    What a page begins by itself to explore is left alone, but where the test is marked with `explores`.
    """
    view = "scene" if request.node.get_closest_marker("scene") else "flat"
    unchosen.add_init_script(CHOSEN.format(view))
    if not request.node.get_closest_marker("explores"):
        unchosen.add_init_script(UNEXPLORED)
    return unchosen


# The styles of a page with sessions, and no script.
STYLES = ("shared/palette", "shared/style", "shared/figure/figure", "session/session")
LINKS = "".join(f'<link rel="stylesheet" href="static/{style}.css">' for style in STYLES)
BARE = f"<head><title>Bare</title>{LINKS}</head><body><main></main></body>"


@pytest.fixture
def bare(page: Any) -> Any:
    """A page of the server with its styles and no script but those that a test loads."""
    page.route("**/favicon.ico", lambda route: route.fulfill(status=204))
    page.goto("healthz")
    page.evaluate("(text) => (document.documentElement.innerHTML = text)", BARE)
    return page


@pytest.fixture
def gallery(page: Any) -> Gallery:
    page.goto("./")
    return Gallery(page)


@pytest.fixture
def watch(page: Any, server: Server) -> Callable[..., SessionPage]:
    """Start a session over REST and open its page."""

    def opened(**wish: Any) -> SessionPage:
        session = server.start_session(**wish)
        page.goto(session["page"])
        return SessionPage(page, server).ready()

    return opened


@pytest.fixture
def stranger(chromium: Any) -> Iterator[Any]:
    """A page of a new visitor, in a browser that shows sessions flat."""
    context = visitor(chromium, CHOSEN.format("flat"), viewport=WINDOW)
    yield context.new_page()
    context.close()


@pytest.fixture
def newcomer(chromium: Any, server: Server, complaints: Complaints) -> Iterator[Callable[..., Follower]]:
    """Open pages of new visitors, by default on a phone."""
    with newcomers(chromium, server, complaints.hear) as come:
        yield come
