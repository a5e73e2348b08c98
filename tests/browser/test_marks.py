"""Marks of unknown kinds, edited by their description alone; and truth that a person marks."""

from typing import Any

import numpy as np
import pytest

from tests.browser.accessible import check
from tests.browser.conftest import Watch
from tests.browser.host import Server
from tests.browser.test_upload import clip as clip  # noqa: PLC0414 - a fixture
from tests.browser.views import SessionPage, View

PLAIN = {"title": "Mark", "instruction": "Make it.", "text": "", "handles": [], "links": [], "numbers": []}
BOX: dict[str, Any] = {**PLAIN, "kind": "box", "closed": False}
RADIUS = {"name": "radius_px", "title": "Radius", "unit": "px", "minimum": 2, "maximum": 100, "step": 0.5}
CENTRE = {"name": "centre", "title": "Centre", "at": [0.5, 0.5]}
CIRCLE = {**BOX, "kind": "circle", "handles": [CENTRE], "numbers": [{**RADIUS, "default": 20, "about": "centre"}]}
CORNERS = [{"name": f"corners.{n}", "title": f"Corner {n}", "at": [0.2 + 0.3 * n, 0.3]} for n in range(3)]
LINKS = [["corners.0", "corners.1"], ["corners.1", "corners.2"]]
OUTLINE = {**BOX, "kind": "outline", "handles": CORNERS, "links": LINKS, "closed": True}
FRENCH = """() => {
    const layout = new Map([["KeyW", "z"], ["KeyA", "q"], ["KeyS", "s"], ["KeyD", "d"]]);
    Object.defineProperty(navigator, "keyboard", { value: { getLayoutMap: async () => layout } });
}"""
SIZE = (320, 240)
EDIT = """async ([description, [width, height]]) => {
    const { markEditor } = await import("./static/shared/marks/mark_editor.js");
    window.changes = 0;
    window.editor = markEditor(description, "target", () => (window.changes += 1));
    document.querySelector("main").append(editor.element);
    editor.picture.show("api/v1/experiments/ball/thumbnail.webp", width, height);
    editor.offer();
}"""


class Editing(View):
    """An editor alone on a page."""

    def __init__(self, page: Any, description: dict[str, Any]) -> None:
        super().__init__(page)
        self.page.evaluate(EDIT, [description, list(SIZE)])
        self.surface = self.page.locator(".mark-surface")

    @property
    def mark(self) -> Any:
        return self.page.evaluate("editor.mark")

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return where the middle of a pixel is in the window."""
        area = self.surface.bounding_box()
        return area["x"] + (x + 0.5) * area["width"] / SIZE[0], area["y"] + (y + 0.5) * area["height"] / SIZE[1]

    def pull(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag from one place of the picture to another."""
        self.drag(self.at(*start), self.at(*end))


def test_a_circle_is_made_from_its_description(bare: Any, complaints: Any) -> None:
    """The page begins without a mark; centre, edge, slider and keys each change their part of a new one.

    A missing picture is reported in its place until there is one again.
    """
    complaints.expected = ("the server responded with a status of 404",)
    editing = Editing(bare, CIRCLE)
    page = editing.page
    assert (editing.mark, page.locator(".point").get_attribute("aria-label")) == (None, "Centre, 160 across, 120 down")
    editing.pull((159.5, 119.5), (100, 80))
    mark = editing.mark
    assert mark == {"kind": "circle", "radius_px": 20, "centre": pytest.approx([100, 80], abs=0.3)}

    editing.pull((100, 120), (100, 120))
    editing.pull((120, 80), (145, 80))
    assert editing.mark["radius_px"] == pytest.approx(45, abs=1)
    assert float(page.locator("circle.mark-line").get_attribute("r")) == editing.mark["radius_px"]
    page.locator("[data-number=radius_px]").focus()
    page.keyboard.press("End")
    assert editing.mark["radius_px"] == 100
    assert "100 px" in page.inner_text(".mark-number")

    page.locator(".point").focus()
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Shift+ArrowDown")
    assert editing.mark["centre"] == pytest.approx(np.add(mark["centre"], (-1, 10)), abs=0.1)
    assert page.evaluate("changes") > 3
    missing = page.locator(".picture-missing")
    page.evaluate("editor.picture.show('api/v1/uploads/none/frames/0.jpg', 320, 240)")
    missing.wait_for()
    assert "loading" not in editing.surface.get_attribute("class")
    page.evaluate("editor.picture.show('static/shared/icon.svg', 320, 240)")
    missing.wait_for(state="hidden")


