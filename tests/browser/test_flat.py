"""The flat view and what stands beside it: parameters, a look into the frame, and worlds seen from any side."""

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


Watch = Callable[..., SessionPage]


def occluder(view: SessionPage) -> int:
    return int(view.page.evaluate(OCCLUDER))


@pytest.fixture
def look(unchosen: Any, server: Server) -> Watch:
    """Start a session and open its page, which shows it flat by itself in this browser."""

    def opened(**recipe: Any) -> SessionPage:
        unchosen.goto(server.start_session(**recipe)["page"])
        view = SessionPage(unchosen, server).ready()
        view.until(lambda: view.painted is not None, "a frame is painted")
        view.page.locator(".controls [type=range]").first.wait_for(state="attached")
        return view

    return opened


def test_where_webgl_runs_in_software_the_view_is_flat(look: Watch, server: Server) -> None:
    """The canvas shows each frame that the run reaches, and says in words what it shows; no scene is loaded.

    It keeps its proportions in any window, and its layers are switched on and off.
    """
    view = look(tracker="apf")
    layers_are_switched_on_and_off(view, server)
    the_canvas_keeps_its_proportions_in_any_window(view)
    view.resize(1280)
    canvas = view.page.locator(".flat-canvas")
    assert view.page.locator("iframe").count() == 0
    server.seek(view.id, 12)
    view.paints(12)
    assert canvas.get_attribute("role") == "img"
    view.until(lambda: "frame 12 " in canvas.get_attribute("aria-label"), "it is told in words once the run stands")
    assert canvas.get_attribute("aria-label").endswith(view.page.inner_text(".flat-caption"))
    assert occluder(view) == pytest.approx(40, abs=2)
    view.press("ArrowRight")
    view.paints(13)
    view.press("Space")
    view.until(lambda: (view.painted or 0) > 30, "the run plays on the canvas")


def the_canvas_keeps_its_proportions_in_any_window(view: SessionPage) -> None:
    """It is as large as its place allows, in pixels of the display, and stays sharp when the window changes.

    On a phone it has the width for itself; a button opens the parameters over it and closes them.
    """
    for width, height in ((1280, 800), (800, 700), (390, 800)):
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


def test_the_panel(look: Watch, server: Server, complaints: Complaints) -> None:
    """All that its controls do, in one visit; the seed comes last, since it begins the run anew."""
    complaints.expected = ("the server responded with a status of 422",)
    view = look()
    a_slider_changes_the_picture(view)
    view.command("pause")
    what_is_half_typed_is_left_alone(view)
    a_refused_value_springs_back(view)
    what_others_change_is_shown(view)
    a_slider_reaches_the_value_in_force(view)
    tracker_and_seed_can_be_chosen(view)


def a_slider_changes_the_picture(view: SessionPage) -> None:
    """Moved by the keyboard, a slider changes what is drawn from the next frame on, and the box beside it follows."""
    slider = view.control("Occluder width (px)", "range")
    slider.focus()
    for _ in range(5):
        view.page.keyboard.press("ArrowRight")
    view.until(lambda: view.session["parameters"]["occlusion_width_px"] == 45, "the session has the new value")
    view.until(lambda: view.control("Occluder width (px)").input_value() == "45", "the box has followed")
    view.page.keyboard.press("Space")
    view.until(lambda: occluder(view) == pytest.approx(45, abs=2), "the wider occluder is seen")


def what_is_half_typed_is_left_alone(view: SessionPage) -> None:
    """The session's word does not overwrite a number that is being typed; a box that is left empty shows it again."""
    box = view.control("Particles")
    box.fill("30")
    view.change(occlusion_width_px=61)
    view.until(lambda: view.control("Occluder width (px)", "range").input_value() == "61", "the change is shown")
    assert box.input_value() == "30"
    box.press("End")
    box.press("0")
    box.press("Enter")
    view.until(lambda: view.session["parameters"]["sample_count"] == 300, "the session has what was typed")
    box.fill("")
    box.press("Enter")
    view.until(lambda: box.input_value() == "300", "the box shows what is in force")


def a_refused_value_springs_back(view: SessionPage) -> None:
    """What is out of bounds is refused by the server in a sentence, and the control shows what is in force."""
    box = view.control("Particles")
    box.fill("100000000")
    box.press("Enter")
    view.page.locator(".toast.error").wait_for()
    assert "sample_count" in view.page.inner_text(".toast.error")
    view.until(lambda: box.input_value() == str(view.session["parameters"]["sample_count"]), "the box springs back")


def a_slider_reaches_the_value_in_force(view: SessionPage) -> None:
    """Its useful range is 0 to 120, and the session has 300."""
    slider = view.control("Occluder width (px)", "range")
    for value, most in ((80, "120"), (300, "300")):
        view.change(occlusion_width_px=value)
        view.until(lambda value=value: slider.input_value() == str(value), "it shows the value")  # type: ignore[misc]
        assert [slider.get_attribute(name) for name in ("min", "max")] == ["0", most]


