"""Little room and darkness: everything stays readable."""

from typing import Any

from tests.browser.accessible import OVERFLOW
from tests.browser.conftest import Watch
from tests.browser.views import Gallery


def box(page: Any, selector: str) -> dict[str, float]:
    return page.locator(selector).bounding_box()


def test_from_a_wide_window_to_a_phone(watch: Watch) -> None:
    """Plots stand beside the scene where there is room, below it where there is less, and fit a phone."""
    shown = watch()
    page = shown.page
    assert not page.locator(".look-at").is_visible(), "only presets have words"
    scene, side, deck = box(page, ".scene"), box(page, ".side"), box(page, ".deck")
    assert scene["x"] + scene["width"] <= side["x"] + 1
    assert scene["width"] > 2 * side["width"]
    assert max(scene["y"] + scene["height"], side["y"] + side["height"]) <= deck["y"] + 1
    assert deck["y"] + deck["height"] <= 801
    is_cut = "(it) => it.scrollWidth > it.clientWidth"
    shown.until(lambda: not page.locator("h1").evaluate(is_cut), "the title is not cut")

    shown.resize(800, 700)
    shown.until(lambda: box(page, ".plots.sparklines")["y"] > box(page, ".scene")["y"] + 100, "the plots are under it")
    assert len({round(panel.bounding_box()["y"]) for panel in page.locator(".plots .figure-panel").all()}) == 1
    assert page.evaluate(OVERFLOW) <= 0
    for control in page.locator(".transport button:visible, .top button:visible").all():
        area = control.bounding_box()
        assert 0 <= area["x"] <= 800 - area["width"]
    # On a phone scene and transport are there, nothing is cut, and the frame's number is whole and covers nothing.
    shown.resize(390)
    shown.until(lambda: box(page, ".scene")["height"] >= 200, "the scene keeps its place")
    shown.until(lambda: page.evaluate("document.body.clientWidth") == 390, "it is narrower")
    assert page.locator(".play").is_visible()
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


UNDER = "document.querySelector('.flat-canvas').getBoundingClientRect().bottom"


def test_a_preset_leaves_room_and_says_what_it_is_about(watch: Watch) -> None:
    """Its sentence stands below the picture; the menu hides it, and so do five seconds of play.

    Its few controls come first, one fold has the others, and open folds stay open over a branch and a reload.
    """
    shown = watch(seed=0, frames=None)
    page = shown.page
    words = page.locator(".look-at")
    words.wait_for()
    assert "when the pillar hides the ball" in words.inner_text()
    for width in (390, 1280):
        shown.resize(width)
        shown.until(lambda: page.evaluate(OVERFLOW) <= 0, "nothing is wider than the window")
        assert words.is_visible()
        shown.until(lambda: words.bounding_box()["y"] >= page.evaluate(UNDER), "it leaves the picture free")
    for state in ("hidden", "visible"):
        page.get_by_role("button", name="Menu").click()
        page.get_by_role("button", name="What to look at").click()
        words.wait_for(state=state)

    panel = page.locator(".controls")
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
    page.select_option(".transport select", "0")
    page.locator(".play").click()
    words.wait_for(state="hidden")
    shown.command("pause")
    shown.go_to(4)
    shown.change(ball_radius_px=9)
    shown.until(lambda: len(shown.session["branches"]) == 2, "the change in the past is a branch")
    shown.until(lambda: radius.input_value() == "9", "the panel shows the new value")
    assert radius.is_visible()
    page.reload()
    shown.ready()
    radius.wait_for()
    panel.get_by_text("More", exact=True).click()
    page.reload()
    shown.ready()
    panel.get_by_text("More", exact=True).wait_for()
    assert not radius.is_visible()


def test_only_what_a_method_has_is_shown(watch: Watch) -> None:
    """A signal is neither hidden nor lost, and its Kalman filter has no particles: nothing of these is on the page."""
    shown = watch(experiment="sine", tracker="kalman")
    page = shown.page
    shown.press("ArrowRight")
    rows = "document.querySelector('.scrubber').dataset.rows ?? ''"
    shown.until(lambda: "error" in page.evaluate(rows) and "bands" not in page.evaluate(rows), "no bands")
    legend = page.locator(".legend")
    shown.until(lambda: "estimate" in legend.inner_text(), "the legend names what is drawn")
    shown.until(lambda: "particles" not in legend.inner_text(), "and nothing else")
    assert "second run" not in legend.inner_text()
    shown.until(lambda: shown.plots == ["error", "sigma", "innovation"], "only its plots are there")
    readings = page.locator(".readout dt:visible").all_inner_texts()
    assert {"estimate", "error", "sigma"} <= set(readings)
    assert not {"particles", "proposal"} & set(readings)
    assert page.get_by_label("Particles", exact=True).count() == 0


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
