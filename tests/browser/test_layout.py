"""Little room and darkness: everything stays readable."""

from collections.abc import Callable
from typing import Any

from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage

Watch = Callable[..., SessionPage]
OVERFLOW = "document.documentElement.scrollWidth - innerWidth"


def box(page: Any, selector: str) -> dict[str, float]:
    return page.locator(selector).bounding_box()


def test_from_a_wide_window_to_a_phone(watch: Watch) -> None:
    """Plots stand beside the scene where there is room, below it where there is less, and fit a phone."""
    shown = watch()
    assert not shown.page.locator(".look-at").is_visible(), "another run than a preset's has no words"
    beside_each_other(shown)
    the_title_is_whole(shown)
    one_row_of_sparklines(shown)
    on_a_phone(shown)


def beside_each_other(shown: SessionPage) -> None:
    """The picture is the hero: scene at the left, plots at the right, transport below, nothing overlaps."""
    page = shown.page
    scene, side, deck = box(page, ".scene"), box(page, ".side"), box(page, ".deck")
    assert scene["x"] + scene["width"] <= side["x"] + 1
    assert scene["width"] > 2 * side["width"]
    assert max(scene["y"] + scene["height"], side["y"] + side["height"]) <= deck["y"] + 1
    assert deck["y"] + deck["height"] <= 801


def one_row_of_sparklines(shown: SessionPage) -> None:
    """The plots fold under the scene, side by side; no control falls off the edge."""
    page = shown.page
    shown.resize(800, 700)
    shown.until(lambda: box(page, ".side")["y"] > box(page, ".scene")["y"] + 100, "the plots are under the scene")
    tops = {round(panel.bounding_box()["y"]) for panel in page.locator(".plots .figure-panel").all()}
    assert len(tops) == 1
    assert page.evaluate(OVERFLOW) <= 0
    for control in page.locator(".transport button:visible, .top button:visible").all():
        area = control.bounding_box()
        assert 0 <= area["x"] <= 800 - area["width"]


def the_title_is_whole(shown: SessionPage) -> None:
    """What runs is read as a whole at 1280 px: the experiment and its preset."""
    is_cut = "(it) => it.scrollWidth > it.clientWidth"
    shown.until(lambda: not shown.page.locator("h1").evaluate(is_cut), "the title is not cut")


def on_a_phone(shown: SessionPage) -> None:
    """Scene and transport are there, and the title has a line of its own.

    Nothing of the line above is cut off or crowded: the tools beside the name, what runs below them. The number of the
    frame is whole and in no other's place.
    """
    page = shown.page
    shown.resize(400)
    shown.until(lambda: box(page, ".scene")["height"] >= 200, "the scene keeps its place")
    assert page.locator(".play").is_visible()
    assert page.evaluate(OVERFLOW) <= 0
    shown.resize(390)
    shown.until(lambda: page.evaluate("document.body.clientWidth") == 390, "it is narrower")
    title, brand = box(page, ".top h1"), box(page, ".top .brand")
    assert title["width"] > 350
    assert title["y"] >= brand["y"] + brand["height"]
    buttons = [button.bounding_box() for button in page.locator(".top button:visible").all()]
    assert all(button["y"] + button["height"] <= title["y"] + 1 for button in buttons)
    whole = "[...document.querySelectorAll('.top button, .counter')].every((it) => it.scrollWidth <= it.clientWidth)"
    assert page.evaluate(whole)
    number = box(page, ".counter")
    for other in page.locator(".transport > :not(.counter):visible").all():
        area = other.bounding_box()
        beside = area["x"] >= number["x"] + number["width"] or area["x"] + area["width"] <= number["x"]
        assert beside or area["y"] >= number["y"] + number["height"] or area["y"] + area["height"] <= number["y"]
    assert page.evaluate(OVERFLOW) <= 0


def test_a_preset_leaves_room_and_says_what_it_is_about(watch: Watch, server: Server) -> None:
    """Words, picture and panel of a preset in one visit."""
    shown = watch(seed=0, frames=None)
    it_says_what_to_look_at(shown)
    the_panel_folds_to_what_it_is_about_and_keeps_its_folds(shown)


def change_in_the_past(shown: SessionPage, value: int) -> None:
    """Change a parameter in an earlier frame, which makes a branch."""
    branches = len(shown.session["branches"])
    for frame in (8, 4):
        shown.go_to(frame)
    shown.change(ball_radius_px=value)
    shown.until(lambda: len(shown.session["branches"]) == branches + 1, "there is a branch more")


