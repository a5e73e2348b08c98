"""The flat view and what stands beside it: parameters, a look into the frame, and worlds seen from any side."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.conftest import Complaints, Watch
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
# Width of the occluder's grey in a row near the upper edge, in px of the picture, which has 320.
OCCLUDER = """(() => {
    const canvas = document.querySelector('.flat-canvas');
    if (!canvas?.dataset.frame) return -1;
    const { data } = canvas.getContext('2d').getImageData(0, Math.round(canvas.height / 40), canvas.width, 1);
    let width = 0;
    for (let x = 0; x < canvas.width; x += 1) if (Math.abs(data[4 * x] - 60) < 12) width += 1;
    return Math.round((width * 320) / canvas.width);
})()"""
# Pixels of the canvas that have a colour.
INKED = """(colour) => {
    const canvas = document.querySelector('.flat-canvas');
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    const [red, green, blue] = colour;
    let count = 0;
    for (let i = 0; i < data.length; i += 4) {
        if (Math.abs(data[i] - red) + Math.abs(data[i + 1] - green) + Math.abs(data[i + 2] - blue) < 20) count += 1;
    }
    return count;
}"""
SKY, RING = [86, 180, 233], [204, 121, 167]
"""The colours of the observation's particles, and of what is looked at."""
# Width and height of the canvas, its width on the page, and the larger share of its place that it takes.
SIZE = """(() => {
    const { width, height, offsetWidth } = document.querySelector('.flat-canvas');
    const { clientWidth, clientHeight } = document.querySelector('.flat-place');
    return [width, height, offsetWidth, Math.max(width / clientWidth, height / clientHeight)];
})()"""


def occluder(view: SessionPage) -> int:
    return int(view.page.evaluate(OCCLUDER))


def test_where_webgl_runs_in_software_the_view_is_flat(unchosen: Any, server: Server, complaints: Complaints) -> None:
    """The canvas shows each frame, fits any window, has layers and a panel, and outlives its worker.

    The choice of the 3-D view is kept over a reload; the address has the last word.
    """
    unchosen.goto(server.start_session(tracker="apf")["page"])
    view = SessionPage(unchosen, server).ready()
    canvas = unchosen.locator(".flat-canvas")
    server.seek(view.id, 12)
    view.paints(12)
    assert unchosen.locator("iframe").count() == 0
    assert canvas.get_attribute("role") == "img"
    view.until(lambda: "frame 12 " in canvas.get_attribute("aria-label"), "it is described once the run stands")
    assert canvas.get_attribute("aria-label").endswith(unchosen.inner_text(".flat-caption"))
    assert occluder(view) == pytest.approx(40, abs=2)
    # A hidden layer disappears at once, also while the run stands still.
    before = unchosen.evaluate(INKED, SKY)
    unchosen.locator(".controls").get_by_text("More", exact=True).click()
    unchosen.get_by_text("What to draw").click()
    layer = unchosen.get_by_label("Particles by sampler")
    layer.uncheck()
    view.until(lambda: unchosen.evaluate(INKED, SKY) < before / 10, "the particles are gone")
    layer.check()
    view.until(lambda: unchosen.evaluate(INKED, SKY) == before, "they are back")
    the_canvas_keeps_its_proportions_in_any_window(view)
    a_killed_worker_is_reported_and_the_canvas_stays(view, server, complaints)
    view.press("Space")
    view.until(lambda: (view.painted or 0) > 30, "the run plays on the canvas")
    view.press("Space")
    switch = unchosen.get_by_role("group", name="View")
    switch.get_by_text("3-D").click()
    view.until(lambda: view.in_scene(PARTICLES, 0) > 0, "the scene is drawn")
    assert canvas.count() == 0
    unchosen.reload()
    unchosen.locator(".scene iframe").wait_for(state="attached")
    assert switch.get_by_text("3-D").get_attribute("aria-pressed") == "true"
    unchosen.goto(f"{unchosen.url}?view=flat")
    view.ready()
    assert unchosen.locator("iframe").count() == 0
    switch.get_by_text("3-D").click()
    view.until(lambda: "view=scene" in unchosen.url, "the address has the view")


def the_canvas_keeps_its_proportions_in_any_window(view: SessionPage) -> None:
    """It fills its place in pixels of the display; on a phone a button opens and closes the parameters over it."""
    for width, height in ((1280, 800), (390, 800)):
        view.resize(width, height)
        view.until(lambda: 0.99 < view.page.evaluate(SIZE)[3] <= 1, "the canvas fills its place")
        wide, high, shown, _ = view.page.evaluate(SIZE)
        assert wide / high == pytest.approx(320 / 240, abs=0.01)
        assert wide == shown
        assert view.page.evaluate("document.documentElement.scrollWidth") <= width

    slider = view.control("Occluder width (px)", "range")
    view.until(lambda: not slider.is_visible(), "the panel is away")
    view.page.get_by_role("button", name="Parameters").click()
    slider.wait_for()
    view.page.get_by_role("button", name="Close", exact=True).click()
    slider.wait_for(state="hidden")
    view.resize(1280)