def test_an_outline_is_named_corrected_and_kept_in_the_picture(bare: Any) -> None:
    """Offered handles have names; where they are close, one name shows. A line closes it; no corner leaves the picture.

    A mark that a model placed is a mark at once; its points are hollow until they are moved.
    """
    editing = Editing(bare, OUTLINE)
    names = bare.locator(".point-name:visible")
    assert names.all_inner_texts() == ["Corner 0", "Corner 1", "Corner 2"]
    assert bare.locator("line.mark-line").count() == 3
    editing.pull((64 - 0.2, 72), (-80, -50))
    others = [pytest.approx(place, abs=0.1) for place in ([159.5, 71.7], [255.2, 71.7])]
    assert editing.mark == {"kind": "outline", "corners": [[0, 0], *others]}
    bare.mouse.move(*editing.at(300, 220))
    bare.locator(".point").first.blur()
    assert names.all_inner_texts() == ["Corner 1", "Corner 2"]
    bare.evaluate("editor.set({ kind: 'outline', corners: [[64, 72], [159.5, 71.7], [255, 72]] })")
    bare.locator(".point").first.focus()
    for place, shown in (((300, 220), 0), ((159.5, 71.7), 1), ((300, 200), 0)):
        bare.mouse.move(*editing.at(*place))
        assert names.all_inner_texts() == [f"Corner {shown}"]

    found = {"kind": "outline", "corners": [[10, 10], [100, 20], [50, 90]]}
    bare.evaluate("(mark) => editor.set(mark, ['corners.2'])", found)
    assert editing.mark == found
    assert bare.locator(".point.placed").count() == 1
    editing.pull((50, 90), (60, 90))
    assert bare.locator(".point.placed").count() == 0
    bare.evaluate("editor.set(null)")
    assert (editing.mark, bare.locator(".point:visible").count()) == (None, 0)


def test_keys_resize_a_box_by_their_place(bare: Any) -> None:
    """On a French keyboard the keys in place of W, A, S and D resize a box, and the page names their letters."""
    bare.evaluate(FRENCH)
    editing = Editing(bare, BOX)
    bare.get_by_role("application", name="the keys Z, Q, S, D resize it").focus()
    bare.keyboard.press("ArrowLeft")
    made = editing.mark
    keys = bare.context.new_cdp_session(bare)
    for place, letter in (("KeyW", "z"), ("KeyA", "q"), ("KeyA", "q"), ("KeyZ", "w"), ("KeyQ", "a")):
        keys.send("Input.dispatchKeyEvent", {"type": "keyDown", "code": place, "key": letter})
    assert editing.mark == {**made, "width": made["width"] - 2, "height": made["height"] - 1}


WIDTH = 160


@pytest.fixture
def upload(server: Server, clip: bytes) -> str:
    return server.upload("walk.mp4", clip)


@pytest.fixture
def shown(watch: Watch, upload: str) -> SessionPage:
    """The session on the disc that walks to the right, by 2 px in each frame, from (40, 60) on."""
    return watch(upload=upload, box=[31, 51, 19, 19], seed=0, frames=None)


def waits_at(shown: SessionPage, frame: int) -> None:
    page = shown.page
    shown.until(lambda: f"frames/{frame}." in str(page.get_attribute(".truth-marking img", "src")), f"picture {frame}")
    shown.until(lambda: page.evaluate("document.querySelector('.truth-marking img').complete"), "it is there")


def click_disc(shown: SessionPage, frame: int) -> None:
    waits_at(shown, frame)
    area = shown.page.locator(".truth-marking .picture").bounding_box()
    scale = area["width"] / WIDTH
    shown.page.mouse.click(area["x"] + (40.5 + 2 * frame) * scale, area["y"] + 60.5 * scale)


