"""Axe finds nothing that keeps people from using the pages, in the light and in the dark; and nothing is cut off."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.accessible import check, fits
from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage, View

Watch = Callable[..., SessionPage]


def test_the_start_page(gallery: Gallery) -> None:
    """Cards, the offer of the tour and the place for a video; the menu of a phone."""
    gallery.card("sine").wait_for()
    check(gallery.page)
    fits(gallery.page)
    gallery.page.get_by_role("button", name="All parts").click()
    gallery.page.get_by_role("link", name="My work").wait_for()
    check(gallery.page)


NOTHING = "0123456789abcdef"
PLAIN_PAGES = [
    *(
        "work",
        "references",
        "glossary",
        "failures",
        "failures/look-alike-capture",
        "failures/of-my-own",
        "compare",
        "sweep/new",
        "lectures",
    ),
    *(f"sweep/{NOTHING}", f"sweep/{NOTHING}/run/0", f"session/{NOTHING}", f"lectures/{NOTHING}"),
    *("docs", "help", "help/start.html"),
]
"""The pages that show something without a session; start, session and lessons have tests of their own."""


@pytest.mark.parametrize("path", PLAIN_PAGES)
def test_a_page_that_needs_nothing(page: Any, path: str, complaints: Any) -> None:
    """Each page as it is at first, and what is said where there is nothing."""
    complaints.expected = ("404",)
    page.goto(path)
    page.locator("main :is(section, form, .notice, h1)").first.wait_for()
    check(page)
    fits(page)


def test_a_session_in_the_flat_view(watch: Watch, server: Server) -> None:
    """With its plots, its panel unfolded, a note of the tour, the help and a menu; also presented."""
    shown = watch(seed=0, parameters={"sample_count": 40})
    page = shown.page
    shown.until(lambda: shown.lines, "the plots are drawn")
    assert page.locator(".plots").get_attribute("tabindex") == "0", "it scrolls sooner or later"
    page.locator(".controls").get_by_text("More", exact=True).click()
    check(page)
    shown.press("?")
    page.locator("dialog [data-role=tour]").wait_for()
    check(page)
    shown.press("Escape")
    page.locator("dialog").wait_for(state="detached")
    shown.press("f")
    page.get_by_role("button", name="Leave the presentation").wait_for()
    check(page)
    shown.press("f")
    page.goto(f"{page.url}?tour=few")
    page.locator(".callout").wait_for()
    check(page)
    shown.press("Escape")
    fits(page)


def test_the_course_and_a_lesson(page: Any) -> None:
    """All lessons, and one of them with its figure and its question; also presented."""
    page.goto("learn")
    page.locator(".lesson-card").first.wait_for()
    check(page)
    fits(page)
    page.set_viewport_size({"width": 1280, "height": 800})
    page.goto("learn/bayes")
    page.get_by_role("button", name="Show", exact=True).wait_for()
    check(page)
    page.keyboard.press("f")
    page.get_by_role("button", name="Leave the presentation").wait_for()
    check(page)
    View(page).until(lambda: page.evaluate("document.documentElement.scrollHeight <= innerHeight"), "nothing scrolls")
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Present in large type").wait_for()
    fits(page)