def what_others_change_is_shown(view: SessionPage) -> None:
    """A change from elsewhere moves slider, box and tracker, and takes away what that tracker does not read."""
    view.change(occlusion_width_px=80, tracker="condensation")
    view.until(lambda: view.control("Occluder width (px)", "range").input_value() == "80", "the slider shows it")
    tracker = view.page.get_by_label("Tracker", exact=True)
    view.until(lambda: tracker.input_value() == "condensation", "the tracker, too")
    panel = view.page.locator(".control")  # a fold may be called as what is in it is, and files are in their own menu
    for each in (each for each in view.session["declarations"] if each["kind"] != "file"):
        reads = not each["trackers"] or "condensation" in each["trackers"]
        assert (panel.get_by_label(each["label"], exact=True).count() > 0) == reads, each["name"]


def tracker_and_seed_can_be_chosen(view: SessionPage) -> None:
    """Another tracker counts from the next frame; another seed begins the run anew."""
    view.page.get_by_label("Tracker", exact=True).select_option("apf")
    view.until(lambda: view.session["tracker"] == "apf", "the session has the tracker")
    view.page.locator(".controls").get_by_text("More", exact=True).click()
    seed = view.control("Seed")
    seed.fill("77")
    seed.press("Enter")
    view.until(lambda: view.session["recipe"]["seed"] == 77, "the session has the seed")


def layers_are_switched_on_and_off(view: SessionPage, server: Server) -> None:
    """A layer that is switched off is gone at once, also while the run stands still."""
    server.seek(view.id, 5)
    view.paints(5)
    before = view.page.evaluate(INKED, SKY)
    view.page.locator(".controls").get_by_text("More", exact=True).click()
    view.page.get_by_text("What to draw").click()
    layer = view.page.get_by_label("Particles by sampler")
    layer.uncheck()
    view.until(lambda: view.page.evaluate(INKED, SKY) < before / 10, "the particles are gone")
    layer.check()
    view.until(lambda: view.page.evaluate(INKED, SKY) == before, "they are back")


def test_the_choice_of_a_view_is_remembered(look: Watch) -> None:
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


def test_without_webgl_there_is_no_scene_to_choose(unchosen: Any, look: Watch) -> None:
    """A browser without 3-D graphics gets the flat view, and says why when the scene is asked for."""
    unchosen.add_init_script(NO_WEBGL)
    view = look()
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


def test_a_killed_worker_is_reported_and_the_view_goes_on(look: Watch, server: Server, complaints: Complaints) -> None:
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


def test_what_is_pointed_at_is_told_and_drawn(watch: Watch, server: Server) -> None:
    """By pointer and by keys: a place with its likelihood, a particle with its path, which goes on with the run.

    The likelihood lies over the picture, and with the last look all of it is gone from the picture.
    """
    view = watch(tracker="condensation", seed=3)
    server.seek(view.id, 20)
    view.paints(20)
    assert view.page.evaluate(INKED, RING) == 0
    view.press("i")
    card = view.page.locator(".inspection-card")
    view.until(lambda: "colour of the pixel, estimate at" in card.inner_text(), "the estimate is told")
    assert not view.page.locator(".plots").is_visible()

    view.page.get_by_role("button", name="Place", exact=True).click()
    box = view.page.locator(".flat-canvas").bounding_box()
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 4
    view.page.mouse.move(*middle)
    # The picture is 320 px wide and 240 px high, and its origin is the centre of the first pixel.
    view.until(lambda: "place at 159.5, 59.5 px" in card.inner_text(), "the place is told")
    assert "-2.303" in card.inner_text()
    view.page.get_by_role("button", name="Move by keys").focus()
    view.press("ArrowRight")
    view.until(lambda: "place at 160.5, 59.5 px" in card.inner_text(), "an arrow moves by a pixel")
    assert view.painted == 20
    assert view.page.evaluate(INKED, RING) > 20

    view.press("Enter")
    view.until(lambda: "drawn by" in card.inner_text(), "the nearest particle is told")
    assert "of 800" in card.inner_text()
    assert "descend from" in view.page.locator(".inspection-genealogy").inner_text()
    view.page.check(".inspection-veil input")
    view.until(lambda: "log likelihood from -2.3, purple" in view.page.inner_text(".flat-caption"), "it has a scale")
    server.seek(view.id, 19)
    view.until(lambda: "followed back to frame 0" in card.inner_text() and view.painted == 19, "its ancestor is told")
    view.until(lambda: "in the next frame" in card.inner_text(), "its children are told")

    view.press("i")
    view.until(lambda: view.page.evaluate(INKED, RING) == 0, "nothing of it is drawn any more")
    assert "purple" not in view.page.inner_text(".flat-caption")
    assert view.page.locator(".plots").is_visible()