def table(shown: SessionPage, upload: str) -> list[str]:
    where = f"api/v1/uploads/{upload}/truth.csv?experiment=ball"
    return shown.page.request.get(where).text().split()


def test_truth_is_clicked_frame_by_frame_and_measures_the_run(shown: SessionPage, server: Server, upload: str) -> None:
    """A click or a key marks and goes on; moves count without Enter; marks are taken back; gaps have no truth."""
    page = shown.page
    shown.menu("files")
    page.click("[data-role=mark-truth]")
    page.locator(".truth-marking").wait_for()
    waits_at(shown, 0)
    check(page)
    page.fill("#truth-every", "4")
    click_disc(shown, 0)
    click_disc(shown, 4)
    waits_at(shown, 8)
    page.get_by_text("2 frames marked").wait_for()
    for key in (*["ArrowRight"] * 8, "Shift+ArrowDown", "Shift+ArrowUp"):
        page.keyboard.press(key)
    for key, frame in (("Enter", 12), ("Enter", 16), ("Backspace", 12)):  # once where it was before
        page.keyboard.press(key)
        waits_at(shown, frame)
    page.get_by_text("Picture 12 is not marked. 3 frames marked").wait_for()
    for key in ("Delete", "Shift+ArrowDown", "Shift+ArrowDown"):  # hidden there, and moved before the next picture
        page.keyboard.press(key)
    page.get_by_text("Picture 16 is marked. 4 frames marked").wait_for()
    page.click(".truth-row >> text=Undo")
    page.get_by_text("Picture 16 is not marked. 3 frames marked").wait_for()
    page.click(".truth-row >> text=Done")
    page.locator(".truth-marking").wait_for(state="detached")
    assert table(shown, upload) == ["frame,x,y,w,h", "0,31,51,19,19", "4,39,51,19,19", "8,47,51,19,19"]
    errors = lambda: server.column(shown.id, "error")  # noqa: E731 - one line of reading
    shown.until(lambda: (errors()[8] or 99) < 5, "the run is measured by it")
    assert [frame for frame, error in enumerate(errors()) if error is not None] == [0, 4, 8]

    shown.menu("files")
    page.locator("[data-role=known-truth]").wait_for()


def test_marks_that_are_known_can_be_corrected_or_left_alone(shown: SessionPage, upload: str) -> None:
    """Marking begins with what a file has given; leaving asks before marks are lost."""
    page = shown.page
    rows = "frame,x,y,w,h\n0,31,51,19,19\n1,90,90,19,19\n"
    shown.menu("files")
    page.set_input_files("[data-file=truth]", {"name": "t.csv", "mimeType": "text/csv", "buffer": rows.encode()})
    page.locator(".toast:has-text('2 frames is known')").wait_for()
    page.locator(".verdict-error:not(:empty)").wait_for()
    page.keyboard.press("Escape")
    page.keyboard.press("t")
    page.locator(".truth-marking[data-state=kept]").wait_for()
    page.fill("#truth-every", "1")
    page.locator("button:has-text('Save and continue')").click()
    click_disc(shown, 1)
    waits_at(shown, 2)
    page.keyboard.press("Escape")
    page.locator("dialog >> text=Keep").click()
    assert page.locator(".truth-marking").count() == 1
    page.keyboard.press("Escape")
    page.locator("dialog >> text=Leave").last.click()
    page.locator(".truth-marking").wait_for(state="detached")
    assert table(shown, upload)[2] == "1,90,90,19,19"


def test_a_simulated_scene_knows_its_own_truth(watch: Watch) -> None:
    """There is nothing to mark, by no key."""
    shown = watch()
    page = shown.page
    with page.expect_response("**/session/marking.js"):
        page.keyboard.press("t")
    page.keyboard.press("ArrowRight")
    shown.stands_at(1)
    assert page.locator(".truth-marking").count() == 0
    assert page.locator("[data-role=mark-truth]").count() == 0
