"""A class in a browser: the lecturer's page, those of followers, and what all of them see."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from tests.browser.host import Server
from tests.browser.views import SessionPage, View
from tests.conftest import FRUGAL

# A page can be cut off: what it has open breaks, and nothing new comes about until it is let in again.
CUTTING = """
window.cut = false;
const open = new Set();
window.cutOff = (cut) => {
    window.cut = cut;
    if (cut) for (const socket of open) socket.close();
};
window.WebSocket = class extends WebSocket {
    constructor(address, ...more) {
        super(window.cut ? `ws://${location.host}/nowhere` : address, ...more);
        open.add(this);
        this.addEventListener('close', () => open.delete(this));
    }
};
"""
PHONE, WIDE = (390, 844), (1280, 800)


class Follower(View):
    """The page of one who follows."""

    def open(self, link: str) -> None:
        self.page.goto("/" + link.split("/", 1)[1])

    def text(self, selector: str) -> str:
        return str(self.page.inner_text(selector))

    @property
    def frame(self) -> str | None:
        """The number of the frame that is painted."""
        return self.page.locator(".flat-canvas").get_attribute("data-frame")


def lead(page: Any) -> str:
    """Let a class follow a page, and return the link."""
    page.locator(".follow-chip:enabled").click()
    page.get_by_role("button", name="Begin", exact=True).click()
    return str(page.locator("[data-role=class-link]").inner_text())


class Lecturer(SessionPage):
    """The page of a session with a class."""

    def __init__(self, page: Any, server: Server) -> None:
        super().__init__(page, server)
        self.session_id = self.id

    def lead(self) -> str:
        """Let a class follow, and return the link."""
        link = lead(self.page)
        place, name = link.rsplit("/", 1)
        assert place == f"{self._server.url.removeprefix('http://')}/f"
        assert re.fullmatch(r"[0-9a-z]{4}-[0-9a-z]{4}-[0-9a-z]{4}", name)
        return link

    def sees_the_code(self) -> None:
        code = self.page.locator(".class-qr img")
        self.until(lambda: code.evaluate("it => it.naturalWidth") > 0, "the code is drawn")

    def counts(self, words: str) -> None:
        self.until(lambda: self.page.inner_text(".follow-chip") == words, f"the chip says {words}")


def visitor(chromium: Any, *scripts: str, **options: Any) -> Any:
    """Return a new context of a browser that waits a minute for a page, and has scripts run in each.

    Places of a page that wait for their content do not shimmer: each picture costs processor time.
    """
    context = chromium.new_context(reduced_motion="reduce", **options)
    context.set_default_timeout(60_000)
    for script in (FRUGAL, *scripts):
        context.add_init_script(script)
    return context


def listen(page: Any, hear: Callable[[str], None]) -> None:
    """Hear all that is wrong on a page."""
    page.on("pageerror", lambda error: hear(str(error)))
    page.on("console", lambda line: hear(f"{line.text} {line.location['url']}") if line.type == "error" else None)


@contextmanager
def newcomers(chromium: Any, server: Server, hear: Callable[[str], None]) -> Iterator[Callable[..., Follower]]:
    """Let people come who were never here, by default with a phone; at the end all classes end."""
    contexts = []

    def come(size: tuple[int, int] = PHONE) -> Follower:
        viewport = {"width": size[0], "height": size[1]}
        context = visitor(chromium, CUTTING, viewport=viewport, base_url=f"{server.url}/", color_scheme="light")
        contexts.append(context)
        page = context.new_page()
        listen(page, hear)
        return Follower(page)

    yield come
    for context in contexts:
        context.close()
    for follow in server.get("follows"):
        server.delete(f"follows/{follow['id']}")


def all_of(followers: list[Follower], holds: Callable[[Follower], object], what: str) -> None:
    for number, follower in enumerate(followers):
        follower.until(lambda one=follower: holds(one), f"{what}, with follower {number}")
