"""The flat view: the run from the front on a canvas, with its parameters beside it, for browsers without fast WebGL."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.conftest import Complaints
from tests.browser.host import Server
from tests.browser.views import PARTICLES, SessionPage

NO_WEBGL = """
const real = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
    return kind.startsWith('webgl') ? null : real.call(this, kind, ...more);
};"""
FAST_WEBGL = """
const real = WebGL2RenderingContext.prototype.getParameter;
WebGL2RenderingContext.prototype.getParameter = function (what) {
    const found = real.call(this, what);
    return typeof found === 'string' ? found.replace(/swiftshader/gi, 'A Fast Card') : found;
};"""
# How much of a row near the upper edge is the occluder's grey, in px of the picture, which is 320 px wide.
OCCLUDER = """(() => {
    const canvas = document.querySelector('.flat-canvas');
    if (!canvas?.dataset.frame) return -1;
    const { data } = canvas.getContext('2d').getImageData(0, Math.round(canvas.height / 40), canvas.width, 1);
    let width = 0;
    for (let x = 0; x < canvas.width; x += 1) if (Math.abs(data[4 * x] - 60) < 12) width += 1;
    return Math.round((width * 320) / canvas.width);
})()"""
# Pixels of the canvas in the blue of the observation's particles.
SKY = """(() => {
    const canvas = document.querySelector('.flat-canvas');
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 0; i < data.length; i += 4) {
        count += Math.abs(data[i] - 86) + Math.abs(data[i + 1] - 180) + Math.abs(data[i + 2] - 233) < 20 ? 1 : 0;
    }
    return count;
})()"""


SIZE = """(() => {
    const { width, height, offsetWidth } = document.querySelector('.flat-canvas');
    return [width, height, offsetWidth];
})()"""
# Share of its place that the canvas takes, in the direction in which it takes more.
FILLED = """(() => {
    const { width, height } = document.querySelector('.flat-canvas');
    const { clientWidth, clientHeight } = document.querySelector('.flat-place');
    return Math.max(width / clientWidth, height / clientHeight);
})()"""


class FlatPage(SessionPage):
    """The page of a session in the flat view."""

    def ready(self) -> "FlatPage":
        self.until(lambda: self.page.locator(".play").is_enabled(), "the play button can be pressed")
        self.until(lambda: self.painted is not None, "a frame is painted")
        self.page.locator(".controls [type=range]").first.wait_for(state="attached")
        return self

    @property
    def painted(self) -> int | None:
        """The frame on the canvas."""
        frame = self.page.evaluate("document.querySelector('.flat-canvas')?.dataset.frame ?? null")
        return None if frame is None else int(frame)

    @property
    def occluder(self) -> int:
        return int(self.page.evaluate(OCCLUDER))

    def paints(self, frame: int) -> None:
        self.until(lambda: self.painted == frame, f"frame {frame} is painted")

    def box(self, label: str) -> Any:
        """The box of a parameter."""
        return self.page.get_by_label(label, exact=True).and_(self.page.locator("[type=number], [type=checkbox]"))

    def slider(self, label: str) -> Any:
        return self.page.get_by_label(label, exact=True).and_(self.page.locator("[type=range]"))


Look = Callable[..., FlatPage]


@pytest.fixture
def look(unchosen: Any, server: Server) -> Look:
    """Start a session and open its page, which shows it flat by itself in this browser."""

    def opened(**recipe: Any) -> FlatPage:
        session = server.start_session(**recipe)
        unchosen.goto(session["page"])
        return FlatPage(unchosen, server).ready()

    return opened


def test_where_webgl_runs_in_software_the_view_is_flat(look: Look, server: Server) -> None:
    """The canvas shows each frame that the run reaches, and says in words what it shows; no scene is loaded.

    It keeps its proportions in any window, and its layers are switched on and off.
    """
    view = look(tracker="apf")
    layers_are_switched_on_and_off(view, server)
    the_canvas_keeps_its_proportions_in_any_window(view)
    view.page.set_viewport_size({"width": 1280, "height": 800})
    canvas = view.page.locator(".flat-canvas")
    assert view.page.locator("iframe").count() == 0
    server.seek(view.id, 12)
    view.paints(12)
    assert canvas.get_attribute("role") == "img"
    view.until(lambda: "frame 12 " in canvas.get_attribute("aria-label"), "it is told in words once the run stands")
    assert canvas.get_attribute("aria-label").endswith(view.page.inner_text(".flat-caption"))
    assert view.occluder == pytest.approx(40, abs=2)
    view.press("ArrowRight")
    view.paints(13)
    view.press("Space")
    view.until(lambda: (view.painted or 0) > 30, "the run plays on the canvas")


def the_canvas_keeps_its_proportions_in_any_window(view: FlatPage) -> None:
    """It is as large as its place allows, in pixels of the display, and stays sharp when the window changes.

    On a phone it has the width for itself; a button opens the parameters over it and closes them.
    """
    for width, height in ((1280, 800), (800, 700), (390, 800)):
        view.page.set_viewport_size({"width": width, "height": height})
        view.until(lambda: 0.99 < view.page.evaluate(FILLED) <= 1, "the canvas fills its place")
        wide, high, shown = view.page.evaluate(SIZE)
        assert wide / high == pytest.approx(320 / 240, abs=0.01)
        assert wide == shown
        assert view.page.evaluate("document.documentElement.scrollWidth") <= width

    slider = view.slider("Occluder width (px)")
    view.until(lambda: not slider.is_visible(), "the panel is away")
    opener = view.page.get_by_role("button", name="Parameters")
    opener.click()
    slider.wait_for()
    view.page.get_by_role("button", name="Close", exact=True).click()
    slider.wait_for(state="hidden")


def test_the_panel(look: Look, server: Server, complaints: Complaints) -> None:
    """All that its controls do, in one visit; the seed comes last, since it begins the run anew."""
    complaints.expected = ("the server responded with a status of 422",)
    view = look()
    a_slider_changes_the_picture(view)
    server.post(f"sessions/{view.id}/commands", {"kind": "pause"})
    what_is_half_typed_is_left_alone(view, server)
    a_refused_value_springs_back(view)
    what_others_change_is_shown(view, server)
    tracker_and_seed_can_be_chosen(view)


def a_slider_changes_the_picture(view: FlatPage) -> None:
    """Moved by the keyboard, a slider changes what is drawn from the next frame on, and the box beside it follows."""
    slider = view.slider("Occluder width (px)")
    slider.focus()
    for _ in range(5):
        view.page.keyboard.press("ArrowRight")
    view.until(lambda: view.session["parameters"]["occlusion_width_px"] == 45, "the session has the new value")
    view.until(lambda: view.box("Occluder width (px)").input_value() == "45", "the box has followed")
    view.page.keyboard.press("Space")
    view.until(lambda: view.occluder == pytest.approx(45, abs=2), "the wider occluder is seen")


def what_is_half_typed_is_left_alone(view: FlatPage, server: Server) -> None:
    """The session's word does not overwrite a number that is being typed; a box that is left empty shows it again."""
    box = view.box("Particles")
    box.fill("30")
    server.post(f"sessions/{view.id}/commands", {"kind": "change", "values": {"occlusion_width_px": 61}})
    view.until(lambda: view.slider("Occluder width (px)").input_value() == "61", "the change is shown")
    assert box.input_value() == "30"
    box.press("End")
    box.press("0")
    box.press("Enter")
    view.until(lambda: view.session["parameters"]["sample_count"] == 300, "the session has what was typed")
    box.fill("")
    box.press("Enter")
    view.until(lambda: box.input_value() == "300", "the box shows what is in force")


