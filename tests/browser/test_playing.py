"""While a run plays: picture, caption, counter, readings and the figures of the plots are of one frame."""

from collections.abc import Iterator
from typing import Any

import pytest

from tests.browser.host import Server
from tests.browser.views import SessionPage

# What the page says of the frame that is shown, at each frame of the display, until the run stands again.
WATCH = """() => new Promise((resolve) => {
    const seen = [];
    const text = (selector) => document.querySelector(selector).textContent;
    const look = () => {
        const painted = document.querySelector('.flat-canvas').dataset.frame;
        const [caption, counter] = [text('.flat-caption'), text('.counter')].map((words) => words.split(' ')[1]);
        const error = [...document.querySelectorAll('.readout > dl dt')].find((it) => it.textContent === 'error');
        const plotted = `${text('[data-plot=error] output')} px`;
        seen.push([painted, caption, counter, error.nextSibling.textContent, plotted]);
        if (text('.play') === 'Pause') requestAnimationFrame(look);
        else resolve(seen);
    };
    requestAnimationFrame(look);
})"""


MOST_AHEAD = 2
"""Moments in which numbers may be seen before their picture: between two drawings of one frame of the display. Those
that do not wait are ahead in ten and more; `tests/pages/store.test.js` holds each step of the waiting."""


@pytest.fixture
def page(chromium: Any, server: Server) -> Iterator[Any]:
    """A page whose display goes as fast as it does for people."""
    context = chromium.new_context(viewport={"width": 1280, "height": 800}, base_url=f"{server.url}/")
    context.add_init_script("localStorage['pftrack-view'] = 'flat'")
    yield context.new_page()
    context.close()
    server.end_sessions()


def test_all_that_is_said_is_of_the_frame_that_is_seen(page: Any, server: Server) -> None:
    """Pictures come later than numbers, and fewer of them: the numbers wait for theirs, when it is replayed as well.

    Both have connections of their own. Where the machine is so busy that a picture is there first, its numbers follow.
    """
    page.goto(server.start_session(frames=45)["page"])
    shown = SessionPage(page, server).ready()
    ahead = 0
    for _ in ("computed", "replayed"):
        shown.press("Home")
        shown.stands_at(0)
        shown.press(" ")
        page.locator(".play", has_text="Pause").wait_for()
        seen = page.evaluate(WATCH)
        errors = server.column(shown.id, "error")
        playing = [each for each in seen[:-1] if int(each[0]) < 44]
        assert len({each[0] for each in playing}) > 5
        agree = 0
        for painted, caption, counter, error, plotted in playing:
            said = f"{errors[int(painted)]:.1f} px"
            assert caption == painted
            ahead += int(counter) > int(painted)
            agree += (counter, error, plotted) == (painted, said, said)
        assert agree > len(playing) / 2
    assert ahead <= MOST_AHEAD
