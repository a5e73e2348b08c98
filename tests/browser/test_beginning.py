"""The beginning: a new run is seen at once, long before the scene that it is watched in has been loaded."""

import re
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from tests.browser.host import Server
from tests.browser.views import PARTICLES, Gallery, SessionPage

VERSIONED = re.compile(r"^.*/static/version/\w+/")
PAGES = Path(__file__).parents[2] / "frontend_static"

PLACES = "[...document.querySelectorAll('.plots, .deck')].map((it) => it.getBoundingClientRect().toJSON())"
NAMED = "[...document.querySelectorAll('link[rel=modulepreload]')].map((it) => new URL(it.href).pathname)"

# Where the picture lies in the page, by the library's drawing and by the scene: [left, top, width, height].
STILL = """(() => {
    const image = document.querySelector('.scene-still img');
    if (!image?.naturalWidth) return null;
    const box = image.getBoundingClientRect();
    const scale = Math.min(box.width / image.naturalWidth, box.height / image.naturalHeight);
    const [width, height] = [image.naturalWidth * scale, image.naturalHeight * scale];
    return [box.x + (box.width - width) / 2, box.y + (box.height - height) / 2, width, height];
})()"""


class Held(list[Any]):
    """What the scene has asked for and is not given until it is released."""

    free = False

    def take(self, route: Any) -> None:
        if self.free:
            route.continue_()
        else:
            self.append(route)

    def release(self) -> None:
        self.free = True
        for route in self:
            route.continue_()


@pytest.fixture
def held(page: Any) -> Held:
    """Hold the scene back; what was asked for lies in the list and can go on from there."""
    waiting = Held()
    page.route("**/viz/**", lambda route: waiting.take(route))  # noqa: PLW0108 - Playwright marks what it calls
    return waiting


def still(page: Any) -> Any:
    return page.evaluate(STILL)


# In the scene, drawn in software; test_lesson.py and test_behind_proxy.py open it.
@pytest.mark.slow
@pytest.mark.scene
def test_the_run_is_seen_and_plays_before_the_scene_is_there(gallery: Gallery, held: Held, server: Server) -> None:
    """A click in the gallery shows the library's own picture, which goes on with the run, and the plots beside it.

    The scene takes over; what the page imports is named in it.
    """
    page = gallery.page
    gallery.card("ball").locator("h4 a").click()
    gallery.until(lambda: still(page), "the run's picture is in the scene's place")
    first = page.evaluate("document.querySelector('.scene-still img').src")
    gallery.until(lambda: page.evaluate("document.querySelector('.scene-still img').src") != first, "it goes on")
    shown = SessionPage(page, server)
    gallery.until(lambda: (shown.position or 0) > 5, "the run plays")
    gallery.until(lambda: held, "the scene was asked for")
    assert not page.locator(".skeleton-scene").is_visible()
    gallery.until(lambda: any(name.startswith("error") for name in shown.lines), "the plots are drawn meanwhile")
    page.locator(".play").click()
    gallery.until(lambda: not shown.session["playing"], "it pauses")
    the_scene_takes_over(shown, held)
    assert shown.in_scene(PARTICLES, 0) > 0


def the_scene_takes_over(shown: SessionPage, held: Held) -> None:
    """Release it, and see that nothing moves."""
    page = shown.page
    places = page.evaluate(PLACES)
    held.release()
    page.locator(".scene-still").wait_for(state="detached")
    assert shown.in_scene("pftrackScene.drawn()", None) == "in place"
    assert shown.in_scene("getComputedStyle(document.querySelector('canvas[data-engine]')).opacity", "0") == "1"
    if page.viewport_size["width"] > 500:
        shown.until(lambda: shown.lines, "the plots are drawn")
    again = page.evaluate(PLACES)
    assert again == places
    loads_what_it_names(page)


def loads_what_it_names(page: Any) -> None:
    """What the page imports is named in it as it is served, so that no import is found only in another one."""
    loaded = page.evaluate("performance.getEntriesByType('resource').map((it) => new URL(it.name).pathname)")
    used, named = ({VERSIONED.sub("", path) for path in paths} for paths in (loaded, page.evaluate(NAMED)))
    modules = {path.relative_to(PAGES).as_posix() for path in PAGES.rglob("*.js")}
    assert used & modules - {"shared/apply_theme.js"} == named


def test_the_gallery_fetches_ahead(gallery: Gallery) -> None:
    """Script of the session's page is there before somebody clicks, and is not asked for again afterwards."""
    page = gallery.page
    ahead = "[...document.querySelectorAll('link[rel=prefetch]')].map((it) => it.href)"
    here = "performance.getEntriesByType('resource').filter((it) => it.responseEnd > 0).map((it) => it.name)"

    def fetched() -> set[str]:
        return {VERSIONED.sub("", urlsplit(address).path) for address in page.evaluate(ahead)}

    gallery.until(lambda: "session/session_start.js" in fetched(), "the page's first module is fetched")
    gallery.until(lambda: set(page.evaluate(ahead)) <= set(page.evaluate(here)), "all of them have come")
    gallery.card("ball").locator("h4 a").click(no_wait_after=True)
    page.wait_for_url("**/session/*")
    sent = "performance.getEntriesByType('resource').filter((it) => it.transferSize > 0).map((it) => it.name)"
    again = {VERSIONED.sub("", urlsplit(address).path) for address in page.evaluate(sent)}
    assert not {path for path in again if path.endswith(".js")}
