"""Exports: other programs read the same names and numbers from every kind of file."""

import errno
import json
import os
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import av
import cv2
import nbformat
import numpy as np
import pandas as pd
import pytest
from PIL import Image
from pyarrow import parquet

from pftrack import __version__
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.refusal import ConflictError
from pftrack.experiments import find
from pftrack.output.exports import files as made
from pftrack.output.exports.formats import FORMATS, export_at, exporting, exports_of
from pftrack.runs.run import Run
from pftrack.runs.table import columns_in, table_of

FRAMES = 12


@pytest.fixture(scope="module")
def ball() -> Run:
    """Return a run that is computed to frame 11 of 30, with a change in between, at frame 4."""
    found = find("ball")
    changes = (Change(0, {"sample_count": 60}), Change(5, {"process_noise_px": 4}))
    run = Run(found, found.simulate(), seed=7, frames=30, timeline=changes)
    run.seek(FRAMES - 1)
    run.seek(4)
    return run


@pytest.fixture(scope="module")
def files(ball: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of all its exports, named `run.` and the suffix."""
    folder = tmp_path_factory.mktemp("exports")
    for kind in FORMATS:
        done = ball.export(folder / f"run.{kind.suffix}")
        assert (done.frames, done.complete) == ("frames 0 to 11, 12 of 30", False)
        assert all(file.stat().st_size > 0 for file in done.files)
    assert ball.position == 4
    return folder


def test_particles_come_as_arrays(ball: Run, files: Path) -> None:
    """All frames have particles with weights that sum to 1, and the file has the manifest."""
    with np.load(files / "run.cloud.npz") as arrays:
        assert arrays["cloud"].shape == (FRAMES, 60, ball.current.state.particles.states.shape[1])
        assert np.exp(arrays["cloud_log_weights"]).sum(axis=1) == pytest.approx(1)
        assert arrays["cloud_ancestors"].shape == (FRAMES, 60)
        assert json.loads(str(arrays["manifest"]))["recipe"]["experiment"] == "ball"
    found = find("ball")
    single = Run(found, found.simulate(), tracker="kalman", frames=2)
    with pytest.raises(ConflictError, match="kalman has no particles"):
        single.export(files / "none.cloud.npz")


def manifests(folder: Path) -> dict[str, Any]:
    """Return the manifests of all files that have one."""
    texts = {name: (folder / f"run.{name}.manifest.json").read_text() for name in ("csv", "jsonl")}
    with av.open(str(folder / "run.mp4")) as film:
        texts["mp4"] = film.metadata["comment"]
    with np.load(folder / "run.npz") as arrays:
        texts["npz"] = str(arrays["manifest"])
    with Image.open(folder / "run.gif") as gif, Image.open(folder / "run.png") as png:
        texts |= {"gif": gif.info["comment"], "png": png.text["pftrack"]}  # type: ignore[attr-defined] - of a PNG
    texts["parquet"] = parquet.read_metadata(folder / "run.parquet").metadata[b"pftrack"]
    svg = (folder / "run.svg").read_text().partition("<dc:description>")[2]
    texts["svg"] = svg.partition("</dc:description>")[0].replace("&quot;", '"')
    return {name: json.loads(text) for name, text in texts.items()}


def test_tables_have_the_same_columns_and_numbers(ball: Run, files: Path) -> None:
    """CSV, Parquet, NPZ and JSON Lines have the run's rows to the bit; Arrow has titles and units as metadata."""
    frames = {
        "csv": pd.read_csv(files / "run.csv"),
        "parquet": pd.read_parquet(files / "run.parquet"),
        "jsonl": pd.read_json(files / "run.jsonl", lines=True, precise_float=True),
    }
    with np.load(files / "run.npz") as arrays:
        frames["npz"] = pd.DataFrame({name: arrays[name] for name in arrays.files if name != "manifest"})
    names = [column.name for column in columns_in(ball)]
    assert {"estimate_0", "estimate_1", "error", "series_ess", "series_samples_observation"} <= set(names)
    rows = ball.diagnostics
    for form, table in frames.items():
        assert list(table.columns) == names, form
        assert table["frame"].tolist() == list(range(FRAMES)), form
        assert table[["estimate_0", "estimate_1"]].to_numpy().tolist() == [list(row.estimate) for row in rows], form
        assert table["series_ess"].tolist() == [row.number("ess") for row in rows], form
        assert table["lost"].tolist() == [float(row.lost or 0) for row in rows], form
    assert all(frames["csv"].select_dtypes("object").columns == [])
    told = {b"title": b"distance of the estimate from the truth", b"unit": b"px"}
    assert table_of(ball).schema.field("error").metadata == told


def test_every_format_carries_the_same_manifest(ball: Run, files: Path) -> None:
    """It has version, recipe, hashes and units; its recipe gives the same estimates."""
    found = manifests(files)
    told = found["csv"]
    assert all(each == told for each in found.values())
    assert (told["pftrack"], told["frames"]) == (__version__, {"computed": FRAMES, "of": 30, "rate_hz": 30.0})
    columns = {column["name"]: column for column in told["columns"]}
    assert (columns["estimate_1"]["unit"], columns["step_ms"]["unit"]) == ("px", "ms")
    assert all(column["title"] for column in columns.values())
    recipe = Recipe.read(told["recipe"])
    assert recipe == Recipe.read(json.loads((files / "run.json").read_text()))
    again = Run.from_recipe(recipe, ball.experiment, ball.experiment.simulate())
    again.seek(FRAMES - 1)
    assert again.estimates_sha256 == told["sha256"]["estimates"] == ball.estimates_sha256


def test_films_have_a_picture_for_each_frame(ball: Run, files: Path) -> None:
    """OpenCV reads every frame of the MP4 at the drawing's size; the GIF has every second one at the same speed."""
    reader, pictures = cv2.VideoCapture(str(files / "run.mp4")), []
    while (read := reader.read())[0]:
        pictures.append(read[1])
    assert len(pictures) == FRAMES
    assert np.ptp([picture.mean() for picture in pictures]) > 0
    with Image.open(files / "run.gif") as gif:
        assert (gif.n_frames, gif.info["duration"], gif.info["loop"]) == (FRAMES // 2, 70, 0)  # type: ignore[attr-defined]
        shown = np.asarray(gif.convert("RGB"), float)
    assert shown.shape == pictures[0].shape
    assert np.abs(shown - made._picture(ball.branch(0), 0)).mean() < 4


def test_pictures_of_plots_are_at_print_size(ball: Run, files: Path) -> None:
    """A PNG has 300 dpi over two columns, 7.2 inches; an SVG has text with titles and units."""
    with Image.open(files / "run.png") as picture:
        assert picture.size[0] == 2160
        assert picture.info["dpi"][0] == pytest.approx(300, abs=0.1)
    svg = (files / "run.svg").read_text()
    assert all(f">{words}</text>" in svg for words in ("error, px", "sigma, px", "ESS", "proposals", "frame"))


def test_documents_name_version_and_sources(files: Path) -> None:
    """The citation has the version and the sources; the notebook is valid."""
    bibtex = (files / "run.bib").read_text()
    assert f"version = {{{__version__}}}" in bibtex
    assert "@phdthesis{bando2007," in bibtex
    nbformat.validate(nbformat.read(files / "run.ipynb", as_version=4))


def test_the_same_run_has_the_same_file(ball: Run, files: Path, tmp_path: Path) -> None:
    """No file depends on the time of writing."""
    for suffix in ("csv", "parquet", "svg"):
        ball.export(tmp_path / f"again.{suffix}")
        assert (tmp_path / f"again.{suffix}").read_bytes() == (files / f"run.{suffix}").read_bytes()


@pytest.mark.parametrize("name", ["ball", "head", "trajectories"])
def test_names_of_columns_and_suffixes_are_unique(name: str) -> None:
    """Names of columns are also identifiers, so that every program can read them."""
    found = find(name)
    run = Run(found, found.simulate(), frames=2)
    names = [column.name for column in columns_in(run)]
    assert len(set(names)) == len(names)
    assert all(each.isidentifier() for each in names)
    offered = exports_of(found)
    assert len({one.suffix for one in offered}) == len({one.name for one in offered}) == len(offered)


@pytest.mark.parametrize(
    ("place", "plot", "words"),
    [
        ("run.docx", None, "can be exported as .csv, .parquet, .npz, .cloud.npz, .jsonl"),
        ("run.coco.json", None, "would hold boxes (Believed boxes, COCO video JSON), and runs of ball have none"),
        ("run.png", "eror", "has no plot 'eror', only error, ess, sigma, proposals"),
        ("run.csv", "error", "a plot can be written as a picture, .png or .svg; got .csv"),
        ("nowhere/run.csv", None, "nowhere does not exist"),
    ],
)
def test_an_impossible_export_is_refused(ball: Run, tmp_path: Path, place: str, plot: str | None, words: str) -> None:
    """The sentence names the possible ones; no file is left."""
    with pytest.raises(ConflictError) as refused:
        ball.export(tmp_path / place, plot=plot)
    assert words in str(refused.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), r"old\.mp4 cannot be written: No space left on device; m"),
        (OSError(errno.EACCES, "Failed to open local file '.old.mp4.part'"), r"Permission denied: '.*/old\.mp4'"),
    ],
)
def test_a_failed_export_leaves_the_old_file(
    ball: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: OSError, told: str
) -> None:
    """No other file is left, and the run stays at its frame."""
    place = tmp_path / "old.mp4"
    place.write_text("old")
    steps = exporting(ball, place, export_at(ball.experiment, place))
    assert next(steps) == (1, FRAMES)
    steps.close()  # type: ignore[attr-defined] - it is a generator
    monkeypatch.setattr("pftrack.output.exports.formats.settle", Mock(side_effect=error))
    with pytest.raises((ConflictError, PermissionError), match=told):
        ball.export(place)
    assert [(each.name, each.read_text()) for each in tmp_path.iterdir()] == [("old.mp4", "old")]
    assert ball.position == 4
