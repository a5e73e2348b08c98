"""Axe finds nothing that keeps people from using the pages, in the light and in the dark; and words are explained."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.accessible import check, fits, usable
from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage, View

Watch = Callable[..., SessionPage]


def test_the_start_page(gallery: Gallery) -> None:
    """Cards, the offer of the tour and the place for a video; the menu of a phone."""
    gallery.card("sine").wait_for()
    usable(gallery.page)
    gallery.resize(390)
    gallery.page.get_by_role("button", name="All parts").click()
    gallery.page.get_by_role("link", name="My work").wait_for()
    check(gallery.page)


NOTHING = "0123456789abcdef"
PLAIN_PAGES = [
    *("work", "references", "failures/of-my-own", "compare", "sweep/new", "lectures"),
    *(f"sweep/{NOTHING}", f"sweep/{NOTHING}/run/0", f"session/{NOTHING}", f"lectures/{NOTHING}"),
    *("docs", "help", "help/start.html"),
]
"""Pages without a session; start, session, lessons, failures and glossary have tests of their own."""


@pytest.mark.parametrize("path", PLAIN_PAGES)
def test_a_page_that_needs_nothing(page: Any, path: str, complaints: Any) -> None:
    """Each page as it is at first, and what is said where there is nothing."""
    complaints.expected = ("404",)
    page.goto(path)
    page.locator("main :is(section, form, .notice, h1)").first.wait_for()
    usable(page)


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
    usable(page)
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


Watch = Callable[..., SessionPage]


def test_a_word_is_explained_by_pointer_keys_and_finger(watch: Watch, server: Server) -> None:
    """Readings, plots, parameters, measures, rows of the scrubber and the title have one way of it."""
    shown = watch(frames=30)
    page = shown.page
    shown.go_to(9)
    meaning = page.locator("#meaning")
    for place, word in (
        (".readout dt .term", "log evidence"),
        (".scrubber-rows .term", "P(lost)"),
        (".plots [data-panel=ess] .term", "ESS"),
    ):
        page.locator(place, has_text=word).first.hover()
        meaning.wait_for()
        said = meaning.inner_text()
        assert len(said) > 2 * len(word), said
        page.mouse.move(300, 300)
        meaning.wait_for(state="hidden")
    # Focus shows it, Escape puts it away and does nothing else.
    term = page.locator(".readout dt .term", has_text="sigma")
    term.focus()
    meaning.get_by_text("standard deviation of the estimate").wait_for()
    assert term.get_attribute("aria-describedby") == "meaning"
    check(page)
    page.keyboard.press("Escape")
    meaning.wait_for(state="hidden")
    # What stands in a head that unfolds, or in a label, explains and does no more.
    measures = page.locator(".measures")
    measures.locator(".leading .term").dispatch_event("click")
    meaning.get_by_text("Share of the labelled frames").wait_for()
    assert measures.locator("details[open]").count() == 0
    page.locator(".controls").get_by_text("Particles", exact=True).hover()
    shown.until(lambda: "particles" in meaning.inner_text().lower(), "a parameter is explained")


def test_the_glossary_is_a_page(page: Any) -> None:
    """What all share, and what each experiment declares; the keys of a session and the start page lead there."""
    page.goto("./")
    page.get_by_role("link", name="Glossary").click()
    page.get_by_role("region", name="Ball behind an occluder").get_by_text("gamma", exact=True).wait_for()
    assert "effective sample size" in page.get_by_role("region", name="What a tracker computes").inner_text()
    usable(page)
