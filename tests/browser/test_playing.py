"""While a run plays, all that the page says is of the frame that is seen: picture, counter, readings, plots."""

from collections.abc import Iterator
from typing import Any

import pytest

from tests.browser.conftest import CHOSEN
from tests.browser.host import Server
from tests.browser.views import SessionPage

MOMENTS = 100
"""Looked at under each condition."""
FRAMES = 2
"""Which at least are seen in these moments, so that it plays."""

# Keeps the sockets of the page, and has what comes over them wait its turn where the line is slow: so many bytes a ms.
# Each timer delivers what has waited longest: two that are due in the same millisecond may go off in either order.
SOCKETS = """(() => {
    window.sockets = new Set();
    window.line = { bytesPerMs: Infinity };
    let [free, waiting] = [0, []];
    window.WebSocket = class extends WebSocket {
        constructor(...given) {
            super(...given);
            sockets.add(this);
        }
        addEventListener(kind, listener, ...more) {
            const late = (event) => {
                const now = performance.now();
                free = Math.max(free, now) + (event.data.length ?? event.data.byteLength) / line.bytesPerMs;
                waiting.push(() => listener(event));
                setTimeout(() => waiting.shift()(), free - now);
            };
            super.addEventListener(kind, kind === 'message' ? late : listener, ...more);
        }
    };
})()"""

# Plays; what the page says at some moments: between the frames of the display, whatever else is under way. A replay as
# fast as it can is over in a fifth of a second, so nothing may be waited for in between. The connection is lost after
# so many painted frames: by the clock a slow machine would lose each one before it shows anything.
WATCH = """([count, frames]) => new Promise((resolve) => {
    const seen = [];
    let [last, since] = ['', 0];
    const text = (selector) => document.querySelector(selector).textContent;
    const look = () => {
        const painted = document.querySelector('.flat-canvas').dataset.frame;
        const [caption, counter] = [text('.flat-caption'), text('.counter')].map((words) => words.split(' ')[1]);
        const cursor = document.querySelector('.scrubber[role=slider]').getAttribute('aria-valuenow');
        const error = [...document.querySelectorAll('.readout > dl dt')].find((it) => it.textContent === 'error');
        const moment = [painted, caption, counter, cursor, error.nextSibling.textContent];
        if (text('.play') === 'Pause') seen.push(moment);
        if (painted !== last) [last, since] = [painted, since + 1];
        if (since === frames) {
            since = 0;
            for (const each of sockets) each.close();
        }
        if (seen.length < count && text('.play') !== 'Play again') setTimeout(look, 1 + 10 * Math.random());
        else resolve(seen);
    };
    document.querySelector('.play').click();
    look();
})"""


@pytest.fixture
def page(chromium: Any, server: Server) -> Iterator[Any]:
    """A page whose display goes as fast as it does for people."""
    context = chromium.new_context(viewport={"width": 1280, "height": 800}, base_url=f"{server.url}/")
    context.set_default_timeout(60_000)
    context.add_init_script(CHOSEN.format("flat"))
    context.add_init_script(SOCKETS)
    yield context.new_page()
    context.close()
    server.end_sessions()


def test_all_that_is_said_is_of_the_frame_that_is_seen(page: Any, server: Server) -> None:
    """A frame is one message: no number is ever seen beside another frame's picture, however fast it plays and comes.

    It is computed, then replayed; at the speed of its source and as fast as it can; over a slow line; and again and
    again over new connections. The run is long, so that even a fast replay shows many frames on a loaded machine.
    """
    page.goto(server.start_session(frames=1000)["page"])
    shown = SessionPage(page, server).ready()
    conditions = ((1, "Infinity", None), (0, "Infinity", None), (1, "150", None), (1, "Infinity", 8))
    for speed, bytes_per_ms, lost_after in conditions:
        shown.command("speed", speed=speed)
        page.evaluate(f"line.bytesPerMs = {bytes_per_ms}")
        seen: list[list[str]] = []
        while len(seen) < MOMENTS:
            seen += play(shown, MOMENTS - len(seen), lost_after)
        errors = server.column(shown.id, "error")
        assert len({painted for painted, *_ in seen}) > FRAMES
        said = [[*4 * [painted], f"{errors[int(painted)]:.1f} px"] for painted, *_ in seen]
        wrong = [pair for pair in zip(seen, said, strict=True) if pair[0] != pair[1]]
        assert not wrong, f"{len(wrong)} of {len(seen)} moments, at {speed} times, {bytes_per_ms} bytes/ms: {wrong[:3]}"


def play(shown: SessionPage, count: int, lost_after: int | None) -> list[list[str]]:
    """Play from the beginning, and return what the page says at so many moments, or until the end of the run.

    The connection is lost each time that so many frames are painted.
    """
    shown.press("Home")
    shown.stands_at(0)
    seen: list[list[str]] = shown.page.evaluate(WATCH, [count, lost_after])
    # A page that has lost its connection ignores keys.
    shown.until(lambda: shown.page.evaluate("[...sockets].at(-1).readyState === 1"), "its newest socket is open")
    shown.until(lambda: shown.page.locator(".play").is_enabled(), "it is connected")
    return seen