def a_killed_worker_is_reported_and_the_canvas_stays(view: SessionPage, server: Server, complaints: Complaints) -> None:
    """The notice lies over the canvas; after Resume the same canvas continues where it was."""
    view.page.evaluate("document.querySelector('.flat-canvas').id = 'same'")
    complaints.expected = ("status of 503",)  # of requests that the worker can no longer answer
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
    view.paints(13)
    assert view.page.locator("#same").count() == 1


def test_the_view_depends_on_the_browsers_graphics(unchosen: Any, server: Server) -> None:
    """The scene with fast WebGL; without WebGL the flat view, which gives the reason."""
    address = server.start_session()["page"]
    scene = unchosen.get_by_role("group", name="View").get_by_text("3-D")
    unchosen.add_init_script(f"{{{FAST_WEBGL}}}")
    unchosen.goto(address)
    unchosen.locator(".scene iframe").wait_for(state="attached")
    assert scene.get_attribute("aria-pressed") == "true"
    unchosen.add_init_script(f"{{{NO_WEBGL}}}")
    unchosen.goto(address)
    view = SessionPage(unchosen, server).ready()
    scene.click()
    view.until(scene.is_disabled, "the button cannot be pressed again")
    assert "no 3-D graphics" in scene.get_attribute("title")
    view.press("ArrowRight")
    view.paints(1)


def test_the_panel(watch: Watch, complaints: Complaints) -> None:
    """Its controls change the session, follow it, and refuse wrong values; the seed comes last: it restarts the run."""
    complaints.expected = ("the server responded with a status of 422",)
    view = watch()
    # A slider moved by the keyboard counts from the next frame on, and the box beside it follows.
    slider = view.control("Occluder width (px)", "range")
    slider.focus()
    for _ in range(5):
        view.page.keyboard.press("ArrowRight")
    view.until(lambda: view.session["parameters"]["occlusion_width_px"] == 45, "the session has the new value")
    view.until(lambda: view.control("Occluder width (px)").input_value() == "45", "the box has followed")
    view.page.keyboard.press("Space")
    view.until(lambda: occluder(view) == pytest.approx(45, abs=2), "the wider occluder is drawn")
    view.command("pause")
    # A half-typed number stays; an empty box shows the value in force; the server's refusal springs back.
    box = view.control("Particles")
    box.fill("30")
    view.change(occlusion_width_px=61)
    view.until(lambda: view.control("Occluder width (px)", "range").input_value() == "61", "the change is shown")
    assert box.input_value() == "30"
    box.press("End")
    box.press("0")
    box.press("Enter")
    view.until(lambda: view.session["parameters"]["sample_count"] == 300, "the session has the typed number")
    for typed in ("", "100000000"):
        box.fill(typed)
        box.press("Enter")
        view.until(lambda: box.input_value() == "300", "the box shows the value in force")
    view.page.locator(".toast.error").wait_for()
    assert "sample_count" in view.page.inner_text(".toast.error")
    # A change from elsewhere moves slider and tracker, and removes controls that the tracker does not read.
    view.change(occlusion_width_px=80, tracker="condensation")
    view.until(lambda: view.control("Occluder width (px)", "range").input_value() == "80", "the slider shows it")
    tracker = view.page.get_by_label("Tracker", exact=True)
    view.until(lambda: tracker.input_value() == "condensation", "the tracker is shown")
    panel = view.page.locator(".control")  # a fold may have the title of a control; files have their own menu
    for each in (each for each in view.session["declarations"] if each["kind"] != "file"):
        reads = not each["trackers"] or "condensation" in each["trackers"]
        assert (panel.get_by_label(each["label"], exact=True).count() > 0) == reads, each["name"]
    for value, most in ((80, "120"), (300, "300")):  # its useful range is 0 to 120
        view.change(occlusion_width_px=value)
        view.until(lambda value=value: slider.input_value() == str(value), "it shows the value")  # type: ignore[misc]
        assert [slider.get_attribute(name) for name in ("min", "max")] == ["0", most]
    view.page.get_by_label("Tracker", exact=True).select_option("apf")
    view.until(lambda: view.session["tracker"] == "apf", "the session has the tracker")
    view.page.locator(".controls").get_by_text("More", exact=True).click()
    view.control("Seed").fill("77")
    view.control("Seed").press("Enter")
    view.until(lambda: view.session["recipe"]["seed"] == 77, "the session has the seed")