def a_refused_value_springs_back(view: FlatPage) -> None:
    """What is out of bounds is refused by the server in a sentence, and the control shows what is in force."""
    box = view.box("Particles")
    box.fill("100000000")
    box.press("Enter")
    view.page.locator(".toast.error").wait_for()
    assert "sample_count" in view.page.inner_text(".toast.error")
    view.until(lambda: box.input_value() == str(view.session["parameters"]["sample_count"]), "the box springs back")


def what_others_change_is_shown(view: FlatPage, server: Server) -> None:
    """A change from elsewhere moves slider, box and tracker, and takes away what that tracker does not read."""
    server.post(
        f"sessions/{view.id}/commands",
        {"kind": "change", "values": {"occlusion_width_px": 80, "tracker": "condensation"}},
    )
    view.until(lambda: view.slider("Occluder width (px)").input_value() == "80", "the slider shows it")
    view.until(
        lambda: view.page.get_by_label("Tracker", exact=True).input_value() == "condensation", "the tracker, too"
    )
    readers = {item["name"]: item for item in view.session["declarations"]}
    controls = {item["name"]: item["label"] for item in view.session["declarations"]}
    panel = view.page.locator(".control")  # a fold may be called as what is in it is, and files are in their own menu
    for name in (name for name in controls if readers[name]["kind"] != "file"):
        reads = not readers[name]["trackers"] or "condensation" in readers[name]["trackers"]
        assert (panel.get_by_label(controls[name], exact=True).count() > 0) == reads, name


def tracker_and_seed_can_be_chosen(view: FlatPage) -> None:
    """Another tracker counts from the next frame; another seed begins the run anew."""
    view.page.get_by_label("Tracker", exact=True).select_option("apf")
    view.until(lambda: view.session["tracker"] == "apf", "the session has the tracker")
    view.page.locator(".controls").get_by_text("More", exact=True).click()
    seed = view.box("Seed")
    seed.fill("77")
    seed.press("Enter")
    view.until(lambda: view.session["recipe"]["seed"] == 77, "the session has the seed")


def layers_are_switched_on_and_off(view: FlatPage, server: Server) -> None:
    """A layer that is switched off is gone at once, also while the run stands still."""
    server.seek(view.id, 5)
    view.paints(5)
    before = view.page.evaluate(SKY)
    view.page.locator(".controls").get_by_text("More", exact=True).click()
    view.page.get_by_text("What to draw").click()
    view.page.get_by_label("Particles by sampler").uncheck()
    view.until(lambda: view.page.evaluate(SKY) < before / 10, "the particles are gone")
    view.page.get_by_label("Particles by sampler").check()
    view.until(lambda: view.page.evaluate(SKY) == before, "they are back")