def the_panel_folds_to_what_it_is_about_and_keeps_its_folds(shown: SessionPage) -> None:
    """At first there are the preset's few controls; one fold holds the others by group.

    What was unfolded stays so, when the run branches and when the page is opened again.
    """
    panel = shown.page.locator(".controls")
    panel.get_by_label("Occluder width (px)", exact=True).first.wait_for()
    labels = {each["name"]: each["label"] for each in shown.session["declarations"]}
    about = shown.session["about"]
    assert 0 < len(about) < 6
    for name, label in labels.items():
        assert panel.get_by_label(label, exact=True).first.is_visible() == (name in about), name
    panel.get_by_text("More", exact=True).click()
    panel.get_by_text("Scene", exact=True).click()
    radius = panel.get_by_label("Ball radius (px)", exact=True).first
    assert radius.is_visible()

    change_in_the_past(shown, 9)
    shown.until(lambda: radius.input_value() == "9", "the panel shows the new value")
    assert radius.is_visible()
    shown.page.reload()
    shown.ready()
    radius.wait_for()
    panel.get_by_text("More", exact=True).click()
    shown.page.reload()
    shown.ready()
    panel.get_by_text("More", exact=True).wait_for()
    assert not radius.is_visible()


UNDER = "document.querySelector('.flat-canvas').getBoundingClientRect().bottom"


def it_says_what_to_look_at(shown: SessionPage) -> None:
    """The sentence stands below the picture, which it leaves free, until the menu puts it away."""
    words = shown.page.locator(".look-at")
    words.wait_for()
    assert "when the pillar hides the ball" in words.inner_text()
    for width in (1280, 800, 390):
        shown.resize(width)
        shown.until(lambda: shown.page.evaluate(OVERFLOW) <= 0, f"nothing is wider than {width} px")
        assert words.is_visible()
        shown.until(lambda: words.bounding_box()["y"] >= shown.page.evaluate(UNDER), "it leaves the picture free")
    for state in ("hidden", "visible", "hidden"):
        shown.page.get_by_role("button", name="Menu").click()
        shown.page.get_by_role("button", name="What to look at").click()
        words.wait_for(state=state)
    shown.resize(1280)


def test_the_scrubber_has_rows_for_what_a_method_has(watch: Watch) -> None:
    """Error, losses and changes; a signal is neither hidden nor lost."""
    rows = "document.querySelector('.scrubber').dataset.rows ?? ''"
    shown = watch()
    shown.until(lambda: shown.page.evaluate(rows) == "flags error loss bands changes", "no plot is repeated")
    shown = watch(experiment="sine")
    shown.press("ArrowRight")
    shown.until(lambda: "error" in shown.page.evaluate(rows) and "bands" not in shown.page.evaluate(rows), "no bands")
    shown = watch(tracker="kalman")
    legend = shown.page.locator(".legend")
    shown.press("ArrowRight")
    shown.until(lambda: "estimate" in legend.inner_text(), "the legend names what is drawn")
    shown.until(lambda: "particles" not in legend.inner_text(), "and nothing else")
    assert "second run" not in legend.inner_text()


def test_the_switch_goes_through_light_and_dark_and_is_kept(gallery: Gallery) -> None:
    """The choice outlives a reload; without a choice the system decides."""
    page = gallery.page
    background = lambda: page.evaluate("getComputedStyle(document.body).backgroundColor")  # noqa: E731
    light = background()
    page.emulate_media(color_scheme="dark")
    gallery.until(lambda: background() != light, "the page follows the system into the dark")
    page.click("[data-role=theme]")
    gallery.until(lambda: background() == light, "light was chosen")
    page.reload()
    assert background() == light
    page.click("[data-role=theme]")
    page.emulate_media(color_scheme="light")
    gallery.until(lambda: background() != light, "dark was chosen")


def test_what_to_look_at_goes_by_itself(watch: Watch) -> None:
    """Once the run has played for five seconds of its own."""
    shown = watch(seed=0, frames=None)
    words = shown.page.locator(".look-at")
    words.wait_for()
    shown.page.select_option(".transport select", "0")
    shown.page.locator(".play").click()
    words.wait_for(state="hidden")