def test_what_is_pointed_at_is_described_and_drawn(watch: Watch, server: Server) -> None:
    """By pointer and keys: a place with its likelihood, a particle with its path, which continues with the run.

    The likelihood lies over the picture; closing the card removes all of it.
    """
    view = watch(tracker="condensation", seed=3)
    server.seek(view.id, 20)
    view.paints(20)
    assert view.page.evaluate(INKED, RING) == 0
    view.press("i")
    card = view.page.locator(".inspection-card")
    view.until(lambda: "colour of the pixel, estimate at" in card.inner_text(), "the estimate is described")
    assert not view.page.locator(".plots").is_visible()

    view.page.get_by_role("button", name="Place", exact=True).click()
    box = view.page.locator(".flat-canvas").bounding_box()
    view.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 4)
    # The picture has 320 x 240 px, and its origin is the centre of the first pixel.
    view.until(lambda: "place at 159.5, 59.5 px" in card.inner_text(), "the place is described")
    assert "-2.303" in card.inner_text()
    view.page.get_by_role("button", name="Move by keys").focus()
    view.press("ArrowRight")
    view.until(lambda: "place at 160.5, 59.5 px" in card.inner_text(), "an arrow moves by a pixel")
    assert view.painted == 20
    view.until(lambda: view.page.evaluate(INKED, RING) > 20, "the place is marked")

    view.press("Enter")
    view.until(lambda: "drawn by" in card.inner_text(), "the nearest particle is described")
    assert "of 800" in card.inner_text()
    assert "descend from" in view.page.locator(".inspection-genealogy").inner_text()
    view.page.check(".inspection-veil input")
    view.until(lambda: "log likelihood from -2.3, purple" in view.page.inner_text(".flat-caption"), "it has a scale")
    server.seek(view.id, 19)
    view.until(lambda: "followed back to frame 0" in card.inner_text() and view.painted == 19, "its ancestor is shown")
    view.until(lambda: "in the next frame" in card.inner_text(), "its children are shown")

    view.press("i")
    view.until(lambda: view.page.evaluate(INKED, RING) == 0, "nothing of it is drawn any more")
    assert "purple" not in view.page.inner_text(".flat-caption")
    assert view.page.locator(".plots").is_visible()


PICTURE = "document.querySelector('.world-canvas').toDataURL()"
# Whether the world overlaps the picture.
OVERLAP = """(() => {
    const [a, b] = ['.flat-canvas', '.world'].map((it) => document.querySelector(it).getBoundingClientRect());
    return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
})()"""


class WorldPage(SessionPage):
    """The page of a session that shows a world beside its picture."""

    @property
    def canvas(self) -> Any:
        return self.page.locator(".world-canvas")

    @property
    def side(self) -> tuple[int, int]:
        """Azimuth and elevation of the view in degrees."""
        return int(self.canvas.get_attribute("data-azimuth")), int(self.canvas.get_attribute("data-elevation"))

    def stands(self, azimuth: int, elevation: int) -> None:
        self.until(lambda: self.side == (azimuth, elevation), f"it is seen from {azimuth}, {elevation} degrees")

    def changes(self, work: Callable[[], object]) -> None:
        """Do something, and wait until the picture has changed."""
        before = self.page.evaluate(PICTURE)
        work()
        self.until(lambda: self.page.evaluate(PICTURE) != before, "the world looks different")


def test_a_world_is_seen_from_any_side(page: Any, server: Server) -> None:
    """Buttons, drags and arrow keys turn it; it continues with the run, has layers, folds and fits any window."""
    page.goto(server.start_session(experiment="head", frames=60)["page"])
    view = WorldPage(page, server).ready()
    view.canvas.wait_for()
    assert page.inner_text(".world summary") == "Head model, mm"
    assert view.side == (-35, 15)
    pressed = page.locator("[data-viewpoint][aria-pressed=true]")
    for name, side in (("top", (0, 90)), ("3-d", (-35, 15))):
        button = page.locator(f"[data-viewpoint='{name}']")
        view.changes(button.click)
        view.stands(*side)
        assert pressed.all_inner_texts() == [button.inner_text()]
    assert view.canvas.get_attribute("aria-label").startswith("Head model, in mm, seen from -35 degrees")
    view.canvas.focus()
    view.changes(lambda: view.press("Enter"))
    view.stands(0, 0)
    assert pressed.get_attribute("data-viewpoint") == "front"
    view.changes(page.locator("[data-viewpoint='3-d']").click)
    # Dragged to the right it shows its left; with the focus it takes the arrow keys, which else move the run.
    view.go_to(9)
    box = view.canvas.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    view.changes(lambda: view.drag((x, y), (x + 50, y + 20)))
    view.stands(-65, 27)
    assert pressed.count() == 0
    view.canvas.focus()
    for key in ("ArrowRight", "ArrowRight", *["ArrowUp"] * 7):
        view.press(key)
    view.stands(-45, 90)
    assert view.position == 9
    page.locator(".play").focus()
    view.press("ArrowRight")
    view.stands_at(10)
    assert view.side == (-45, 90)
    view.changes(lambda: server.seek(view.id, 30))
    view.paints(30)
    page.locator(".controls").get_by_text("More", exact=True).click()
    page.get_by_text("What to draw").click()
    view.changes(page.get_by_label("Axes", exact=True).uncheck)
    # It can be enlarged and folded; it covers nothing of the picture, and nothing sticks out.
    small, larger = view.canvas.bounding_box()["width"], page.get_by_label("Larger")
    larger.click()
    view.until(lambda: view.canvas.bounding_box()["width"] > 1.5 * small, "it is larger")
    larger.click()
    page.locator(".world summary").click()
    assert not view.canvas.is_visible()
    page.locator(".world summary").click()
    for width in (1280, 700, 390):
        view.resize(width)
        view.until(lambda: not page.evaluate(OVERLAP), "it stands beside the picture, or below")
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
