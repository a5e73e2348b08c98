"""Pages on paper: figures are painted for the sheet's width, in the colours of the light theme."""

from collections.abc import Callable
from typing import Any

from tests.browser.views import SessionPage

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
