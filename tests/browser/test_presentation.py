"""Presenting belongs to the tab, fits a low screen and ends with Escape; on paper pages are light and whole."""

import re
from contextlib import suppress
from typing import Any

import pytest

from tests.browser.conftest import Watch
from tests.browser.host import Server
from tests.browser.test_compare import ComparePage, ball, link
from tests.browser.test_sweep import SMALL, SweepPage
from tests.browser.views import View

PRESENTS = "document.documentElement.dataset.presenting !== undefined"
WHOLE = "document.fullscreenElement !== null"


def test_the_next_page_goes_on_presenting(watch: Watch) -> None:
    """A preset, the next lesson and a list of failures are presented as the page before; Escape ends it everywhere."""
    shown = watch()
    page = shown.page
    shown.press("f")
    shown.until(lambda: page.evaluate(WHOLE), "the session has the whole screen")
    shown.choose_preset()
    assert page.evaluate(PRESENTS), "a preset continues"

    page.goto("learn/1")
    page.get_by_role("link", name="Next lesson").click()
    shown.until(lambda: page.inner_text("h1").startswith("2 "), "it is the next lesson")
    page.get_by_role("button", name="Leave the presentation").wait_for()
    shown.press("Shift")
    shown.until(lambda: page.evaluate(WHOLE), "the next key gives it the whole screen again")
    page.goto("work")
    page.locator(".places").wait_for()
    assert not page.evaluate(PRESENTS), "a page without a button for it is shown as ever"
    page.goto("failures")
    page.get_by_role("button", name="Leave the presentation").wait_for()
    shown.press("Escape")
    page.goto("learn/1")
    page.get_by_role("button", name="Present in large type").wait_for()
    assert not page.evaluate(PRESENTS), "Escape has ended it everywhere"
    page.evaluate("window.changes = 0; addEventListener('fullscreenchange', () => (window.changes += 1))")
    for _ in range(2):  # without a wait for the browser in between
        shown.press("f")
    shown.until(lambda: page.evaluate("changes") == 2, "the whole screen was taken and given back")
    assert not page.evaluate(WHOLE)


@pytest.fixture
def low(page: Any) -> Any:
    """A page of 1280 x 720, as Full HD is at 150 %, without the whole screen, which the page does not decide."""
    page.add_init_script("Element.prototype.requestFullscreen = null")
    page.set_viewport_size({"width": 1280, "height": 720})
    return page


def fits_presented(page: Any, what: str) -> None:
    """Present the page: all of it is in sight and large."""
    page.get_by_role("button", name="Present in large type").click()
    page.get_by_role("button", name="Leave the presentation").wait_for()
    with suppress(AssertionError):
        View(page).until(lambda: page.evaluate(FAULTS, LEAST_PX) == [], f"{what} fits", 10.0)
    assert page.evaluate(FAULTS, LEAST_PX) == [], what
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Present in large type").wait_for()


HANDOUTS = {2, 9, 12}
"""Lessons with a map, with most panels, and with a session."""


@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_lessons_fit_a_sheet_and_a_low_screen(low: Any, *, every: bool) -> None:
    """On paper there are idea, figure before the answer, question with room for an answer, and lines for notes.

    Presented at 1280 x 720 no lesson scrolls, is cut or has small letters.
    """
    for number in range(1, 13) if every else HANDOUTS:
        low.goto(f"learn/{number}")
        low.locator(".figure-view[data-shown], .flat-canvas[data-frame]").first.wait_for()
        low.get_by_role("button", name="Skip").wait_for()
        View(low).until(lambda: low.locator(".flat-canvas:not([data-frame])").count() == 0, "all pictures are painted")
        if number in HANDOUTS:
            is_handout(low, f"lesson {number}")
            assert low.locator(".verdict-words").count() == 0
            fits_presented(low, f"lesson {number}")
        low.get_by_role("button", name="Skip").click()
        low.locator("[data-part=question]:not([data-stage=asked])").wait_for()
        fits_presented(low, f"lesson {number}, answered")


def judged(page: Any, runs: int) -> None:
    View(page).until(lambda: page.locator(".verdict:not(:empty)").count() == runs, "the frames of all runs are judged")


