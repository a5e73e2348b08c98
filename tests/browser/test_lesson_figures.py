"""Lesson figures in a browser: every kind of trace where its numbers say, and everything a person can do there."""

from collections.abc import Iterator
from typing import Any, get_args

import numpy as np
import pytest

from pftrack.core.model.drawing import COLOURS, VIRIDIS
from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons import figure as model
from pftrack.teaching.lessons.figure import Figure, Panel
from tests.browser.accessible import check
from tests.browser.conftest import LINKS
from tests.browser.host import Server
from tests.browser.views import View


def figure_of(lesson: str) -> Figure:
    """Return the first figure of a lesson."""
    body = LESSONS[lesson].body
    return body.show(body.parameters, body.seed).figure


CURVES, PLANE, DENSITY = (figure_of(lesson) for lesson in ("bayes", "joint", "probability"))
PRIOR, _, POSTERIOR = CURVES.panels
(HEAT,) = (panel for panel in PLANE.panels if panel.id == "map")

BARE = f"""<head><title>Figures</title>{LINKS}</head>
<body><header class="visually-hidden"><h1>Lesson</h1><h2>Figures</h2></header>
<main style="height: 560px"></main></body>"""

START = """async (text) => {
    Object.assign(document.documentElement, { lang: 'en', innerHTML: text });
    const loaded = [...document.querySelectorAll('link')].map((link) => new Promise((done) => (link.onload = done)));
    const { FigureView } = await import('./static/shared/figure/figure.js');
    await Promise.all(loaded);
    const mean = { title: 'Measured', unit: 'm', minimum: -3, maximum: 3, step: 0.5 };
    const on = {
        turn: (name, value) => heard.push([name, value]),
        place: (...told) => heard.push(told),
        declared: (name) => (name === 'prior_mean' ? mean : undefined),
    };
    window.heard = [];
    window.figure = new FigureView(document.querySelector('main'), on, new AbortController().signal);
}"""

# The colours within 3 px of a place of a panel, given as shares of its box from the upper left.
AROUND = """([panel, across, down]) => {
    const plot = document.querySelector(`[data-panel=${panel}] .figure-plot`);
    const { left, top, width, height } = plot.dataset;
    const canvas = plot.querySelector('canvas');
    const scale = canvas.width / plot.clientWidth;
    const [x, y] = [Number(left) + across * width, Number(top) + down * height];
    const [left_, top_] = [Math.round((x - 3) * scale), Math.round((y - 3) * scale)];
    const { data } = canvas.getContext('2d').getImageData(left_, top_, 7, 7);
    return Array.from({ length: 49 }, (_, at) => [...data.subarray(4 * at, 4 * at + 4)]);
}"""

IS_PAINTED = """(id) => {
    const canvas = document.querySelector(`[data-panel=${id}] canvas:not(li canvas)`);
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    return data.some((value) => value > 0);
}"""

# Where a value of a panel lies in the window; shares as above.
PLACE = """([panel, across, down]) => {
    const plot = document.querySelector(`[data-panel=${panel}] .figure-plot`);
    const { left, top, width, height } = plot.dataset;
    const around = plot.getBoundingClientRect();
    return [around.left + Number(left) + across * width, around.top + Number(top) + down * height];
}"""


class FigurePage(View):
    """A page with only a figure."""

    def show(self, figure: Figure, *, locked: bool = False) -> None:
        """Show it; it is painted afterwards."""
        shown = figure.model_dump(mode="json")
        self.page.evaluate("([shown, locked]) => figure.show(shown, { locked })", [shown, locked])

    def has(self, panel: Panel, x: float, y: float, colour: tuple[int, ...], far: float = 40.0) -> bool:
        """Tell whether a colour is painted at a place of a panel."""
        pixels = np.array(self.page.evaluate(AROUND, [panel.id, *_shares(panel, x, y)]))
        return bool((np.linalg.norm(pixels - (*colour, 255), axis=1) < far).any())

    def place(self, panel: Panel, x: float, y: float) -> tuple[float, float]:
        """Return where a place of a panel is in the window."""
        left, top = self.page.evaluate(PLACE, [panel.id, *_shares(panel, x, y)])
        return left, top

    @property
    def heard(self) -> list[list[Any]]:
        """The calls of the figure since the last look."""
        return self.page.evaluate("heard.splice(0)")

    def handle(self, parameter: str) -> Any:
        return self.page.locator(f".figure-grip[data-parameter={parameter}]")


def _shares(panel: Panel, x: float, y: float) -> tuple[float, float]:
    across = (x - panel.x.low) / (panel.x.high - panel.x.low)
    up = (y - panel.y.low) / (panel.y.high - panel.y.low)
    return across, 1 - up


