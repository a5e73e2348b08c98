"""A learned motion as a person meets it: taken away from the run that is open, brought in again, and dropped."""

from pathlib import Path
from typing import Any

from pftrack.experiments import find
from tests.browser.conftest import Complaints
from tests.browser.host import Server
from tests.browser.views import SessionPage


def test_a_learned_motion_is_taken_away_and_brought_in(
    unchosen: Any, server: Server, complaints: Complaints, tmp_path: Path
) -> None:
    """Too few frames teach nothing, and the page says so; more make a file, which is used, begun with, and dropped."""
    complaints.expected = ("409", "422")
    session = server.start_session(tracker="guided", parameters={"occlusion_width_px": 0})
    unchosen.goto(session["page"])
    view = SessionPage(unchosen, server).ready()
    view.menu("files")
    unchosen.click("[data-export=learned]")
    unchosen.get_by_text("xpected at least 10 frames").wait_for()
    server.seek(view.id, 45)
    view.stands_at(45)
    with unchosen.expect_download() as waiting:
        unchosen.click("[data-export=learned]")
    assert waiting.value.suggested_filename == "ball-45.learned.json"
    place = tmp_path / "mine.json"
    waiting.value.save_as(place)
    text = place.read_text()
    guidance = find("ball").guidance
    assert guidance.parse(text).tracks == 1

    picker = unchosen.locator("[data-file=learned]")
    foreign = text.replace('"ball"', '"fish"').encode()
    picker.set_input_files({"name": "none.json", "mimeType": "application/json", "buffer": b"\n"})
    unchosen.get_by_text("none.json is empty").wait_for()
    picker.set_input_files({"name": "fish.json", "mimeType": "application/json", "buffer": foreign})
    unchosen.get_by_text("it was learned in 'fish', and this is 'ball'").wait_for()
    picker.set_input_files(str(place))
    unchosen.get_by_text("mine.json is used from the next frame on").wait_for()
    unchosen.get_by_role("button", name="Restart").click()
    view.until(lambda: view.session["timeline"][0]["values"].get("learned") == text, "it began with the file")
    view.stands_at(0)
    unchosen.get_by_text("in use").wait_for()
    unchosen.click("[data-drop=learned]")
    view.until(lambda: view.session["parameters"]["learned"] == "", "it is dropped")
