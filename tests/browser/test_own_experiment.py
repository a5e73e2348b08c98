"""An experiment and a filter from outside the project work on the pages as the project's own do."""

from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import pytest

from pftrack.experiments import find
from pftrack.experiments.own.extension import example_of
from tests.browser.accessible import fits
from tests.browser.conftest import TOKEN, Watch
from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage
from tests.making import disc_film

NAME = "turning"


@pytest.fixture
def server(beside_others: Server) -> Server:
    """A server with the example, a package with a new mark and a broken package."""
    return beside_others


def test_the_gallery_shows_it_and_names_what_is_broken(gallery: Gallery, server: Server) -> None:
    """Its card leads to a session with its own slider and plots; a sentence names the broken package."""
    page = gallery.page
    card = gallery.card(NAME)
    picture = card.locator("img")
    gallery.until(lambda: picture.evaluate("(image) => image.naturalWidth") > 0, "its picture is loaded")
    assert "A turn out of sight" in card.inner_text()
    assert gallery.card("circled").locator(".thumb").count() == 0, "no picture, no empty field"
    sentence = "The experiment broken of a-broken-one 1.0 cannot be used: importing it raises RuntimeError."
    gallery.until(lambda: sentence in page.inner_text("[data-part=plugins]"), "the broken package is named")
    assert "in vain" not in page.inner_text("body")
    card.locator("h4 a").click()
    shown = SessionPage(page, server).ready()
    assert shown.session["recipe"]["experiment"] == NAME
    shown.until(lambda: (shown.position or 0) > 0, "it plays by itself")
    shown.command("pause")
    shown.go_to(20)
    page.evaluate("for (const fold of document.querySelectorAll('.panel-controls details')) fold.open = true")
    slider = page.get_by_label("Sharpest turn (deg)", exact=True).and_(page.locator("[type=range]"))
    slider.press("Home")
    shown.until(lambda: shown.session["parameters"]["sharpest_deg"] == 0, "the session has the slider's value")
    shown.until(lambda: shown.plots == ["error", "sigma", "ess", "turn"], "exactly its own plots are there")
    shown.until(lambda: shown.trace("turn band 0") is not None, "the interval is drawn")
    readings = page.locator(".readout dt:visible")
    shown.until(lambda: readings.all_inner_texts()[:2] == ["estimate", "error"], "its readings are there")


def test_a_link_without_its_token_asks_for_it(watch: Watch, server: Server, stranger: Any) -> None:
    """In another browser a wrong token is refused; with the right one the link opens the same run at the same frame."""
    shown = watch(tracker="condensation", parameters={"occlusion_width_px": 55})
    server.seek(shown.id, 12)
    shown.change(sample_count=200, tracker="apf")
    shown.go_to(40)
    shown.menu("share")
    stranger.goto(shown.page.input_value("[data-role=share-link]"))
    box, go = stranger.get_by_label("Token"), stranger.get_by_role("button", name="Open")
    go.wait_for()
    fits(stranger)
    box.fill("another one altogether")
    go.click()
    stranger.get_by_text("token is not valid").wait_for()
    box.fill(TOKEN)
    go.click()
    again = SessionPage(stranger, server).ready()
    again.stands_at(40)
    assert (again.id != shown.id, "token" in stranger.url) == (True, False)
    assert server.column(again.id, "error") == server.column(shown.id, "error")
    assert (again.session["tracker"], again.session["timeline"]) == ("apf", shown.session["timeline"])
    again.until(lambda: again.page.inner_text("h1") == shown.page.inner_text("h1"), "both pages have the same title")
    stranger.goto(f"{server.url}/")
    stranger.get_by_role("heading", name="Experiments").wait_for()


def test_its_mark_is_made_on_an_upload(gallery: Gallery, server: Server) -> None:
    """The page edits a circle by its description alone; a session begins with it."""
    page = gallery.page
    gallery.choose("walk.mp4", disc_film(30), "video/mp4")
    page.locator("#target-experiment").select_option("circled")
    page.locator("[data-mark=circle] .mark-surface").wait_for()
    go = page.locator("button:has-text('Track it')")
    assert go.is_disabled()
    gallery.has_picture()
    page.locator(".point").focus()
    for key in ("ArrowLeft", "ArrowUp"):
        page.keyboard.press(key)
    go.click()
    shown = SessionPage(page, server).ready()
    mark = shown.session["recipe"]["footage"]["mark"]
    assert (mark["kind"], mark["radius"]) == ("circle", 20)
    assert mark["centre"] == pytest.approx([78.5, 58.5], abs=0.5)
    shown.go_to(5)


def test_a_filter_is_changed_broken_and_mended(tmp_path: Path, stranger: Any, request: pytest.FixtureRequest) -> None:
    """Ctrl-S makes a branch; a mistake stops the run and is shown at its line; the mended filter continues."""
    text, file, page = example_of(find("ball")), tmp_path / "mine.py", stranger
    file.write_text(text)
    owner = Server(tmp_path, token=TOKEN, PFTRACK_FILTERS=str(file))
    request.addfinalizer(owner.stop)
    page.goto(f"{owner.url}/?{urlencode({'token': TOKEN})}")
    page.get_by_role("link", name="Open mine.py").wait_for()
    page.goto(f"{owner.url}/{owner.start_session(tracker='mine')['page']}")
    shown = SessionPage(page, owner).ready()
    shown.menu("code")
    field = page.locator(".cm-content")
    field.wait_for()
    assert "def propagate" in field.inner_text()
    state = page.locator(".editor-state")

    field.press("Control+End")
    page.keyboard.type("\ndef broken(:\n")
    state.get_by_text("Unsaved").wait_for()
    page.keyboard.press("Control+s")
    shown.until(lambda: "invalid syntax" in state.inner_text(), "the mistake is shown")
    assert f"Line {len(text.splitlines()) + 2}" in state.inner_text()
    page.locator(".cm-lint-marker-error").wait_for()
    assert file.read_text() != text

    def saves(text: str, words: str) -> None:
        page.keyboard.press("Control+a")
        page.keyboard.insert_text(text)
        page.keyboard.press("Control+s")
        shown.until(lambda: words in state.inner_text(), f"it says {words}")

    changed = text.replace("noise_px: float = 3.0", "noise_px: float = 6.0")
    saves(changed, "version 2")
    saves(text.replace("return np.log(0.02", "return np.log(-0.5"), "log_likelihood returned NaN")
    page.locator(".cm-lint-marker-error").wait_for()
    assert not shown.session["playing"]

    saves(f"{changed}\n", "version 4")
    page.get_by_role("button", name="Parameters").click()
    noise = page.get_by_role("spinbutton", name="Noise (px)")
    shown.until(lambda: noise.input_value() == "6", "its default is in force")
    page.get_by_role("button", name="Close the editor").click()
    page.locator(".editor").wait_for(state="hidden")