@pytest.fixture(scope="module")
def opened(chromium: Any, server: Server) -> Iterator[Any]:
    context = chromium.new_context(viewport={"width": 900, "height": 600}, base_url=f"{server.url}/", has_touch=True)
    page = context.new_page()
    page.route("**/favicon.ico", lambda route: route.fulfill(status=204))
    page.goto("healthz")
    yield page
    context.close()


@pytest.fixture
def figures(opened: Any) -> Iterator[FigurePage]:
    complaints: list[str] = []
    opened.on("pageerror", lambda error: complaints.append(str(error)))
    opened.set_viewport_size({"width": 900, "height": 600})
    opened.emulate_media(color_scheme="light")
    opened.mouse.move(0, 0)
    opened.evaluate(START, BARE)
    yield FigurePage(opened)
    assert complaints == []


def test_every_kind_of_trace_is_painted_and_described(figures: FigurePage) -> None:
    """The lessons' figures have all kinds; each panel's description has its title, words and traces."""
    seen = set()
    for figure in (DENSITY, PLANE, *(figure_of(name) for name in ("recursion", "importance", "resampling"))):
        figures.show(figure)
        for panel in figure.panels:
            label = figures.page.locator(f"[data-panel={panel.id}] [role=img]").get_attribute("aria-label")
            assert panel.title in label
            assert panel.words in label
            for trace in panel.traces:
                seen.add(trace.kind)
                assert f"({trace.kind})" in label or trace.title == ""
            assert figures.page.evaluate(IS_PAINTED, panel.id), panel.id
    assert seen == {trace.model_fields["kind"].default for trace in get_args(get_args(model.Trace)[0])}


def half_way_up(panel: Panel, place: int = 0) -> tuple[float, float]:
    """Return a point of a panel's curve."""
    curve = panel.traces[place]
    at = np.flatnonzero(np.array(curve.y) >= max(curve.y) / 2)[0]
    return curve.x[at], curve.y[at]


def test_colours_stand_where_the_numbers_are_and_follow_the_page(figures: FigurePage) -> None:
    """Curves and the darkest cell of a map are at their values; in the dark the truth is white.

    Letters grow with the page's, and in a narrow window panels stand below each other.
    """
    page = figures.page
    figures.show(CURVES)
    assert figures.has(PRIOR, *half_way_up(PRIOR), COLOURS["prediction"])
    assert figures.has(POSTERIOR, *half_way_up(POSTERIOR, 1), COLOURS["estimate"])
    assert not figures.has(POSTERIOR, -4, 0.45, COLOURS["estimate"])
    figures.show(DENSITY)
    (density,) = DENSITY.panels
    assert figures.has(density, *half_way_up(density), COLOURS["truth"])
    page.emulate_media(color_scheme="dark")
    figures.until(lambda: figures.has(density, *half_way_up(density), COLOURS["paper"]), "the truth is white")
    page.emulate_media(color_scheme="light")
    figures.show(PLANE)
    assert figures.has(HEAT, -3, 3, VIRIDIS[0])
    assert not figures.has(HEAT, 0, 0, VIRIDIS[0], 60)
    high = page.evaluate("document.querySelector('.figure-across').getBoundingClientRect().height")
    page.evaluate("document.documentElement.style.fontSize = '24px'")
    larger = "(high) => document.querySelector('.figure-across')?.getBoundingClientRect().height >= 1.4 * high"
    figures.until(lambda: page.evaluate(larger, high), "letters are larger")
    page.evaluate("document.documentElement.style.fontSize = ''")
    page.set_viewport_size({"width": 390, "height": 600})
    tops = "[...document.querySelectorAll('.figure-panel')].map((panel) => panel.getBoundingClientRect().top)"
    figures.until(lambda: len(set(page.evaluate(tops))) == len(PLANE.panels), "panels stand below each other")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_a_handle_is_moved_by_pointer_and_keys(figures: FigurePage) -> None:
    """Its values are those of its parameter; a dragged handle stays at the pointer, also beyond the panel.

    Arrows move it by a step, with shift by ten, home and end to its bounds; a locked handle stays.
    """
    figures.show(CURVES)
    handle = figures.handle("prior_mean")
    x, y = figures.place(PRIOR, 2, 0.35)
    mouse = figures.page.mouse
    mouse.move(x + 5, y)
    mouse.down()
    assert figures.heard == []
    goal, _ = figures.place(PRIOR, -0.5, 0.35)
    mouse.move(goal + 5, y)
    figures.until(lambda: handle.input_value() == "-0.5", "it is at the pointer")
    figures.show(CURVES)
    assert handle.input_value() == "-0.5"
    mouse.move(-300, 2 * y)
    figures.until(lambda: handle.input_value() == "-3", "it is at its lowest value")
    assert handle.get_attribute("aria-valuetext") == "−3.0 m"
    mouse.up()
    figures.show(CURVES)
    assert handle.input_value() == "2"
    heard = figures.heard
    assert (heard[-1], ["prior_mean", -0.5] in heard) == (["prior_mean", -3], True)
    assert all(value == round(2 * value) / 2 for _, value in heard)
    for key in ("ArrowRight", "ArrowDown", "Home", "Shift+ArrowUp", "End"):
        handle.press(key)
    assert [value for _, value in figures.heard] == [2.5, 2, -3, 2, 3]
    assert handle.get_attribute("aria-label") == "Measured"
    figures.show(CURVES, locked=True)
    handle.press("ArrowLeft")
    assert figures.heard == []
    assert handle.is_disabled()


