"""Random visits: no press on any page breaks it, by an error in the console or by the server's own fault."""

import random
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.conftest import Complaints
from tests.browser.host import Server

PLACES = ["./", "learn", "failures", "lectures", "work", "references", "sweep/new"]
ROOM = 6
"""Sessions that the visitor may have begun before they are ended."""
TEXTS = ("", "0", "-1", "7", "0.5", "1e9", "12, 13", "a", "<b>&amp;</b>", "x" * 300)
FILE = {"name": "notes.txt", "mimeType": "text/plain", "buffer": b"no picture"}
KEYS = (
    *("Space", "Enter", "Escape", "Tab", "Shift+Tab", "ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End"),
    *("PageUp", "PageDown", "+", "-", "0", "?", "Control+z", *"abcdefghijklmnopqrstuvwxyz"),
)

# What can be pressed: in the topmost dialog if one is open, visible, and of this site.
OFFERED = """() => {
    const dialogs = [...document.querySelectorAll('dialog[open]')];
    const within = dialogs.at(-1) ?? document;
    const wanted = 'a[href], button, summary, input, select, textarea, canvas, [tabindex], '
        + '[role=button], [role=slider], [role=tab], [role=option], [role=menuitem], [role=checkbox], [role=switch]';
    const offered = [...within.querySelectorAll(wanted)].filter((it) => {
        const { width, height } = it.getBoundingClientRect();
        if (!width || !height || it.disabled || it.closest('[inert]')) return false;
        return !(it instanceof HTMLAnchorElement) || (it.origin === location.origin && it.target !== '_blank');
    });
    window.__offered = offered;
    const words = (it) => (it.ariaLabel || it.textContent || it.name || '').trim().slice(0, 40);
    return offered.map((it) => [it.localName, it.type ?? '', words(it)]);
}"""

# Brings one of those elements into view, and returns its box.
SHOWN = """(index) => {
    const it = window.__offered?.[index];
    if (!it?.isConnected) return null;
    it.scrollIntoView({ block: 'center', inline: 'center', behavior: 'instant' });
    const { x, y, width, height } = it.getBoundingClientRect();
    return [x, y, width, height];
}"""

# Keeps a page that would be left for another site.
STAYS = """addEventListener('click', (event) => {
    const link = event.composedPath().find((it) => it instanceof HTMLAnchorElement);
    if (link && (link.origin !== location.origin || link.target === '_blank')) event.preventDefault();
});"""


class Visitor:
    """Somebody who presses anything, in an order that a seed decides."""

    def __init__(self, page: Any, seed: int, places: list[str]) -> None:
        self.page, self.seed = page, seed
        self.done: deque[str] = deque(maxlen=25)
        self.seen: set[str] = set()
        self._random, self._places = random.Random(seed), places
        page.add_init_script(STAYS)
        page.on("dialog", lambda dialog: dialog.accept())

    def wander(self, seconds: float, check: Callable[[], None]) -> None:
        """Act for a while, with a check after each action."""
        from playwright.sync_api import Error

        end = time.monotonic() + seconds
        while time.monotonic() < end:
            try:
                self._act()
            except Error as error:
                # The page may have gone to another one; its console says what is wrong with a page.
                self.done.append(f"    in vain: {error.message.splitlines()[0]}")
            self.seen.add(self.page.url.split("?")[0].split("#")[0])
            self.page.wait_for_timeout(self._random.choice((0, 20, 100)))
            check()

    @property
    def story(self) -> str:
        return "\n".join([f"seed {self.seed}; last actions:", *self.done])

    def _act(self) -> None:
        draw = self._random.random()
        if draw < 0.1:
            place = self._random.choice(self._places)
            self.done.append(f"go to {place}")
            self.page.goto(place, wait_until="commit")
            self.page.wait_for_load_state("domcontentloaded")
        elif draw < 0.25:
            key = self._random.choice(KEYS)
            self.done.append(f"{self.page.url}: key {key}")
            self.page.keyboard.press(key)
        elif offered := self.page.evaluate(OFFERED):
            self._press(offered)

    def _press(self, offered: list[list[str]]) -> None:
        """Press one of a random kind: a page has more links than controls."""
        chosen = self._random.choice(sorted({(name, kind) for name, kind, _ in offered}))
        index = self._random.choice([at for at, (*of, _) in enumerate(offered) if tuple(of) == chosen])
        name, kind, words = offered[index]
        self.done.append(f"{self.page.url}: {name} {kind} {words!r}")
        element = self.page.evaluate_handle("(index) => window.__offered[index]", index).as_element()
        if kind == "file":
            element.set_input_files([FILE])
        elif name == "select":
            options = element.evaluate("(it) => [...it.options].map((option) => option.value)")
            if options:
                element.select_option(self._random.choice(options), timeout=1000)
        elif (place := self.page.evaluate(SHOWN, index)) is not None:
            self._point(place, drags=name == "canvas" or kind == "range")
            if name == "textarea" or kind in {"text", "number", "search"}:
                self.page.keyboard.press("Control+a")
                self.page.keyboard.insert_text(self._random.choice(TEXTS))
                self.page.keyboard.press(self._random.choice(("Enter", "Tab")))

    def _point(self, place: list[float], *, drags: bool) -> None:
        """Press the mouse in the middle of an element, or anywhere on it, perhaps to drag it."""
        x, y, width, height = place
        if not drags:
            self.page.mouse.click(x + width / 2, y + height / 2)
            return
        anywhere = lambda: (x + width * self._random.random(), y + height * self._random.random())  # noqa: E731
        self.page.mouse.move(*anywhere())
        self.page.mouse.down()
        if self._random.random() < 0.5:
            self.page.mouse.move(*anywhere(), steps=3)
        self.page.mouse.up()


@pytest.fixture(scope="module")
def server(beside_others: Server) -> Server:
    """A server on which nothing takes long; it has a saved run."""
    beside_others.post("runs", {"session": beside_others.start_session(frames=20)["id"]})
    return beside_others


@pytest.mark.parametrize(
    ("seed", "seconds"), [(1, 2.5), *(pytest.param(seed, 60.0, marks=pytest.mark.slow) for seed in range(10, 18))]
)
def test_a_visit_breaks_nothing(page: Any, server: Server, complaints: Complaints, seed: int, seconds: float) -> None:
    """A few seconds, the same visitor in every run of the tests; others stay for a minute and see several pages."""
    complaints.expected = ("status of 4",)  # the browser itself reports refused requests
    faults: list[str] = []
    page.on("response", lambda it: faults.append(f"{it.status} {it.url}") if it.status >= 500 else None)
    lessons = [each["id"] for each in server.get("lessons")["lessons"]]
    failures = [each["id"] for each in server.get("failures")]
    session = server.start_session(frames=60)
    others = [session["page"], f"learn/{lessons[seed % len(lessons)]}", f"failures/{failures[seed % len(failures)]}"]
    visitor = Visitor(page, seed, [*PLACES, *others])
    page.goto("./")

    def check() -> None:
        assert not complaints.unexpected, f"{complaints.unexpected}\n{visitor.story}"
        assert not faults, f"{faults}\n{visitor.story}"
        if len(server.get("sessions")) > ROOM:
            server.end_sessions(keep=1)  # one that is just starting would be refused to its page

    visitor.wander(seconds, check)
    assert seconds < 60 or len(visitor.seen) > 3, visitor.seen