@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_sessions_and_failures_fit_a_low_screen(low: Any, watch: Watch, server: Server, *, every: bool) -> None:
    """A session with worlds and a failure beside its cure, which is a handout as well, have all their parts whole."""
    for entry in server.get("failures")[slice(0, 10) if every else slice(4, 5)]:
        failure = entry["id"]
        low.goto(f"failures/{failure}")
        low.locator(f".flat-canvas[data-frame='{entry['frame']}']").nth(1).wait_for()
        low.locator(".scrubber-rows li").first.wait_for()
        View(low).until(lambda: low.locator(".measured:not(:has(.bone))").count() == 2, "both outcomes are measured")
        judged(low, 2)
        is_handout(low, failure)
        fits_presented(low, failure)
    shown = watch(experiment="linkage", frames=12)
    shown.press("ArrowRight")
    shown.until(lambda: (shown.position or 0) > 0, "a frame is computed")
    low.locator(".figure-texts span").first.wait_for()
    for key in "ff":
        assert low.locator(".legend").evaluate(IS_WHOLE), "the legend is whole"
        shown.press(key)
    fits_presented(low, "a session")


IS_WHOLE = """(it) => it.scrollWidth <= it.clientWidth && it.scrollHeight <= it.clientHeight
    && it.clientHeight <= it.closest('.flat-line').clientHeight"""


def test_comparisons_and_sweeps_fit_a_low_screen(low: Any, server: Server) -> None:
    """So do a comparison of four runs, which is a handout as well, and the maps of a sweep."""
    sweep = server.post("sweeps", {**SMALL, "trials": 1, "frames": 10})["id"]
    low.goto(link(ball("apf"), ball("condensation"), ball(), ball("kalman")))
    ComparePage(low).ready(4)
    judged(low, 4)
    is_handout(low, "a comparison")
    fits_presented(low, "a comparison")
    low.goto(f"sweep/{sweep}")
    SweepPage(low).complete()
    low.locator(".map .figure-texts span").first.wait_for()
    fits_presented(low, "a sweep")


LEAST_PX = 16
"""Least size of letters at 720 lines."""
FAULTS = """(least) => {
    const found = new Set();
    const named = (it) => `${it.tagName}.${it.className} "${it.textContent.trim().slice(0, 40)}"`;
    const over = (it) => [it.scrollWidth - it.clientWidth > 1, it.scrollHeight - it.clientHeight > 1];
    const hides = (it, what = /hidden|clip/) => what.test(getComputedStyle(it).overflow);
    const around = (it) => it && it !== document.body ? [it, ...around(it.parentElement)] : [];
    const isApart = (one, other) => one.left >= other.right - 1 || one.right <= other.left + 1
        || one.top >= other.bottom - 1 || one.bottom <= other.top + 1;
    const root = document.documentElement;
    const screen = { left: 0, top: 0, right: innerWidth, bottom: innerHeight };
    const scrolls = /auto|scroll/;
    if (over(root).some(Boolean)) found.add('the page scrolls');
    for (const it of document.querySelectorAll('body *')) {
        if (!it.checkVisibility({ visibilityProperty: true, opacityProperty: true })) continue;
        if (it.closest('.visually-hidden, math, .figure-letter')) continue;
        const { display, fontSize, overflowX, overflowY, textOverflow, webkitLineClamp } = getComputedStyle(it);
        const [isWider, isHigher] = display === 'inline' || it.clientWidth < 2 ? [false, false] : over(it);
        const isMore = isWider && scrolls.test(overflowX) || isHigher && scrolls.test(overflowY);
        if (isMore) found.add(`scrolls ${named(it)}`);
        const isShort = isWider && textOverflow === 'ellipsis' || isHigher && webkitLineClamp !== 'none';
        const words = [...it.childNodes].filter((node) => node.nodeType === Node.TEXT_NODE && node.data.trim());
        for (const node of words) {
            const range = document.createRange();
            range.selectNodeContents(node);
            for (const box of range.getClientRects()) {
                const outer = around(it).map((other) => [other, other.getBoundingClientRect()]);
                if (box.width <= 1 || outer.some(([other, edge]) => hides(other) && isApart(box, edge))) continue;
                if (parseFloat(fontSize) < least) found.add(`of ${fontSize}: ${named(it)}`);
                if (isShort) found.add(`shortened: ${named(it)}`);
                const spare = box.height / 4; // above and below the letters
                for (const [other, edge] of [[root, screen], ...outer]) {
                    if (other !== root && !hides(other, /hidden|clip|auto|scroll/)) continue;
                    const isCut = box.left < edge.left - 1 || box.right > edge.right + 1
                        || box.top < edge.top - spare || box.bottom > edge.bottom + spare;
                    if (isCut) found.add(`cut by ${other.tagName}.${other.className}: ${named(it)}`);
                }
            }
        }
    }
    return [...found];
}"""