def test_a_prediction_is_placed_and_compared_with_the_answer(figures: FigurePage) -> None:
    """Pointer, finger and keys place it while handles are locked; then both values have lines and words."""
    page = figures.page
    figures.show(CURVES)
    page.evaluate("figure.ask({ panel: 'prior', along: 'x' })")
    asked = page.get_by_role("slider", name="your prediction")
    assert asked.get_attribute("aria-valuetext") == "not placed yet"
    asked.press("Enter")
    assert figures.heard == [[5]]
    assert figures.handle("prior_mean").is_disabled()
    page.mouse.click(*figures.place(PRIOR, -2, 0.3))
    ((x,),) = figures.heard
    assert x == pytest.approx(-2, abs=0.03)
    asked.press("ArrowRight")
    ((further,),) = figures.heard
    assert x < further <= x + 0.15
    page.touchscreen.tap(*figures.place(PRIOR, 3, 0.1))
    figures.until(lambda: asked.get_attribute("aria-valuetext") == "3.0 m", "it is at the finger")
    page.evaluate("figure.ask(null)")
    assert asked.count() == 0

    page.evaluate("figure.mark({ panel: 'prior', along: 'x', at: -1.2, exact: 0.8 })")
    for name, at, words in (("placed", -1.2, "your prediction −1.20 m"), ("exact", 0.8, "exactly 0.80 m")):
        line = page.locator(f".figure-mark.{name}")
        assert line.inner_text() == words
        assert line.bounding_box()["x"] == pytest.approx(figures.place(PRIOR, at, 0)[0], abs=1)
    label = page.locator("[data-panel=prior] [role=img]").get_attribute("aria-label")
    assert "your prediction −1.20 m, exactly 0.80 m" in label
    boxes = [flag.bounding_box() for flag in page.locator(".figure-mark .figure-flag").all()]
    assert boxes[0]["y"] + boxes[0]["height"] <= boxes[1]["y"]
    page.evaluate("figure.ask({ panel: 'posterior', along: 'x' })")
    page.evaluate("figure.mark({ panel: 'prior', along: 'y', at: 0.1, exact: 0.4 })")
    check(page)
    page.evaluate("figure.mark(null)")
    assert page.locator(".figure-mark").count() == 0


def test_pointing_names_a_value_and_new_data_move_nothing(figures: FigurePage) -> None:
    """A curve's value is shown, and nothing far from it; boxes and elements stay, and the key never covers data."""
    page = figures.page
    boxes = "[...document.querySelectorAll('.figure-plot')].map((plot) => ({ ...plot.dataset }))"
    figures.show(CURVES)
    tip = page.locator(".tooltip:visible")
    x, y = half_way_up(PRIOR)
    page.mouse.move(*figures.place(PRIOR, x, y))
    figures.until(lambda: "".join(tip.all_inner_texts()).startswith("prior p(x) · position "), "the value is shown")
    assert f"density {y:.3f} per m" in tip.inner_text()
    page.mouse.move(*figures.place(PRIOR, 14, 0.45))
    figures.until(lambda: tip.count() == 0, "nothing is shown")
    page.evaluate("window.first = document.querySelector('.figure-plot canvas')")
    before = page.evaluate(boxes)
    moved = POSTERIOR.model_copy(update={"traces": POSTERIOR.traces[:1]})
    figures.show(Figure(panels=(*CURVES.panels[:2], moved)))
    assert page.evaluate(boxes) == before
    assert page.evaluate("first === document.querySelector('.figure-plot canvas')")
    for panel in page.locator(".figure-panel").all():
        key, plot = (panel.locator(part).bounding_box() for part in (".figure-key", ".figure-plot"))
        assert key["y"] + key["height"] <= plot["y"] + 0.5
