"""Files of a session: exported models, a learned motion, a notebook, a picture, a film; and fitted noises."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pftrack.experiments import find
from pftrack.experiments.head.experiment import front
from pftrack.vision.face import FEATURES, mean_model, person
from pftrack.vision.model_files import as_json
from tests.browser.conftest import Complaints, Watch
from tests.browser.host import Server
from tests.browser.views import SessionPage

VALUES = {"hidden_weight": 0.0, "person": 102, "image_width_px": 320, "feature_noise_px": 3}


def files_of(view: SessionPage) -> tuple[Any, Any]:
    """Open the files of a session, and return the places of exports and of imports."""
    view.menu("files")
    away, into = (view.page.locator(".files > section", has_text=title) for title in ("Export", "Import"))
    return away, into


def points_json(count: int) -> bytes:
    """A file of the first points of a person's face."""
    return as_json(FEATURES[:count], person(102).points_mm[:count])


def test_a_model_is_exported_and_imported(watch: Watch, server: Server, complaints: Complaints, tmp_path: Path) -> None:
    """Another program reads the exported file; a run begins with an imported model; one of five points is refused."""
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


def test_every_run_has_exports_and_its_learned_motion_is_used(watch: Watch, complaints: Complaints) -> None:
    """A notebook, a picture of one plot and a film are downloaded; so is a learned motion once there are frames.

    Imported, it is used, begun with, and dropped; a motion of another experiment is refused.
    """
    complaints.expected = ("409", "422")
    view = watch(tracker="guided", parameters={"occlusion_width_px": 0}, frames=46)
    page, (away, _) = view.page, files_of(view)

    def exported(name: str) -> tuple[str, Path]:
        with page.expect_download() as waiting:
            away.locator(f"[data-export={name}]").click()
        return waiting.value.suggested_filename, Path(waiting.value.path())

    _, path = exported("notebook")
    assert any("Recipe.read" in "".join(cell["source"]) for cell in json.loads(path.read_text())["cells"])
    away.get_by_label("Which plot").select_option("error")
    name, path = exported("svg")
    assert (name, ">error, px</text>" in path.read_text()) == ("ball-0-error.svg", True)
    assert exported("mp4")[0] == "ball-0.mp4"
    page.click("[data-export=learned]")
    page.get_by_text("xpected at least 10 frames").wait_for()
    view.go_to(45)
    name, path = exported("learned")
    text = path.read_text()
    assert (name, find("ball").guidance.parse(text).tracks) == ("ball-45.learned.json", 1)

    picker = page.locator("[data-file=learned]")
    foreign = text.replace('"ball"', '"fish"').encode()
    picker.set_input_files({"name": "fish.json", "mimeType": "application/json", "buffer": foreign})
    page.get_by_text("it was learned in 'fish', and this is 'ball'").wait_for()
    picker.set_input_files({"name": "mine.json", "mimeType": "application/json", "buffer": text.encode()})
    page.locator(".toast", has_text="mine.json is used from the next").get_by_role("button", name="Restart").click()
    view.until(lambda: view.session["timeline"][0]["values"].get("learned") == text, "it began with the file")
    page.get_by_text("in use").wait_for()
    page.click("[data-drop=learned]")
    view.until(lambda: view.session["parameters"]["learned"] == "", "it is dropped")


def test_noises_are_fitted_to_data(watch: Watch) -> None:
    """The result is shown with both halves, and opens as a branch at the shown frame."""
    shown = watch(experiment="sine", tracker="kalman", parameters={"assumed_noise_sd": 0.4}, frames=121)
    page = shown.page
    page.locator(".controls").get_by_text("More", exact=True).click()
    begin = page.get_by_role("button", name="Fit noise to data")
    begin.click()
    page.get_by_role("button", name="Fit", exact=True).click()
    assert "at least 41 frames" in page.get_by_role("alert").inner_text()
    page.get_by_role("button", name="Cancel").click()

    shown.go_to(120)
    begin.click()
    dialog = page.locator("dialog[open] .fit")
    dialog.get_by_role("checkbox").first.wait_for()
    assert dialog.get_by_role("checkbox", checked=True).count() == 2
    dialog.get_by_label("Process noise").uncheck()
    page.get_by_role("button", name="Fit", exact=True).click()
    dialog.locator(".fit-verdict").wait_for()
    assert dialog.locator(".fit-verdict").inner_text().startswith("Kept")
    first, *_, last = dialog.locator("tbody tr").all_inner_texts()
    assert first.startswith(("Assumed observation noise\t0.4\t0.1", "Assumed observation noise\t0.4\t0.0"))
    assert last.startswith("NIS (0.67 to 1.39 is right)")
    page.get_by_role("button", name="Open as a branch").click()
    shown.until(lambda: shown.session["branch"] == "b1" and shown.position == 120, "the branch is there, as far")
    assert 0.08 < shown.session["parameters"]["assumed_noise_sd"] < 0.12
