"""Axe finds nothing that keeps people from using the pages, in the light and in the dark; and nothing is cut off."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.accessible import check, fits
from tests.browser.host import Server, until
from tests.browser.test_sweep import SMALL
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


@pytest.mark.parametrize("path", ["references", "sweep/new", "sweep/0123456789abcdef", "session/0123456789abcdef"])
def test_a_page_that_needs_nothing(page: Any, path: str, complaints: Any) -> None:
    """References, the form of a sweep, and what is said where there is nothing."""
    complaints.expected = ("404",)
    page.goto(path)
    page.locator("main :is(section, form, .notice)").first.wait_for()
    check(page)
    fits(page)


def test_my_work(page: Any, server: Server) -> None:
    """A session, a saved run and empty lists."""
    server.post("runs", {"session": server.start_session()["id"]})
    page.goto("work")
    page.locator("[data-run]").first.wait_for()
    check(page)
    fits(page)


def test_a_session_in_the_flat_view(watch: Watch, server: Server) -> None:
    """With its plots, its panel unfolded, a note of the tour, the help and a menu; also presented."""
    shown = watch(seed=0, parameters={"sample_count": 40})
    page = shown.page
    shown.until(lambda: shown.lines, "the plots are drawn")
    page.locator(".controls").get_by_text("More parameters").click()
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


@pytest.mark.scene
def test_the_page_around_the_scene(watch: Watch) -> None:
    """What is ours of it; the frame has a name, and is no trap: the tab key leads through it and out of it again."""
    shown = watch()
    page = shown.page
    page.locator(".scene-still").wait_for(state="detached")
    check(page)
    page.locator("iframe").focus()
    inside = "document.activeElement.localName === 'iframe'"
    shown.until(lambda: page.evaluate(inside), "the scene has the focus")
    for _ in range(60):
        page.keyboard.press("Tab")
        if not page.evaluate(inside):
            return
    pytest.fail("sixty steps of the tab key stay within the scene")


def test_the_form_of_an_upload(gallery: Gallery) -> None:
    """With a picture on which the target is to be marked."""
    points = [[frame, point, 60 + frame, 40 + 10 * point] for frame in range(12) for point in range(4)]
    table = "\n".join(["frame,point,x,y", *(",".join(map(str, row)) for row in points)])
    gallery.choose("tracks.csv", table.encode(), "text/csv")
    gallery.page.locator(".target").wait_for()
    check(gallery.page)
    fits(gallery.page)


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


def test_a_sweep(page: Any, server: Server) -> None:
    """Its maps and the runs of a cell."""
    sweep = server.post("sweeps", {**SMALL, "trials": 1, "frames": 10})
    until(lambda: server.get(f"sweeps/{sweep['id']}")["state"] == "done", "the sweep is complete")
    page.goto(sweep["page"])
    View(page).until(lambda: page.locator(".map .figure-plot[data-left]").count() == 2, "the maps are drawn")
    check(page)
    fits(page)