# Each plot's room, its painted width, and its colour of letters.
PLOTS = """[...document.querySelectorAll(".figure-plot[data-left]")].map((plot) => {
    const painted = Math.round(plot.querySelector("canvas").width / devicePixelRatio);
    return { room: plot.clientWidth, painted, letters: getComputedStyle(plot).color };
}).filter(({ room }) => room > 0)"""
# Collects them while the page is laid out for paper.
ON_PAPER = f"""() => matchMedia("print").addEventListener("change", ({{ matches }}) => {{
    if (matches) window.onPaper = {PLOTS};
}})"""


def test_plots_fit_the_sheet_and_are_light_on_it(watch: Watch, page: Any) -> None:
    """On paper a plot's curves are as wide as its axes, and letters are dark, where the page is dark as well.

    On the screen all is as it was before.
    """
    page.emulate_media(color_scheme="dark")
    shown = watch(experiment="ball", frames=40)
    shown.until(lambda: page.evaluate(PLOTS) != [], "a plot is drawn")
    page.evaluate(ON_PAPER)
    for theme in ("", "dark"):
        page.evaluate("(theme) => (document.documentElement.dataset.theme = theme)", theme)
        before = page.evaluate(PLOTS)
        page.evaluate("window.onPaper = null")
        page.pdf()
        paper = page.evaluate("window.onPaper")
        assert paper
        assert all(abs(plot["painted"] - plot["room"]) <= 1 for plot in paper), paper
        assert {plot["letters"] for plot in paper} == {"rgb(22, 25, 29)"}
        assert {plot["room"] for plot in paper} != {plot["room"] for plot in before}, "it is as wide as the window"
        shown.until(lambda before=before: page.evaluate(PLOTS) == before, "all is as before")  # type: ignore[misc]
        assert "rgb(22, 25, 29)" not in {plot["letters"] for plot in before}


PAGE = re.compile(rb"/Type\s*/Page\b")
"""A page in a PDF file by Chromium."""
SHEET_PX = {"width": 680, "height": 1017}
"""A4 without its margins."""
SHRUNK = """() => matchMedia("print").addEventListener("change", ({ matches }) => {
    if (matches) window.sheetWidth = document.documentElement.clientWidth;
})"""
"""Has a page remember its width of the sheet, px: more than the sheet has where the browser shrinks it."""
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
    """Assert that a page is a handout of one or two sheets: light, with whole figures, and nothing to press."""
    page.evaluate(SHRUNK)
    sheets = len(PAGE.findall(page.pdf(prefer_css_page_size=True)))
    assert sheets in {1, 2}, f"{what} is printed on {sheets} sheets"
    assert page.evaluate("window.sheetWidth") <= SHEET_PX["width"] + 2, f"{what} is shrunk to fit the sheet"
    before = page.viewport_size
    page.emulate_media(media="print", color_scheme="dark")
    page.set_viewport_size(SHEET_PX)
    found = page.evaluate(ON_SHEET)
    assert found.pop("pictures") > 0, what
    assert found.pop("wide") <= 0, what
    looks = {"ground": "rgba(0, 0, 0, 0)", "letters": "rgb(22, 25, 29)", "notes": '"Notes"'}
    assert found == {"controls": [], "torn": 0, **looks}, what
    page.emulate_media(media="null", color_scheme="light")
    page.set_viewport_size(before)


def test_a_scene_in_space_is_printed_as_a_picture(page: Any) -> None:
    """WebGL is not printed: the library's picture is fetched first, and printed in its place."""
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
