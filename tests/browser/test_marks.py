"""Marks of kinds that the project does not know, edited from their description alone."""

from typing import Any

import pytest

CIRCLE = {
    "kind": "circle",
    "title": "Circle",
    "instruction": "Draw a circle.",
    "text": "x,y,r",
    "handles": [{"name": "centre", "title": "Centre", "at": [0.5, 0.5]}],
    "links": [],
    "closed": False,
    "numbers": [
        {
            "name": "radius_px",
            "title": "Radius",
            "unit": "px",
            "minimum": 2,
            "maximum": 100,
            "step": 0.5,
            "default": 20,
            "about": "centre",
        }
    ],
}
OUTLINE = {
    "kind": "outline",
    "title": "Outline",
    "instruction": "Drag the corners.",
    "text": "",
    "handles": [{"name": f"corners.{n}", "title": f"Corner {n}", "at": [0.2 + 0.3 * n, 0.3]} for n in range(3)],
    "links": [["corners.0", "corners.1"], ["corners.1", "corners.2"]],
    "closed": True,
    "numbers": [],
}
BOX = {**CIRCLE, "kind": "box", "title": "Box", "handles": [], "numbers": []}
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


class Editing:
    """An editor alone on a page."""

    def __init__(self, page: Any, description: dict[str, Any]) -> None:
        self.page = page
        self.page.evaluate(EDIT, [description, list(SIZE)])
        self.surface = self.page.locator(".mark-surface")

    @property
    def mark(self) -> Any:
        return self.page.evaluate("editor.mark")

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return where the middle of a pixel is in the window."""
        area = self.surface.bounding_box()
        return area["x"] + (x + 0.5) * area["width"] / SIZE[0], area["y"] + (y + 0.5) * area["height"] / SIZE[1]

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        self.page.mouse.move(*self.at(*start))
        self.page.mouse.down()
        self.page.mouse.move(*self.at(*end), steps=4)
        self.page.mouse.up()


def test_a_circle_is_made_from_its_description(bare: Any) -> None:
    """There is no mark until somebody makes one; then centre, edge, slider and keys each change what they should."""
    editing = Editing(bare, CIRCLE)
    page = editing.page
    assert editing.mark is None
    assert page.locator(".point").get_attribute("aria-label") == "Centre, 160 across, 120 down"
    editing.drag((159.5, 119.5), (100, 80))
    mark = editing.mark
    assert (mark["kind"], mark["radius_px"]) == ("circle", 20)
    assert mark["centre"] == pytest.approx([100, 80], abs=0.3)

    editing.drag((100, 120), (100, 120))
    editing.drag((120, 80), (145, 80))
    assert editing.mark["radius_px"] == pytest.approx(45, abs=1)
    assert float(page.locator("circle.mark-line").get_attribute("r")) == editing.mark["radius_px"]
    page.locator("[data-number=radius_px]").focus()
    page.keyboard.press("End")
    assert editing.mark["radius_px"] == 100
    assert "100 px" in page.inner_text(".mark-number")

    page.locator(".point").focus()
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Shift+ArrowDown")
    assert editing.mark["centre"] == pytest.approx([mark["centre"][0] - 1, mark["centre"][1] + 10], abs=0.1)
    assert page.evaluate("changes") > 3


def test_an_outline_is_closed_and_stays_in_the_picture(bare: Any) -> None:
    """Corners lie in a list, a line closes the outline, and no corner leaves the picture."""
    editing = Editing(bare, OUTLINE)
    assert editing.page.locator("line.mark-line").count() == 3
    editing.drag((64 - 0.2, 72), (-80, -50))
    assert editing.mark == {
        "kind": "outline",
        "corners": [[0, 0], pytest.approx([159.5, 71.7], abs=0.1), pytest.approx([255.2, 71.7], abs=0.1)],
    }


def test_a_mark_that_was_found_is_shown_to_be_corrected(bare: Any) -> None:
    """A mark that is set is a mark at once; what a model has placed is hollow until it is moved."""
    editing = Editing(bare, OUTLINE)
    found = {"kind": "outline", "corners": [[10, 10], [100, 20], [50, 90]]}
    editing.page.evaluate("(mark) => editor.set(mark, ['corners.2'])", found)
    assert editing.mark == found
    assert editing.page.locator(".point.placed").count() == 1
    editing.drag((50, 90), (60, 90))
    assert editing.page.locator(".point.placed").count() == 0
    editing.page.evaluate("editor.set(null)")
    assert editing.mark is None
    assert editing.page.locator(".point:visible").count() == 0


def test_handles_have_names_until_they_are_moved(bare: Any) -> None:
    """Of handles that are offered it is seen which is which, without pointing at any; what was moved was understood."""
    editing = Editing(bare, OUTLINE)
    names = editing.page.locator(".point-name:visible")
    assert names.all_inner_texts() == ["Corner 0", "Corner 1", "Corner 2"]
    editing.drag((159.5, 71.7), (150, 200))
    editing.page.mouse.move(*editing.at(300, 220))
    editing.page.locator(".point").nth(1).blur()
    assert names.all_inner_texts() == ["Corner 0", "Corner 2"]


def test_keys_resize_a_box_by_their_place(bare: Any) -> None:
    """On a French keyboard the keys at the places of W, A, S and D resize a box, and are called by its letters."""
    bare.evaluate(FRENCH)
    editing = Editing(bare, BOX)
    bare.get_by_role("application", name="the keys Z, Q, S, D resize it").focus()
    bare.keyboard.press("ArrowLeft")
    made = editing.mark
    keys = bare.context.new_cdp_session(bare)
    for place, letter in (("KeyW", "z"), ("KeyA", "q"), ("KeyA", "q"), ("KeyZ", "w"), ("KeyQ", "a")):
        keys.send("Input.dispatchKeyEvent", {"type": "keyDown", "code": place, "key": letter})
    assert editing.mark == {**made, "width": made["width"] - 2, "height": made["height"] - 1}


def test_one_name_is_shown_at_a_time(bare: Any) -> None:
    """Names of handles that lie close would cover each other: the one that is pointed at goes before the focus."""
    editing = Editing(bare, OUTLINE)
    editing.page.evaluate("editor.set({ kind: 'outline', corners: [[64, 72], [159.5, 71.7], [255, 72]] })")
    names = editing.page.locator(".point-name:visible")
    editing.page.locator(".point").first.focus()
    assert names.all_inner_texts() == ["Corner 0"]
    editing.page.mouse.move(*editing.at(159.5, 71.7))
    assert names.all_inner_texts() == ["Corner 1"]
    editing.page.mouse.move(*editing.at(300, 200))
    assert names.all_inner_texts() == ["Corner 0"]


def test_a_picture_that_cannot_be_shown_is_told_of(bare: Any, complaints: Any) -> None:
    """It says so in the picture's place, until there is a picture again."""
    complaints.expected = ("the server responded with a status of 404",)
    editing = Editing(bare, CIRCLE)
    missing = editing.page.locator(".picture-missing")
    editing.page.evaluate("editor.picture.show('api/v1/uploads/none/frames/0.jpg', 320, 240)")
    missing.wait_for()
    assert "loading" not in editing.surface.get_attribute("class")
    editing.page.evaluate("editor.picture.show('static/shared/icon.svg', 320, 240)")
    missing.wait_for(state="hidden")
