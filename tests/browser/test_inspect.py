"""Looking into the frame: what is pointed at is told and drawn, and a particle is followed."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.host import Server
from tests.browser.test_flat import FlatPage

# How many pixels of the canvas have the colour of what is looked at.
RING = """(() => {
    const canvas = document.querySelector('.flat-canvas');
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 0; i < data.length; i += 4) {
        count += Math.abs(data[i] - 204) + Math.abs(data[i + 1] - 121) + Math.abs(data[i + 2] - 167) < 20 ? 1 : 0;
    }
    return count;
})()"""


@pytest.fixture
def opened(unchosen: Any, server: Server) -> Callable[..., FlatPage]:
    """Start a session and open its page, flat."""

    def begin(**recipe: Any) -> FlatPage:
        session = server.start_session(**recipe)
        unchosen.goto(session["page"])
        return FlatPage(unchosen, server).ready()

    return begin


def test_what_is_pointed_at_is_told_and_drawn(opened: Callable[..., FlatPage], server: Server) -> None:
    """By pointer and by keys: a place with its likelihood, a particle with its path, which goes on with the run.

    The likelihood lies over the picture, and with the last look all of it is gone from the picture.
    """
    view = opened(tracker="condensation", seed=3)
    server.seek(view.id, 20)
    view.paints(20)
    assert view.page.evaluate(RING) == 0
    view.press("i")
    card = view.page.locator(".inspection-card")
    view.until(lambda: "colour of the pixel, estimate at" in card.inner_text(), "the estimate is told")
    assert not view.page.locator(".plots").is_visible()

    view.page.get_by_role("button", name="Place", exact=True).click()
    box = view.page.locator(".flat-canvas").bounding_box()
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 4
    view.page.mouse.move(*middle)
    # The picture is 320 px wide and 240 px high, and its origin is the centre of the first pixel.
    view.until(lambda: "place at 159.5, 59.5 px" in card.inner_text(), "the place is told")
    assert "-2.303" in card.inner_text()
    view.page.get_by_role("button", name="Move by keys").focus()
    view.press("ArrowRight")
    view.until(lambda: "place at 160.5, 59.5 px" in card.inner_text(), "an arrow moves by a pixel")
    assert view.painted == 20
    assert view.page.evaluate(RING) > 20

    view.press("Enter")
    view.until(lambda: "drawn by" in card.inner_text(), "the nearest particle is told")
    assert "of 800" in card.inner_text()
    assert "descend from" in view.page.locator(".inspection-genealogy").inner_text()
    view.page.check(".inspection-veil input")
    view.until(lambda: "log likelihood from -2.3, purple" in view.page.inner_text(".flat-caption"), "it has a scale")
    server.seek(view.id, 19)
    view.until(lambda: "followed back to frame 0" in card.inner_text() and view.painted == 19, "its ancestor is told")
    view.until(lambda: "in the next frame" in card.inner_text(), "its children are told")

    view.press("i")
    view.until(lambda: view.page.evaluate(RING) == 0, "nothing of it is drawn any more")
    assert "purple" not in view.page.inner_text(".flat-caption")
    assert view.page.locator(".plots").is_visible()