# What the canvas shows, as a number that differs when a pixel does.
SUM = """(() => {
    const canvas = document.querySelector('.world-canvas');
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let sum = 0;
    for (let i = 0; i < data.length; i += 1) sum = (31 * sum + data[i]) % 4294967291;
    return sum;
})()"""
# Whether some frames of the display change nothing.
STEADY = f"""(async () => {{
    const before = {SUM};
    for (let i = 0; i < 4; i += 1) await new Promise(requestAnimationFrame);
    return before === {SUM};
}})()"""
# Whether two elements of the page overlap.
OVERLAP = """([one, other]) => {
    const [a, b] = [one, other].map((it) => document.querySelector(it).getBoundingClientRect());
    return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}"""


class WorldPage(SessionPage):
    """The page of a session that shows a world beside its picture."""

    @property
    def canvas(self) -> Any:
        return self.page.locator(".world-canvas")

    @property
    def side(self) -> tuple[int, int]:
        """From where it is seen: azimuth and elevation in degrees."""
        return int(self.canvas.get_attribute("data-azimuth")), int(self.canvas.get_attribute("data-elevation"))

    def stands(self, azimuth: int, elevation: int) -> None:
        self.until(lambda: self.side == (azimuth, elevation), f"it is seen from {azimuth}, {elevation} degrees")

    def changes(self, work: Callable[[], object]) -> None:
        """Do something, and wait until another picture is shown; what is still to be painted comes before it."""
        self.until(lambda: self.page.evaluate(STEADY), "nothing is painted any more")
        before = self.page.evaluate(SUM)
        work()
        self.until(lambda: self.page.evaluate(SUM) != before, "the world looks otherwise")


def test_a_world_is_looked_at(page: Any, server: Server) -> None:
    """All that can be done with it, in one visit."""
    page.goto(server.start_session(experiment="head", frames=60)["page"])
    view = WorldPage(page, server).ready()
    view.canvas.wait_for()
    it_is_seen_from_its_viewpoints(view)
    it_is_turned_by_hand(view)
    it_goes_on_with_the_run(view, server)
    it_makes_room(view)


def it_is_seen_from_its_viewpoints(view: WorldPage) -> None:
    """It begins at the first of them; a button shows another side, and says that it is the one."""
    assert view.page.inner_text(".world summary") == "Head model, mm"
    assert view.side == (-35, 15)
    for name, side in (("front", (0, 0)), ("top", (0, 90)), ("3-d", (-35, 15))):
        button = view.page.locator(f"[data-viewpoint='{name}']")
        view.changes(button.click)
        view.stands(*side)
        assert view.page.locator("[data-viewpoint][aria-pressed=true]").all_inner_texts() == [button.inner_text()]
    assert view.canvas.get_attribute("aria-label").startswith("Head model, in mm, seen from -35 degrees")
    view.canvas.focus()
    view.changes(lambda: view.press("Enter"))
    view.stands(0, 0)
    assert view.page.locator("[data-viewpoint][aria-pressed=true]").get_attribute("data-viewpoint") == "front"
    view.changes(view.page.locator("[data-viewpoint='3-d']").click)


def it_is_turned_by_hand(view: WorldPage) -> None:
    """Dragged to the right it shows its left; arrow keys turn it while it has the focus, and move the run elsewhere."""
    view.go_to(9)
    box = view.canvas.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    view.changes(lambda: view.drag((x, y), (x + 50, y + 20)))
    view.stands(-65, 27)
    assert view.page.locator("[data-viewpoint][aria-pressed=true]").count() == 0
    view.canvas.focus()
    for key in ("ArrowRight", "ArrowRight", "ArrowUp"):
        view.changes(lambda key=key: view.press(key))  # type: ignore[misc]
    view.stands(-45, 37)
    for _ in range(6):
        view.press("ArrowUp")
    view.stands(-45, 90)
    assert view.position == 9
    view.page.locator(".play").focus()
    view.press("ArrowRight")
    view.stands_at(10)
    assert view.side == (-45, 90)


def it_goes_on_with_the_run(view: WorldPage, server: Server) -> None:
    """It is painted with the picture, and layers hold in it, too."""
    view.changes(lambda: server.seek(view.id, 30))
    view.paints(30)
    view.page.locator(".controls").get_by_text("More", exact=True).click()
    view.page.get_by_text("What to draw").click()
    view.changes(view.page.get_by_label("Axes", exact=True).uncheck)
    view.changes(view.page.get_by_label("Axes", exact=True).check)


def it_makes_room(view: WorldPage) -> None:
    """It can be enlarged and folded away; it hides nothing of the picture, and nothing sticks out."""
    small, larger = view.canvas.bounding_box()["width"], view.page.get_by_label("Larger")
    larger.click()
    view.until(lambda: view.canvas.bounding_box()["width"] > 1.5 * small, "it is larger")
    larger.click()
    view.page.locator(".world summary").click()
    assert not view.canvas.is_visible()
    view.page.locator(".world summary").click()
    for width, height, place in ((1280, 800, "beside"), (700, 800, "beside"), (390, 844, "below")):
        view.resize(width, height)
        apart = lambda: not view.page.evaluate(OVERLAP, [".flat-canvas", ".world"])  # noqa: E731 - one line of reading
        view.until(apart, f"it stands {place} the picture")
    assert view.page.evaluate("document.documentElement.scrollWidth") <= 390
