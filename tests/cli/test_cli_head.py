"""The head from the command line: series, truth, points, and refusals."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.vision.face import FEATURES
from pftrack.vision.film import FilmWriter
from tests.cli.commands import Ask, Call, refused
from tests.experiments.head.heads import pictures, simulated

COUNT, WIDTH = 12, 320


def film(place: Path, shown: list[Any]) -> Path:
    with FilmWriter(place, 30.0) as writer:
        for picture in shown:
            writer.write(picture)
    return place


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a film of the simulated driver who turns, with a table of the truth."""
    folder = tmp_path_factory.mktemp("head")
    film(folder / "clip.mp4", pictures(COUNT, width=WIDTH, every=2))
    with (folder / "truth.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["frame", "yaw_deg", "pitch_deg", "roll_deg", "note"])
        for index, frame in enumerate(simulated(COUNT, width=WIDTH, every=2)):
            assert frame.target is not None
            turn = rotation(frame.target.position)
            ahead, across = turn @ [0, 0, -1], turn @ [1, 0, 0]
            pose = np.arctan2(ahead[0], -ahead[2]), np.arcsin(-ahead[1]), np.arctan2(across[1], across[0])
            # A constant offset, like that of a reference from another model of faces, must be subtracted.
            table.writerow([index, *np.add(np.rad2deg(pose), (3.0, -13.0, 2.0)), ""])
    return folder / "clip.mp4"


def test_a_clip_of_a_face_gives_yaw_pitch_and_roll(ask: Ask, clip: Path) -> None:
    """Every frame has three angles; errors are relative to frame 0."""
    said = ask("run", "head", "--video", clip, "--truth", clip.with_name("truth.csv"), "--seed", 2)
    with clip.with_name("truth.csv").open() as file:
        truth = list(csv.DictReader(file))
    assert (said["frames"], said["labelled_frames"], said["tracked_share"]) == (COUNT, COUNT, 1.0)
    for name in ("yaw", "pitch", "roll"):
        found = np.array(said[f"{name}_deg"])
        wanted = np.array([float(row[f"{name}_deg"]) for row in truth])
        error = np.abs((found - found[0]) - (wanted - wanted[0])).mean()
        assert said["mean_abs_error_deg"][name] == pytest.approx(error, abs=1e-6)
        assert error < 6


def test_marked_points_are_used_and_replayed(ask: Ask, clip: Path, tmp_path: Path) -> None:
    """Tracking begins at the points of a file, and a saved run contains them."""
    first = simulated(1, width=WIDTH)[0].target
    assert first is not None
    assert first.landmarks is not None
    points = dict(zip(FEATURES, first.landmarks.points_px.tolist(), strict=True))
    (tmp_path / "points.json").write_text(json.dumps(points))
    rows = "".join(f"{name},{x},{y}\n" for name, (x, y) in points.items())
    (tmp_path / "points.csv").write_text("name,x,y\n" + rows)
    hashes = set()
    for name in ("points.json", "points.csv"):
        saved = tmp_path / f"{name}.pft"
        ran = ask("run", "head", "--video", clip, "--points", tmp_path / name, "--frames", 6, "--out", saved)
        hashes.add(ran["estimates_sha256"])
        assert ask("replay", saved)["same_as_saved"] is True
    assert len(hashes) == 1


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        ("head --video {clip} --points none.json", 2, "the file none.json does not exist"),
        ("head --video {clip} --truth {boxes}", 1, "expected the columns frame, yaw_deg"),
        ("head --video {clip} --box 0,0,30,30", 1, "face"),
        ("head --video {clip} --preset sunglasses", 2, "belongs to the simulated scene: a recording has no sunglasses"),
        ("head --export face.stl", 2, ".obj, .points.json, .tracks.csv, .learned.json; got"),
        ("ball --export face.obj", 2, "a run of ball can be exported as .csv, .parquet, "),
    ],
)
def test_wrong_use_of_the_head_is_one_line(
    call: Call, clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: str, status: int, message: str
) -> None:
    """A box without a face is refused with one sentence; an export with the possible suffixes."""
    monkeypatch.chdir(tmp_path)
    places = {"clip": clip, "boxes": tmp_path / "boxes.csv"}
    places["boxes"].write_text("frame,x,y,w,h\n0,1,2,3,4\n")
    refused(call("run", *arguments.format(**places).split()), status, message)


def test_the_model_of_the_last_frame_is_written(call: Call, tmp_path: Path) -> None:
    """`--export` writes several files by suffix; a replayed run writes the same."""
    places = [tmp_path / f"face.{suffix}" for suffix in ("obj", "points.json")]
    wanted = [part for place in places for part in ("--export", place)]
    values = ("--set", "hidden_weight=0", "--set", "image_width_px=320")
    assert call("run", "head", "--frames", 4, *values, *wanted, "--out", tmp_path / "run.pft")[0] == 0
    assert all(place.stat().st_size > 500 for place in places)
    assert json.loads(places[-1].read_text())["frames"] == 3
    again = tmp_path / "again.obj"
    assert call("replay", tmp_path / "run.pft", "--export", again)[0] == 0
    assert again.read_bytes() == places[0].read_bytes()
