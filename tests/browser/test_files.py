"""What can be taken away, brought in and fitted: models, a learned motion, a notebook, a picture, a film, noises."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pftrack.experiments import find
from pftrack.experiments.head.experiment import front
from pftrack.vision.face import FEATURES, mean_model, person
from pftrack.vision.model_files import as_json
from tests.browser.conftest import Complaints
from tests.browser.host import Server, until
from tests.browser.views import SessionPage

VALUES = {"hidden_weight": 0.0, "person": 102, "image_width_px": 320, "feature_noise_px": 3}


Watch = Callable[..., SessionPage]


def files_of(view: SessionPage) -> tuple[Any, Any]:
    """Open the files of a session: those to take away, and those to bring in."""
    view.menu("files")
    away, into = (view.page.locator(".files > section", has_text=title) for title in ("Export", "Import"))
    return away, into


def points_json(count: int) -> bytes:
    """A file of the first points of a person's face."""
    return as_json(FEATURES[:count], person(102).points_mm[:count])


def test_the_model_is_taken_away_and_brought_back(
    watch: Watch, server: Server, complaints: Complaints, tmp_path: Path
) -> None:
    """A click brings a file that another program reads; a model is begun with, and one of five points refused."""
    complaints.expected = ("422",)
    trimesh = pytest.importorskip("trimesh")
    view = watch(experiment="head", parameters=VALUES, frames=10)
    page, (away, into) = view.page, files_of(view)
    assert away.locator("[data-export]").count() == len(view.session["exports"])
    assert into.locator("[data-file]").count() == 2
    with page.expect_download() as waiting:
        page.click("[data-export=face-obj]")
    assert waiting.value.suggested_filename == "head-0.obj"
    place = tmp_path / "head-0.obj"
    waiting.value.save_as(place)
    read = trimesh.load(place, process=False, force="mesh")
    assert read.vertices.shape == front(mean_model()).vertices_mm.shape
    nose = mean_model()["nose"] * (1, -1, -1)
    assert np.linalg.norm(read.vertices - nose, axis=1).min() < 12
    picker = page.locator("[data-file=starting_face]")
    picker.set_input_files({"name": "prism.json", "mimeType": "application/json", "buffer": points_json(5)})
    page.get_by_text("expected a model of 11 points, got 5").wait_for()
    picker.set_input_files({"name": "me.json", "mimeType": "application/json", "buffer": points_json(11)})
    view.until(lambda: view.session["parameters"]["starting_face"], "the model is in force")
    view.go_to(2)
    assert server.export(view.id, "face-json").json()["frames"] == 2


def test_every_run_can_be_taken_away(watch: Watch) -> None:
    """As a notebook, as a picture of one plot, and as a film, which the server writes beside the session."""
    view = watch(experiment="sine")
    page, (away, into) = view.page, files_of(view)
    with page.expect_download() as waiting:
        away.locator("[data-export=notebook]").click()
    book = json.loads(Path(waiting.value.path()).read_text())
    assert any("Recipe.read" in "".join(cell["source"]) for cell in book["cells"])
    away.get_by_label("Which plot").select_option("error")
    with page.expect_download() as waiting:
        away.locator("[data-export=svg]").click()
    assert waiting.value.suggested_filename == "sine-0-error.svg"
    assert ">error</text>" in Path(waiting.value.path()).read_text()
    with page.expect_download() as waiting:
        away.locator("[data-export=mp4]").click()
    assert waiting.value.suggested_filename == "sine-0.mp4"
    until(lambda: away.locator("[data-writing]").count() == 0, "what was being written is there")
    assert into.count() == 0


def test_a_learned_motion_is_taken_away_and_brought_in(watch: Watch, complaints: Complaints, tmp_path: Path) -> None:
    """Too few frames teach nothing, and the page says so; more make a file, which is used, begun with, and dropped."""
    complaints.expected = ("409", "422")
    view = watch(tracker="guided", parameters={"occlusion_width_px": 0})
    page = view.page
    view.menu("files")
    page.click("[data-export=learned]")
    page.get_by_text("xpected at least 10 frames").wait_for()
    view.go_to(45)
    with page.expect_download() as waiting:
        page.click("[data-export=learned]")
    assert waiting.value.suggested_filename == "ball-45.learned.json"
    place = tmp_path / "mine.json"
    waiting.value.save_as(place)
    text = place.read_text()
    assert find("ball").guidance.parse(text).tracks == 1

    picker = page.locator("[data-file=learned]")
    foreign = text.replace('"ball"', '"fish"').encode()
    said = "it was learned in 'fish', and this is 'ball'"
    for name, content, words in (("none", b"\n", "none.json is empty"), ("fish", foreign, said)):
        picker.set_input_files({"name": f"{name}.json", "mimeType": "application/json", "buffer": content})
        page.get_by_text(words).wait_for()
    picker.set_input_files(str(place))
    page.get_by_text("mine.json is used from the next frame on").wait_for()
    page.get_by_role("button", name="Restart").click()
    view.until(lambda: view.session["timeline"][0]["values"].get("learned") == text, "it began with the file")
    view.stands_at(0)
    page.get_by_text("in use").wait_for()
    page.click("[data-drop=learned]")
    view.until(lambda: view.session["parameters"]["learned"] == "", "it is dropped")


OPEN = "dialog[open] .fit"


def test_noises_are_fitted_to_what_was_seen(watch: Watch) -> None:
    """What is found is told with both halves, and opens as a branch at the frame that was shown."""
    shown = watch(experiment="sine", tracker="kalman", parameters={"assumed_noise_sd": 0.4}, frames=121)
    page = shown.page
    page.locator(".controls").get_by_text("More", exact=True).click()
    begin = page.get_by_role("button", name="Fit noise to data")
    begin.click()
    page.get_by_role("button", name="Fit", exact=True).click()
    assert "at least 41 frames" in page.get_by_role("alert").inner_text()
    page.get_by_role("button", name="Cancel").click()

    shown.play_to_the_end()
    begin.click()
    dialog = page.locator(OPEN)
    dialog.get_by_role("checkbox").first.wait_for()
    assert dialog.get_by_role("checkbox", checked=True).count() == 2
    dialog.get_by_label("Process noise").uncheck()
    page.get_by_role("button", name="Fit", exact=True).click()
    dialog.locator(".fit-verdict").wait_for()
    assert dialog.locator(".fit-verdict").inner_text().startswith("Kept")
    rows = dialog.locator("tbody tr").all_inner_texts()
    assert [len(row.split("\t")) for row in rows] == [3, 1, 3, 3, 3, 3, 3, 1, 3, 3, 3, 3, 3]
    assert rows[0].startswith(("Assumed observation noise\t0.4\t0.1", "Assumed observation noise\t0.4\t0.0"))
    before, after = (float(it) for it in rows[-1].split("\t")[1:])
    assert rows[-1].startswith("NIS (0.67 to 1.39 is right)")
    assert before < 0.2
    assert 0.67 < after < 1.39
    page.get_by_role("button", name="Open as a branch").click()
    shown.until(lambda: shown.session["branch"] == "b1" and shown.position == 120, "the branch is there, as far")
    assert 0.08 < shown.session["parameters"]["assumed_noise_sd"] < 0.12
