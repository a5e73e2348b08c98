"""What can be taken away and brought in: a face model, a notebook, a picture, a film."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pftrack.experiments.head.experiment import front
from pftrack.vision.face import FEATURES, mean_model, person
from pftrack.vision.model_files import as_json
from tests.browser.conftest import Complaints
from tests.browser.host import Server, until
from tests.browser.views import SessionPage

VALUES = {"hidden_weight": 0.0, "person": 102, "image_width_px": 320, "feature_noise_px": 3}


def points_json(count: int) -> bytes:
    """A file of the first points of a person's face."""
    return as_json(FEATURES[:count], person(102).points_mm[:count])


def test_the_model_is_taken_away_and_brought_back(
    unchosen: Any, server: Server, complaints: Complaints, tmp_path: Path
) -> None:
    """A click brings a file that another program reads; a model is begun with, and one of five points refused."""
    complaints.expected = ("422",)
    trimesh = pytest.importorskip("trimesh")
    session = server.start_session(experiment="head", parameters=VALUES, frames=10)
    unchosen.goto(session["page"])
    view = SessionPage(unchosen, server).ready()
    view.menu("files")
    away, into = (unchosen.locator(".files > section", has_text=title) for title in ("Export", "Import"))
    assert away.locator("[data-export]").count() == len(session["exports"])
    assert into.locator("[data-file]").count() == 2
    with unchosen.expect_download() as waiting:
        unchosen.click("[data-export=face-obj]")
    place = tmp_path / waiting.value.suggested_filename
    waiting.value.save_as(place)
    assert place.name == "head-0.obj"
    read = trimesh.load(place, process=False, force="mesh")
    assert read.vertices.shape == front(mean_model()).vertices_mm.shape
    nose = mean_model()["nose"] * (1, -1, -1)
    assert np.linalg.norm(read.vertices - nose, axis=1).min() < 12
    picker = unchosen.locator("[data-file=starting_face]")
    picker.set_input_files({"name": "prism.json", "mimeType": "application/json", "buffer": points_json(5)})
    unchosen.get_by_text("expected a model of 11 points, got 5").wait_for()
    picker.set_input_files({"name": "me.json", "mimeType": "application/json", "buffer": points_json(11)})
    view.until(lambda: view.session["parameters"]["starting_face"], "the model is in force")
    server.seek(view.id, 2)
    view.stands_at(2)
    assert server.export(view.id, "face-json").json()["frames"] == 2


def test_every_run_can_be_taken_away(unchosen: Any, server: Server) -> None:
    """As a notebook, as a picture of one plot, and as a film, which the server writes beside the session."""
    session = server.start_session(experiment="sine")
    unchosen.goto(session["page"])
    SessionPage(unchosen, server).ready().menu("files")
    away, into = (unchosen.locator(".files > section", has_text=title) for title in ("Export", "Import"))
    with unchosen.expect_download() as waiting:
        away.locator("[data-export=notebook]").click()
    book = json.loads(Path(waiting.value.path()).read_text())
    assert any("Recipe.read" in "".join(cell["source"]) for cell in book["cells"])
    away.get_by_label("Which plot").select_option("error")
    with unchosen.expect_download() as waiting:
        away.locator("[data-export=svg]").click()
    assert waiting.value.suggested_filename == "sine-0-error.svg"
    assert ">error</text>" in Path(waiting.value.path()).read_text()
    with unchosen.expect_download() as waiting:
        away.locator("[data-export=mp4]").click()
    assert waiting.value.suggested_filename == "sine-0.mp4"
    until(lambda: away.locator("[data-writing]").count() == 0, "what was being written is there")
    assert into.count() == 0
