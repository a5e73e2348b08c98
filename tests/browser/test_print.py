"""Pages on paper: light, painted for the sheet's width, and handouts of lessons, failures and comparisons."""

import re
from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.host import Server
from tests.browser.test_compare import ComparePage, ball, link
from tests.browser.views import SessionPage, View

Watch = Callable[..., SessionPage]
# Asked while the page is laid out for paper, after the figures have heard of it: each plot's room, what it was painted
# for, and the colour of letters there.
ON_PAPER = """() => {
    window.onPaper = [];
    matchMedia("print").addEventListener("change", ({ matches }) => {
        if (!matches) return;
        for (const plot of document.querySelectorAll(".figure-plot")) {
            const canvas = plot.querySelector("canvas");
            const [room, painted] = [plot.clientWidth, Math.round(canvas.width / devicePixelRatio)];
            const letters = getComputedStyle(plot).color;
            if (room > 0 && plot.dataset.left) window.onPaper.push({ room, painted, letters });
        }
    });
}"""
SIZES = """[...document.querySelectorAll(".figure-plot[data-left]")].map((plot) =>
    [plot.clientWidth, Math.round(plot.querySelector("canvas").width / devicePixelRatio)])"""
LETTERS = "getComputedStyle(document.querySelector('.figure-plot')).color"


def test_plots_fit_the_sheet_and_are_light_on_it(watch: Watch, page: Any) -> None:
    """On paper a plot's curves are as wide as its axes, and letters are dark; on the screen all is as it was before.

    So it is where the system is dark, and where somebody has chosen that.
    """
    page.emulate_media(color_scheme="dark")
    shown = watch(experiment="ball", frames=40)
    shown.until(lambda: page.evaluate(SIZES) != [], "a plot is drawn")
    page.evaluate(ON_PAPER)
    printed(shown, page)
    page.evaluate("document.documentElement.dataset.theme = 'dark'")
    printed(shown, page)


def printed(shown: SessionPage, page: Any) -> None:
    before, light = page.evaluate(SIZES), page.evaluate(LETTERS)
    page.evaluate("window.onPaper.length = 0")
    page.pdf()
    paper = page.evaluate("window.onPaper")
    assert paper
    assert all(abs(plot["painted"] - plot["room"]) <= 1 for plot in paper), paper
    assert {plot["letters"] for plot in paper} == {"rgb(22, 25, 29)"}
    assert {plot["room"] for plot in paper} != {room for room, _ in before}, "the sheet is as wide as the window"
    shown.until(lambda: page.evaluate(SIZES) == before, "the plots are as they were")
    assert page.evaluate(LETTERS) == light != "rgb(22, 25, 29)"


PAGE = re.compile(rb"/Type\s*/Page\b")
"""Of each page in a file that Chromium writes."""
SHEET_PX = {"width": 680, "height": 1017}
"""What the margins leave of A4."""
SHRUNK = """() => {
    window.paper = matchMedia("print");
    window.paper.addEventListener("change", ({ matches }) => {
        if (matches) window.sheetWidth = document.documentElement.clientWidth;
    });
}"""
"""Has a page remember how many px wide it takes the sheet to be: more than there are where the browser shrinks it."""
ON_SHEET = """() => {
    const seen = (it) => it.checkVisibility({ visibilityProperty: true });
    const controls = [...document.querySelectorAll('nav a, button, select, input[type=range], [popover], dialog')];
    const whole = [...document.querySelectorAll('.figure-view:not(.compact), .flat-canvas')].filter(seen);
    const kept = (it) => it && (getComputedStyle(it).breakInside === 'avoid' || kept(it.parentElement));
    return {
        controls: controls.filter((it) => seen(it) && !it.matches('.compared-head .chip')).map((it) => it.outerHTML),
        wide: document.documentElement.scrollWidth - innerWidth,
        torn: whole.filter((it) => it.offsetHeight < 60 || it.offsetHeight > innerHeight || !kept(it)).length,
        pictures: whole.length,
        ground: getComputedStyle(document.body).backgroundColor,
        letters: getComputedStyle(document.body).color,
        notes: getComputedStyle(document.querySelector('main'), '::after').content,
    };
}"""


