"""Presenting belongs to the tab: it goes on over pages, fits a low screen, and Escape ends it and restores all."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.host import Server
from tests.browser.presented import faults, places, settled_places
from tests.browser.test_compare import ComparePage, ball, link
from tests.browser.test_sweep import SMALL, SweepPage
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
    left_at_once_it_leaves_the_whole_screen(shown)


def left_at_once_it_leaves_the_whole_screen(shown: SessionPage) -> None:
    """F can be pressed twice without a wait for the browser in between."""
    shown.page.evaluate("""() => {
        window.changes = 0;
        document.addEventListener('fullscreenchange', () => (window.changes += 1));
    }""")
    shown.press("f")
    shown.press("f")
    shown.until(lambda: shown.page.evaluate("changes") == 2, "the whole screen was taken and given back")
    assert shown.page.evaluate("document.fullscreenElement === null")


@pytest.fixture
def low(page: Any) -> Any:
    """A page of 1280 x 720, as Full HD is at 150 %, without the whole screen, which is none of the page's affair."""
    page.add_init_script("Element.prototype.requestFullscreen = null")
    page.set_viewport_size({"width": 1280, "height": 720})
    return page


def fits_presented(page: Any, what: str) -> None:
    """Present the page that stands there: all of it is in sight and large; Escape puts everything where it was."""
    before = settled_places(page)
    page.get_by_role("button", name="Present in large type").click()
    page.get_by_role("button", name="Leave the presentation").wait_for()
    fits(page, f"{what}, presented")
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Present in large type").wait_for()
    holds(page, lambda: places(page), before, f"{what} is as it was before it was presented", 20.0)


def fits(page: Any, what: str) -> None:
    holds(page, lambda: faults(page), [], what, 10.0)


def holds(page: Any, look: Callable[[], list[str]], expected: list[str], what: str, seconds: float) -> None:
    """Wait until a look finds what is expected; if it is in vain, say what was found instead."""
    found: list[str] = []

    def is_found() -> bool:
        nonlocal found
        found = look()
        return found == expected

    try:
        View(page).until(is_found, what, seconds)
    except AssertionError:
        assert found == expected, what


@pytest.mark.parametrize("numbers", [range(1, 5), range(5, 9), range(9, 13)], ids=str)
def test_lessons_fit_a_low_screen(low: Any, numbers: range) -> None:
    """Presented at 1280 x 720 no lesson scrolls, is cut or has small letters, before its answer or after."""
    for number in numbers:
        low.goto(f"learn/{number}")
        low.locator(".figure-view[data-shown], .flat-canvas[data-frame]").first.wait_for()
        low.get_by_role("button", name="Skip").wait_for()
        View(low).until(lambda: low.locator(".flat-canvas:not([data-frame])").count() == 0, "all pictures are painted")
        fits_presented(low, f"lesson {number}")
        low.get_by_role("button", name="Skip").click()
        low.locator("[data-part=question]:not([data-stage=asked])").wait_for()
        low.get_by_role("button", name="Present in large type").click()
        fits(low, f"lesson {number}, presented, answered")
        low.keyboard.press("Escape")


@pytest.mark.parametrize("experiment", ["ball", "head", "linkage"])
def test_sessions_fit_a_low_screen(low: Any, watch: Callable[..., SessionPage], experiment: str) -> None:
    """Presented at 1280 x 720 a session has its picture, worlds, readings and as many plots as have room, all whole."""
    shown = watch(experiment=experiment, frames=12)
    shown.press("ArrowRight")
    shown.until(lambda: (shown.position or 0) > 0, "a frame is computed")
    low.locator(".figure-texts span").first.wait_for()
    fits_presented(low, experiment)


def judged(page: Any, runs: int) -> None:
    View(page).until(lambda: page.locator(".verdict:not(:empty)").count() == runs, "the frames of all runs are judged")


def test_failures_comparisons_and_sweeps_fit_a_low_screen(low: Any, server: Server) -> None:
    """So do a failure of each experiment that has any, comparisons of two runs and of four, and the maps of a sweep."""
    sweep = server.post("sweeps", SMALL)["id"]
    for entry in {entry["experiment"]: entry for entry in server.get("failures")}.values():
        failure = entry["id"]
        low.goto(f"failures/{failure}")
        low.locator(f".flat-canvas[data-frame='{entry['frame']}']").nth(1).wait_for()
        low.locator(".scrubber-rows li").first.wait_for()
        View(low).until(lambda: low.locator(".measured:not(:has(.bone))").count() == 2, "what came of both is measured")
        judged(low, 2)
        fits_presented(low, failure)
    for runs in ([ball(), ball("condensation")], [ball("apf"), ball("condensation"), ball(), ball("kalman")]):
        low.goto("learn")
        low.goto(link(*runs))
        ComparePage(low).ready(len(runs))
        judged(low, len(runs))
        fits_presented(low, f"a comparison of {len(runs)} runs")
    low.goto(f"sweep/{sweep}")
    SweepPage(low).complete()
    low.locator(".map .figure-texts span").first.wait_for()
    fits_presented(low, "a sweep")
