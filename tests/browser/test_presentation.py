"""Presenting belongs to the tab: it goes on over pages, and Escape ends it on any of them."""

from collections.abc import Callable
from typing import Any

from tests.browser.views import SessionPage, View

PRESENTS = "document.documentElement.dataset.presenting !== undefined"
WHOLE = "document.fullscreenElement !== null"


def test_the_next_page_goes_on_presenting(watch: Callable[..., SessionPage]) -> None:
    """A preset, a lesson, the next one and a failure are presented as the page before; ended once, it stays ended."""
    shown = watch()
    page = shown.page
    shown.press("f")
    shown.until(lambda: page.evaluate(WHOLE), "the session has the whole screen")
    before = shown.id
    shown.press("p")
    page.locator("[data-preset]").last.click()
    shown.until(lambda: shown.id not in {before, "new"}, "another session is open")
    shown.ready()
    assert page.evaluate(PRESENTS), "a preset goes on"

    page.goto("learn/1")
    page.get_by_role("link", name="Next lesson").click()
    shown.until(lambda: page.inner_text("h1").startswith("2 "), "it is the next lesson")
    page.get_by_role("button", name="Leave the presentation").wait_for()
    shown.press("Shift")
    shown.until(lambda: page.evaluate(WHOLE), "the next key gives it the whole screen again")
    page.goto("work")
    page.locator(".places").wait_for()
    assert not page.evaluate(PRESENTS), "a page that has no button for it is shown as ever"
    page.goto("failures")
    page.get_by_role("button", name="Leave the presentation").wait_for()

    page.goto("work")
    page.locator(".places").wait_for()
    shown.press("Escape")
    page.goto("learn/1")
    page.get_by_role("button", name="Present in large type").wait_for()
    assert not page.evaluate(PRESENTS), "Escape has ended it everywhere"


def test_a_lesson_fits_a_low_screen(page: Any) -> None:
    """Presented at 1280 x 720, neither the page of a lesson with three panels scrolls, nor its idea."""
    page.set_viewport_size({"width": 1280, "height": 720})
    page.goto("learn/9")
    page.locator(".figure-view[data-shown]").wait_for()
    page.keyboard.press("f")
    page.get_by_role("button", name="Leave the presentation").wait_for()
    fits = "['html', '.lesson-text'].every((it) => (it = document.querySelector(it)).scrollHeight <= it.clientHeight)"
    View(page).until(lambda: page.evaluate(fits), "all of it is in sight", 20.0)
    page.keyboard.press("Escape")