def test_a_slider_reaches_the_value_in_force(watch: Callable[..., SessionPage]) -> None:
    """Its useful range is 0 to 120, and the session has 300."""
    label = "Occluder width (px)"
    slider = watch(parameters={"occlusion_width_px": 300}).page.get_by_role("slider", name=label)
    assert [slider.get_attribute(name) for name in ("min", "max")] == ["0", "300"]
    assert slider.input_value() == "300"


def test_what_is_pointed_at_is_named(look: Look) -> None:
    """A feature of the face has its name under the pointer, in words; a press says it in the line below."""
    view = look(experiment="head")
    canvas = view.page.locator(".flat-canvas")
    nose = view.page.evaluate(
        """async (session) => {
            const { socketAddress } = await import('./static/shared/stream.js');
            const { decode } = await import('./static/session/flat/drawing.js');
            const socket = new WebSocket(`${socketAddress(`sessions/${session}/stream`)}?paints=true&has_picture=true`);
            socket.binaryType = 'arraybuffer';
            const drawing = await new Promise((done) => (socket.onmessage = ({ data }) => done(decode(data))));
            socket.close();
            const { point } = drawing.primitives.find(({ name }) => name === 'name nose');
            const scale = document.querySelector('.flat-canvas').offsetWidth / drawing.width;
            return { x: scale * (point[0] + 0.5) + 3, y: scale * (point[1] + 0.5) - 2 };
        }""",
        view.id,
    )
    caption = view.page.locator(".flat-caption")
    before = caption.inner_text()
    canvas.hover(position=nose)
    view.until(lambda: canvas.get_attribute("title") == "tip of the nose", "the name is under the pointer")
    canvas.click(position=nose)
    view.until(lambda: caption.inner_text() == "tip of the nose", "the line below says it")
    canvas.click(position={"x": 5, "y": 5})
    view.until(lambda: canvas.get_attribute("title") == "", "there is nothing under the pointer")
    view.until(lambda: caption.inner_text() == before, "the line below is about the frame again")


def test_the_choice_of_a_view_is_remembered(look: Look) -> None:
    """A press on 3-D shows the scene, here and after a reload; the address has the last word."""
    view = look()
    switch = view.page.get_by_role("group", name="View")
    switch.get_by_text("3-D").click()
    view.until(lambda: view.in_scene(PARTICLES, 0) > 0, "the scene is drawn")
    assert view.page.locator(".flat-canvas").count() == 0
    view.page.reload()
    view.page.locator(".scene iframe").wait_for(state="attached")
    assert switch.get_by_text("3-D").get_attribute("aria-pressed") == "true"
    view.page.goto(f"{view.page.url}?view=flat")
    view.ready()
    assert view.page.locator("iframe").count() == 0
    switch.get_by_text("3-D").click()
    view.until(lambda: "view=scene" in view.page.url, "the address says what is shown")
    switch.get_by_text("Flat").click()
    view.ready()


def test_without_webgl_there_is_no_scene_to_choose(unchosen: Any, server: Server) -> None:
    """A browser without 3-D graphics gets the flat view, and says why when the scene is asked for."""
    unchosen.add_init_script(NO_WEBGL)
    unchosen.goto(server.start_session()["page"])
    view = FlatPage(unchosen, server).ready()
    button = view.page.get_by_role("group", name="View").get_by_text("3-D")
    button.click()
    view.until(button.is_disabled, "the button cannot be pressed again")
    assert "no 3-D graphics" in button.get_attribute("title")
    view.press("ArrowRight")
    view.paints(1)


def test_with_a_graphics_card_there_is_the_scene(unchosen: Any, server: Server) -> None:
    """Where WebGL is fast the page shows the scene unless somebody has chosen otherwise."""
    unchosen.add_init_script(FAST_WEBGL)
    unchosen.goto(server.start_session()["page"])
    unchosen.locator(".scene iframe").wait_for(state="attached")
    assert unchosen.get_by_role("group", name="View").get_by_text("3-D").get_attribute("aria-pressed") == "true"


def test_a_killed_worker_is_reported_and_the_view_goes_on(look: Look, server: Server, complaints: Complaints) -> None:
    """The notice lies over the canvas; after Resume the same canvas shows the run where it was, and goes on."""
    view = look()
    server.seek(view.id, 30)
    view.paints(30)
    view.page.evaluate("document.querySelector('.flat-canvas').id = 'same'")
    complaints.expected = ("status of 503",)  # whatever the page was just asking of the worker
    server.kill_worker(view.id)
    notice = view.page.locator(".notice")
    notice.wait_for()
    assert "The tracker stopped" in notice.inner_text()
    play = view.page.locator(".play")
    view.until(play.is_disabled, "the play button cannot be pressed")
    notice.locator("button").click()
    view.until(play.is_enabled, "the play button can be pressed")
    notice.wait_for(state="hidden")
    view.press("ArrowRight")
    view.paints(31)
    assert view.page.locator("#same").count() == 1
