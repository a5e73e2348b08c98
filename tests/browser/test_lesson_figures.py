"""Figures of lessons in a browser: every kind of trace where its numbers say, and all that a person can do there."""

from collections.abc import Iterator
from typing import Any, get_args

import numpy as np
import pytest

from pftrack.core.model.drawing import COLOURS, VIRIDIS
from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons import figure as model
from pftrack.teaching.lessons.figure import Axis, Curve, Figure, Handle, Panel
from tests.browser.accessible import check
from tests.browser.host import Server
from tests.browser.views import View

BARE = """<head><title>Figures</title><link rel="stylesheet" href="static/shared/palette.css">
<link rel="stylesheet" href="static/shared/style.css">
<link rel="stylesheet" href="static/shared/figure/figure.css"></head>
<body><header class="visually-hidden"><h1>Lesson</h1><h2>Figures</h2></header>
<main style="height: 560px"></main></body>"""

START = """async (text) => {
    Object.assign(document.documentElement, { lang: 'en', innerHTML: text });
    const loaded = [...document.querySelectorAll('link')].map((link) => new Promise((done) => (link.onload = done)));
    const { FigureView } = await import('./static/shared/figure/figure.js');
    await Promise.all(loaded);
    const z = { title: 'Measured', unit: 'm', minimum: -3, maximum: 3, step: 0.5 };
    const on = {
        turn: (name, value) => heard.push([name, value]),
        place: (...told) => heard.push(told),
        declared: (name) => (name === 'z' ? z : undefined),
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
    """A page with nothing but a figure."""

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
        """What the figure told since it was last asked."""
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


def test_every_kind_of_trace_is_painted_and_named(figures: FigurePage) -> None:
    """The figures of the course show all kinds; each panel says them, its words and its axes to who cannot see it."""
    seen = set()
    for name in ("probability", "joint", "recursion", "importance", "resampling"):
        body = LESSONS[name].body
        figure = body.show(body.parameters, body.seed).figure
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


def test_marks_stand_where_their_numbers_are(figures: FigurePage) -> None:
    """A curve's peak and the darkest cell of a map are found at their values."""
    figures.show(CURVES)
    assert figures.has(DENSITIES, 0.8, 0.798, COLOURS["estimate"])
    assert figures.has(DENSITIES, -1, 0.399, COLOURS["prediction"])
    assert not figures.has(DENSITIES, -3.3, 0.6, COLOURS["estimate"])
    figures.show(IN_PLANE)
    assert figures.has(HEAT, -2.8, 2.8, VIRIDIS[0])
    assert not figures.has(HEAT, 0.6, 0.1, VIRIDIS[0], 60)


def test_a_handle_is_dragged_and_follows_the_pointer_beyond_the_panel(figures: FigurePage) -> None:
    """Its values are those of its parameter; while it is held it stays there, then it stands where the figure says."""
    figures.show(CURVES)
    x, y = figures.place(DENSITIES, 1.5, 0.7)
    mouse = figures.page.mouse
    mouse.move(x + 5, y)
    mouse.down()
    assert figures.heard == []
    goal, _ = figures.place(DENSITIES, -0.5, 0.7)
    mouse.move(goal + 5, y)
    figures.until(lambda: figures.handle("z").input_value() == "-0.5", "it is at the pointer")
    figures.show(CURVES)
    assert figures.handle("z").input_value() == "-0.5"
    mouse.move(-300, 2 * y)
    figures.until(lambda: figures.handle("z").input_value() == "-3", "it is at its lowest value")
    assert figures.handle("z").get_attribute("aria-valuetext") == "−3.0 m"
    mouse.up()
    figures.show(CURVES)
    assert figures.handle("z").input_value() == "1.5"
    heard = figures.heard
    assert (heard[-1], ["z", -0.5] in heard) == (["z", -3], True)
    assert all(value == round(2 * value) / 2 for _, value in heard)


def test_a_handle_is_moved_by_keys(figures: FigurePage) -> None:
    """Arrows move by a step, with shift by ten, home and end to its bounds; a locked one stays."""
    figures.show(CURVES)
    handle = figures.handle("z")
    assert handle.get_attribute("aria-label") == "Measured"
    for key in ("ArrowRight", "ArrowDown", "Home", "Shift+ArrowUp", "End"):
        handle.press(key)
    assert figures.heard == [["z", 2], ["z", 1.5], ["z", -3], ["z", 2], ["z", 3]]
    figures.handle("height").press("ArrowUp")
    ((name, value),) = figures.heard
    assert (name, 0.25 < value < 0.26) == ("height", True)
    figures.show(CURVES, locked=True)
    handle.press("ArrowLeft")
    assert figures.heard == []
    assert handle.is_disabled()


