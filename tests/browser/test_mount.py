"""Several sessions in a page: in step, each with the parts asked for, and gone when disposed of."""

from typing import Any

import pytest

from tests.browser.host import Server
from tests.browser.views import LINES, SessionPage, View

# Keeps count of what a page may leave behind: listeners at what outlives an element, timers, frames asked for, sockets.
COUNTING = """(() => {
    const alive = (window.alive = { listeners: new Map(), timers: new Set(), frames: new Set(), sockets: new Set() });
    const outlives = (it) => it === window || it === document || it instanceof MediaQueryList;
    const { addEventListener, removeEventListener } = EventTarget.prototype;
    EventTarget.prototype.addEventListener = function (type, listener, options) {
        if (outlives(this) && listener) {
            const key = {};
            alive.listeners.set(key, { type, listener, target: this });
            options?.signal?.addEventListener("abort", () => alive.listeners.delete(key));
        }
        return addEventListener.call(this, type, listener, options);
    };
    EventTarget.prototype.removeEventListener = function (type, listener, options) {
        for (const [key, it] of alive.listeners) {
            if (it.target === this && it.type === type && it.listener === listener) alive.listeners.delete(key);
        }
        return removeEventListener.call(this, type, listener, options);
    };
    const counted = (start, stop, waiting, again) => {
        const [begin, end] = [window[start], window[stop]];
        window[start] = (work, ...more) => {
            const id = begin((...given) => {
                if (!again) waiting.delete(id);
                work(...given);
            }, ...more);
            waiting.add(id);
            return id;
        };
        window[stop] = (id) => {
            waiting.delete(id);
            end(id);
        };
    };
    counted("setTimeout", "clearTimeout", alive.timers, false);
    counted("setInterval", "clearInterval", alive.timers, true);
    counted("requestAnimationFrame", "cancelAnimationFrame", alive.frames, false);
    window.WebSocket = class extends WebSocket {
        constructor(...given) {
            super(...given);
            alive.sockets.add(this);
            this.addEventListener("close", () => alive.sockets.delete(this));
        }
    };
})()"""
LEFT = """() => ({
    listeners: [...alive.listeners.values()].map(({ type }) => type).sort(),
    timers: alive.timers.size,
    frames: alive.frames.size,
    sockets: alive.sockets.size,
    figures: document.querySelectorAll(".figure-view[data-shown]").length,
    elements: document.querySelectorAll("body :not(.tooltip, .tooltip *)").length,
})"""
PLACES = """() => {
    const main = document.querySelector("main");
    main.style = "display: grid; grid-template-columns: 1fr 1fr; height: 100vh";
    main.innerHTML = '<div id="a"></div><div id="b"></div>';
}"""
MOUNT = """async ([place, options, shared]) => {
    const { Mounted } = await import("./static/session/mount.js");
    const { SessionStart } = await import("./static/session/session_start.js");
    const { keepUp } = await import("./static/session/clock.js");
    const { Steering } = await import("./static/session/steering.js");
    const { steering, store: lead } = (shared && window.mounted.a) || {};
    const start = new SessionStart(document.getElementById(place), options);
    const { store, signal } = ((window.mounted ??= {})[place] = new Mounted(start, { ...options, steering }));
    if (shared) keepUp({ store, steering: new Steering(store, signal) }, lead, signal);
}"""


class Several(View):
    """A page with places for two sessions; all that there is to count on it is the component's."""

    def __init__(self, page: Any, server: Server) -> None:
        super().__init__(page)
        self.server = server
        page.evaluate(COUNTING)
        page.evaluate(PLACES)

    def mount(self, place: str, options: dict[str, Any], *, shared: bool = False) -> None:
        """Mount a session in a place, in step with the first one if that is shared, and wait until it is connected."""
        self.page.evaluate(MOUNT, [place, options, shared])
        self.until(lambda: self.ask(place, "store.isSteerable"), f"session {place} listens")

    def ask(self, place: str, expression: str) -> Any:
        return self.page.evaluate(f"mounted.{place}.{expression}")

    def position(self, place: str) -> int:
        return int(self.ask(place, "store.session.position"))


@pytest.fixture
def several(bare: Any, server: Server) -> Several:
    return Several(bare, server)


# test_failures.py watches two sessions in step.
@pytest.mark.slow
@pytest.mark.scene
def test_two_sessions_are_in_step_and_leave_nothing_behind(several: Several, server: Server) -> None:
    """Two sessions in step play and pause together; one is disposed of, the other goes on.

    One has the 3-D scene, and the other the flat view.
    """
    page = several.page
    one, other = (server.start_session(tracker=tracker)["id"] for tracker in ("h-spf", "condensation"))
    # What explains words, presents and opens dialogs listens as long as the page is there.
    page.evaluate("Promise.all(['mount', 'session_start'].map((it) => import(`./static/session/${it}.js`)))")
    at_first = page.evaluate(LEFT)
    several.mount("a", {"session": one})
    several.mount("b", {"session": other, "view": "flat"}, shared=True)
    several.until(lambda: SessionPage(page, server).particles > 0, "the scene of the one is drawn")
    several.until(lambda: page.locator("#b .flat-canvas[data-frame]").count() == 1, "so is the flat view of the other")
    several.until(lambda: page.evaluate(LEFT)["figures"] >= 2, "both have their plots")

    page.click("#a .play")
    several.until(lambda: several.position("b") > 5, "the other one follows")
    page.click("#b .play")
    several.until(lambda: not several.ask("a", "store.session.playing"), "the button of either pauses both")
    several.until(lambda: several.position("a") == several.position("b"), "both stand at the same frame")

    several.ask("b", "dispose()")
    assert page.locator("#b *").count() == 0
    several.until(lambda: page.evaluate(LEFT)["sockets"] == 1, "the connection of the first one is left")
    several.until(lambda: page.locator("#a .figure-view[data-shown]").count() > 0, "so are its plots")
    before = several.position("a")
    page.keyboard.press("ArrowRight")
    several.until(lambda: several.position("a") == before + 1, "it goes on, and has the keys")
    several.until(lambda: page.evaluate(LINES), "its plots are there")

    several.ask("a", "dispose()")
    several.until(lambda: page.evaluate(LEFT) == at_first, f"all is as before, {at_first}, not {page.evaluate(LEFT)}")
    assert {server.session(it)["state"] for it in (one, other)} <= {"ready", "ended"}


def test_keys_go_to_the_session_that_has_the_focus(several: Several, server: Server) -> None:
    """Keys move the session in which they are pressed, of two that are not in step."""
    page = several.page
    for place in "ab":
        several.mount(place, {"session": server.start_session()["id"], "parts": ["transport"]})
    page.click("#b .counter")
    page.keyboard.press("ArrowRight")
    several.until(lambda: several.position("b") == 1, "the second one moves")
    page.click("#a [aria-label^='One frame forward']")
    several.until(lambda: several.position("a") == 1, "the first one moves")
    page.keyboard.press("ArrowRight")
    several.until(lambda: several.position("a") == 2, "it has the keys now")
    assert several.position("b") == 1