def is_handout(page: Any, what: str) -> None:
    """Hold a page to being a handout of one or two sheets: light, its figures whole, and nothing there to press."""
    page.evaluate(SHRUNK)
    sheets = len(PAGE.findall(page.pdf(prefer_css_page_size=True)))
    assert sheets in {1, 2}, f"{what} is printed on {sheets} sheets"
    assert page.evaluate("window.sheetWidth") <= SHEET_PX["width"] + 2, f"{what} is shrunk to fit the sheet"
    before = page.viewport_size
    page.emulate_media(media="print", color_scheme="dark")
    page.set_viewport_size(SHEET_PX)
    found = page.evaluate(ON_SHEET)
    assert found["controls"] == [], what
    assert found["wide"] <= 0, what
    assert found["pictures"] > 0, what
    assert found["torn"] == 0, what
    assert found["ground"] == "rgba(0, 0, 0, 0)", what
    assert found["letters"] == "rgb(22, 25, 29)", what
    assert found["notes"] == '"Notes"', what
    page.emulate_media(media="null", color_scheme="light")
    page.set_viewport_size(before)


@pytest.mark.parametrize("numbers", [range(1, 7), range(7, 13)], ids=str)
def test_a_lesson_is_a_handout_without_its_answer(page: Any, numbers: range) -> None:
    """Idea, figure as it is before the answer, question with room for an answer, and lines for notes."""
    for number in numbers:
        page.goto(f"learn/{number}")
        page.locator(".figure-view[data-shown], .flat-canvas[data-frame]").first.wait_for()
        page.get_by_role("button", name="Skip").wait_for()
        is_handout(page, f"lesson {number}")
        assert page.locator(".verdict-words").count() == 0


@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_failure_is_a_handout(page: Any, server: Server, *, every: bool) -> None:
    """Each failure beside its cure, with what was measured; usually one of each experiment."""
    failures = {entry["id" if every else "experiment"]: entry["id"] for entry in server.get("failures")}
    for failure in failures.values():
        page.goto(f"failures/{failure}")
        page.locator(".failure-column:last-of-type .flat-canvas[data-frame]").wait_for()
        View(page).until(lambda: page.locator(".measured:not(:has(.bone))").count() == 2, "both are measured")
        is_handout(page, failure)


def test_a_comparison_is_a_handout(page: Any) -> None:
    """Two or four runs beside each other, with what differs and what came of them."""
    for runs in ([ball(), ball("condensation")], [ball("apf"), ball("condensation"), ball(), ball("kalman")]):
        page.goto("learn")
        page.goto(link(*runs))
        ComparePage(page).ready(len(runs))
        is_handout(page, f"a comparison of {len(runs)} runs")


def test_a_scene_in_space_is_printed_as_a_picture(page: Any) -> None:
    """Its graphics are not there for paper: the library's picture is fetched first, and printed in their place."""
    page.add_init_script("window.print = () => document.documentElement.setAttribute('data-printed', '')")
    page.goto(link(ball(), ball("condensation")))
    ComparePage(page).ready(2)
    page.get_by_role("button", name="3-D").click()
    page.locator(".scene-frame").nth(1).wait_for(state="attached")
    page.get_by_role("button", name="Print as a handout").click()
    page.locator("html[data-printed]").wait_for()
    page.emulate_media(media="print")
    pictures = page.locator(".scene-paper")
    assert pictures.count() == 2
    assert pictures.evaluate_all("(all) => all.every((it) => it.naturalWidth > 100 && it.offsetWidth > 100)")
    assert not page.locator(".scene-frame").first.is_visible()
    page.emulate_media(media="null")