def test_a_prediction_is_placed_by_pointer_finger_and_keys(figures: FigurePage) -> None:
    """Each place is told; it begins as not placed, and handles are locked meanwhile."""
    figures.show(CURVES)
    figures.page.evaluate("figure.ask({ panel: 'densities', along: 'x' })")
    asked = figures.page.get_by_role("slider", name="your prediction")
    assert asked.get_attribute("aria-valuetext") == "not placed yet"
    asked.press("Enter")
    ((middle,),) = figures.heard
    assert middle == 0
    assert figures.handle("z").is_disabled()
    figures.page.mouse.click(*figures.place(DENSITIES, -2, 0.6))
    ((x,),) = figures.heard
    assert x == pytest.approx(-2, abs=0.03)
    asked.press("ArrowRight")
    ((further,),) = figures.heard
    assert x < further <= x + 0.06
    figures.page.touchscreen.tap(*figures.place(DENSITIES, 3, 0.2))
    figures.until(lambda: asked.get_attribute("aria-valuetext") == "3.00 m", "it is where the finger was")
    figures.page.evaluate("figure.ask(null)")
    assert asked.count() == 0


def test_what_was_placed_and_what_is_exact_stand_side_by_side(figures: FigurePage) -> None:
    """As lines with words at their values, and in the words of the panel; axe finds nothing in either colour."""
    figures.show(CURVES)
    figures.page.evaluate("figure.mark({ panel: 'densities', along: 'x', at: -1.2, exact: 0.84 })")
    for name, at, words in (("placed", -1.2, "your prediction −1.20 m"), ("exact", 0.84, "exactly 0.84 m")):
        line = figures.page.locator(f".figure-mark.{name}")
        assert line.inner_text() == words
        assert line.bounding_box()["x"] == pytest.approx(figures.place(DENSITIES, at, 0)[0], abs=1)
    label = figures.page.locator("[data-panel=densities] [role=img]").get_attribute("aria-label")
    assert "your prediction −1.20 m, exactly 0.84 m" in label
    boxes = [flag.bounding_box() for flag in figures.page.locator(".figure-mark .figure-flag").all()]
    assert boxes[0]["y"] + boxes[0]["height"] <= boxes[1]["y"]
    figures.page.evaluate("figure.ask({ panel: 'stems', along: 'x' })")
    figures.page.evaluate("figure.mark({ panel: 'densities', along: 'y', at: 0.3, exact: 0.84 })")
    check(figures.page)
    figures.page.evaluate("figure.mark(null)")
    assert figures.page.locator(".figure-mark").count() == 0


def test_pointing_says_what_is_there(figures: FigurePage) -> None:
    """A curve says its value; away from everything nothing is said."""
    figures.show(CURVES)
    tip = figures.page.locator(".tooltip:visible")
    figures.page.mouse.move(*figures.place(DENSITIES, -1, 0.4))
    figures.until(lambda: "".join(tip.all_inner_texts()).startswith("prior · position −1.0"), "it says the value")
    assert "density 0.399 1/m" in tip.inner_text()
    figures.page.mouse.move(*figures.place(DENSITIES, -3, 0.9))
    figures.until(lambda: tip.count() == 0, "nothing is said")


def test_nothing_jumps_when_data_change(figures: FigurePage) -> None:
    """The boxes stay, the elements too, and the key never lies over data."""
    boxes = "[...document.querySelectorAll('.figure-plot')].map((plot) => ({ ...plot.dataset }))"
    figures.show(CURVES)
    figures.page.evaluate("window.first = document.querySelector('.figure-plot canvas')")
    before = figures.page.evaluate(boxes)
    moved = DENSITIES.model_copy(update={"traces": DENSITIES.traces[2:4]})
    figures.show(Figure(panels=(moved, *CURVES.panels[1:])))
    assert figures.page.evaluate(boxes) == before
    assert figures.page.evaluate("first === document.querySelector('.figure-plot canvas')")
    for panel in figures.page.locator(".figure-panel").all():
        key, plot = (panel.locator(part).bounding_box() for part in (".figure-key", ".figure-plot"))
        assert key["y"] + key["height"] <= plot["y"] + 0.5


