"""A random visitor: presses whatever a page offers, in an order that a seed decides."""

import random
import time
from collections import deque
from collections.abc import Callable
from typing import Any

__all__ = ["Visitor"]

REMEMBERED = 25
"""Number of actions that a failure reports."""

MOVE_SHARE, KEY_SHARE = 0.1, 0.15
KEYS = (
    *("Space", "Enter", "Escape", "Tab", "Shift+Tab", "ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End"),
    *("PageUp", "PageDown", "+", "-", "0", "?", "Control+z", *"abcdefghijklmnopqrstuvwxyz"),
)
TEXTS = ("", "0", "-1", "7", "0.5", "1e9", "12, 13", "a", "<b>&amp;</b>", "x" * 300)

# What can be pressed: in the topmost dialog if one is open, not covered by a length of zero, and of this site.
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

# Brings an element of those into view, and returns where its middle is.
SHOWN = """(index) => {
    const it = window.__offered?.[index];
    if (!it?.isConnected) return null;
    it.scrollIntoView({ block: 'center', inline: 'center', behavior: 'instant' });
    const { x, y, width, height } = it.getBoundingClientRect();
    return [x, y, width, height];
}"""

OPTIONS = "(index) => [...(window.__offered?.[index]?.options ?? [])].map((it) => it.value)"

# A page that a visitor leaves by an answer that is a file, or by a link that another element covers, stays.
STAYS = """addEventListener('click', (event) => {
    const link = event.composedPath().find((it) => it instanceof HTMLAnchorElement);
    if (link && (link.origin !== location.origin || link.target === '_blank')) event.preventDefault();
});"""


class Visitor:
    """Somebody who presses anything."""

    def __init__(self, page: Any, seed: int, places: list[str], files: list[dict[str, Any]]) -> None:
        """Come to a page.

        Args:
            page: The browser's page.
            seed: Decides everything that is not up to the pages.
            places: Addresses between which it moves, beside following links; it stays where it is if there are none.
            files: What it chooses where a file is asked for.
        """
        self.page = page
        self.seed = seed
        self.done: deque[str] = deque(maxlen=REMEMBERED)
        self.seen: set[str] = set()
        self._random = random.Random(seed)
        self._places, self._files = places, files
        page.add_init_script(STAYS)
        page.on("dialog", lambda dialog: dialog.accept())

    def wander(self, seconds: float, check: Callable[[], None]) -> None:
        """Go about for a while; after each action it is checked whether all is well."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._act()
            self.page.wait_for_timeout(self._random.choice((0, 20, 100)))
            check()

    @property
    def story(self) -> str:
        """What it did last."""
        return "\n".join([f"seed {self.seed}; last actions:", *self.done])

    def _act(self) -> None:
        from playwright.sync_api import Error

        draw = self._random.random()
        try:
            if draw < MOVE_SHARE:
                self._move()
            elif draw < MOVE_SHARE + KEY_SHARE:
                self._key(self._random.choice(KEYS))
            else:
                self._press()
        except Error as error:
            # The page may go to another in between; what is wrong with a page is heard from its console.
            self.done.append(f"    in vain: {error.message.splitlines()[0]}")
        self.seen.add(self.page.url.split("?")[0].split("#")[0])

    def _move(self) -> None:
        if not self._places:
            return
        place = self._random.choice(self._places)
        self.done.append(f"go to {place}")
        self.page.goto(place, wait_until="commit")
        self.page.wait_for_load_state("domcontentloaded")

    def _key(self, key: str) -> None:
        self.done.append(f"{self.page.url}: key {key}")
        self.page.keyboard.press(key)

    def _press(self) -> None:
        offered = self.page.evaluate(OFFERED)
        if not offered:
            self._move()
            return
        # Of one kind among the kinds: a page has more links than controls.
        chosen = self._random.choice(sorted({(name, kind) for name, kind, _ in offered}))
        index = self._random.choice([at for at, (*of, _) in enumerate(offered) if tuple(of) == chosen])
        name, kind, words = offered[index]
        self.done.append(f"{self.page.url}: {name} {kind} {words!r}")
        if kind == "file":
            self._element(index).set_input_files([self._random.choice(self._files)])
            return
        if name == "select":
            options = self.page.evaluate(OPTIONS, index)
            if options:
                self._element(index).select_option(self._random.choice(options), timeout=1000)
            return
        place = self.page.evaluate(SHOWN, index)
        if place is None:
            return
        self._point(place, drags=name == "canvas" or kind == "range")
        if name == "textarea" or kind in {"text", "number", "search"}:
            self.page.keyboard.press("Control+a")
            self.page.keyboard.insert_text(self._random.choice(TEXTS))
            self.page.keyboard.press(self._random.choice(("Enter", "Tab")))

    def _element(self, index: int) -> Any:
        return self.page.evaluate_handle("(index) => window.__offered[index]", index).as_element()

    def _point(self, place: list[float], *, drags: bool) -> None:
        """Press the mouse on an element: its middle, or somewhere on it, perhaps dragging it to somewhere else."""
        x, y, width, height = place
        if not drags:
            self.page.mouse.click(x + width / 2, y + height / 2)
            return
        self.page.mouse.move(x + width * self._random.random(), y + height * self._random.random())
        self.page.mouse.down()
        if self._random.random() < 0.5:
            self.page.mouse.move(x + width * self._random.random(), y + height * self._random.random(), steps=3)
        self.page.mouse.up()