def test_dark_large_and_narrow(figures: FigurePage) -> None:
    """Colours follow the page, letters its root, and in a narrow window panels stand below each other."""
    figures.show(IN_PLANE)
    page = figures.page
    assert figures.has(HEAT, -2, -1.6, COLOURS["truth"])
    page.emulate_media(color_scheme="dark")
    figures.until(lambda: figures.has(HEAT, -2, -1.6, COLOURS["paper"]), "what is exact is white")
    high = page.evaluate("document.querySelector('.figure-across').getBoundingClientRect().height")
    page.evaluate("document.documentElement.style.fontSize = '24px'")
    larger = "(high) => document.querySelector('.figure-across')?.getBoundingClientRect().height >= 1.4 * high"
    figures.until(lambda: page.evaluate(larger, high), "letters are larger")
    page.evaluate("document.documentElement.style.fontSize = ''")
    page.set_viewport_size({"width": 390, "height": 600})
    tops = "[...document.querySelectorAll('.figure-panel')].map((panel) => panel.getBoundingClientRect().top)"
    figures.until(lambda: len(set(page.evaluate(tops))) == 3, "panels stand below each other")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_it_leaves_nothing_behind(figures: FigurePage) -> None:
    """With its signal the figure goes, and its tooltip."""
    gone = figures.page.evaluate(
        """async (shown) => {
            const { FigureView } = await import('./static/shared/figure/figure.js');
            const [end, place] = [new AbortController(), document.createElement('div')];
            const before = document.querySelectorAll('.tooltip').length;
            document.querySelector('main').append(place);
            const other = new FigureView(place, { turn: () => {} }, end.signal);
            await other.show(shown, { locked: false });
            end.abort();
            await other.show(shown, { locked: false });
            return [place.childElementCount, document.querySelectorAll('.tooltip').length - before];
        }""",
        CURVES.model_dump(mode="json"),
    )
    assert gone == [0, 0]


RNG = np.random.default_rng(5)
X, DRAWN = np.linspace(-4.0, 4.0, 161), np.linspace(-2, 2, 16)


def _normal(x: np.ndarray, mean: float, sigma: float) -> np.ndarray:
    return np.asarray(np.exp(-(((x - mean) / sigma) ** 2) / 2) / (sigma * np.sqrt(2 * np.pi)))


BELOW = Axis(title="position", low=-4.0, high=4.0, unit="m")
DENSITIES = Panel(
    id="densities",
    title="Belief before and after",
    x=BELOW,
    y=Axis(title="density", low=0.0, high=1.0, unit="1/m"),
    traces=(
        model.Histogram(title="draws", ink="hidden", edges=np.linspace(-2, 2, 17), heights=_normal(DRAWN, 0, 0.8)),
        Curve(title="prior", ink="prediction", x=X, y=_normal(X, -1, 1), area=(-1.0, 1.0)),
        Curve(title="likelihood", ink="observation", x=X, y=_normal(X, 1.5, 0.6)),
        Curve(title="posterior", ink="estimate", x=X, y=_normal(X, 0.8, 0.5)),
        Curve(title="exact", ink="truth", x=X, y=_normal(X, 0.84, 0.5), dashed=True),
        model.Rule(title="mean", ink="estimate", at=0.8),
    ),
    handles=(Handle(parameter="z", at=1.5), Handle(parameter="height", at=0.25, along="y")),
    words="The posterior lies between prior and likelihood, with its mean at 0.8 m.",
)
STEMS = Panel(
    id="stems",
    title="Weights",
    x=BELOW,
    y=Axis(title="weight", low=0.0, high=1.0, hidden=True),
    traces=(model.Stems(title="draws", ink="second", x=RNG.normal(0, 1.2, 40), y=RNG.uniform(0.1, 0.9, 40)),),
    words="Forty draws of unequal weight.",
    row=1,
    share=(0.6, 1.0),
)
OVER = np.linspace(-3, 3, 61)
JOINT = _normal(OVER[:, None] - 0.8 * OVER, 0, 0.6) * _normal(OVER, 0, 1)
HEAT = Panel(
    id="heat",
    title="Over the plane",
    x=Axis(title="z", low=-3.0, high=3.0),
    y=Axis(title="x", low=-3.0, high=3.0),
    traces=(
        model.HeatMap(title="joint density", x=OVER, y=OVER, values=JOINT),
        Curve(title="mean", ink="truth", x=[-3, 3], y=[-2.4, 2.4]),
        model.Scatter(title="draws", ink="lost", x=RNG.normal(0, 1, 30), y=RNG.normal(0, 1, 30)),
    ),
    handles=(Handle(parameter="cut", at=1.2),),
    words="A ridge from the lower left to the upper right.",
)
CURVES, IN_PLANE = Figure(panels=(DENSITIES, STEMS)), Figure(panels=(HEAT, DENSITIES, STEMS))
