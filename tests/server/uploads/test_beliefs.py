"""Uploaded recordings of beliefs and tables of tracks become sessions, as videos do."""

import json
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

import pftrack
from tests.server.follow_jobs import ended, taken
from tests.server.host import error_of, post, steer
from tests.server.uploads.test_uploads import accepted, columns_of, send, video
from tests.server.work.test_explorations import explore
from tests.tracks import table

FRAMES = 12


def refusal(client: httpx.Client, wish: dict[str, Any]) -> str:
    return error_of(client.post("/api/v1/sessions", json=wish), 422)["message"]


def recording(folder: Path) -> bytes:
    """Return the file in which a loop recorded its beliefs on a clip, with the truth."""
    clip = folder / "walk.mp4"
    clip.write_bytes(video(FRAMES))
    rng = np.random.default_rng(0)
    with pftrack.record(folder / "mine.pft", source=clip) as rec:
        for t in range(FRAMES):
            true_box = (10 + t if t < 6 else 60, 10 + t, 21, 21)
            rec(t, particles=rng.standard_normal((80, 4)) + 20.0 + t, box=(10 + t, 10 + t, 21, 21), true_box=true_box)
    return (folder / "mine.pft").read_bytes()


def test_a_recording_becomes_a_session(client: httpx.Client, tmp_path: Path) -> None:
    """Its clip can be seen before, and its numbers are those of the loop; a truncated file is refused."""
    whole = recording(tmp_path)
    assert "recording" in error_of(send(client, ("mine.pft", whole[:200])), 422)["message"]
    upload = accepted(client, ("mine.pft", whole))
    assert (upload["kind"], upload["frames"], upload["warnings"]) == ("beliefs", FRAMES, [])
    assert client.get(f"/api/v1/uploads/{upload['id']}/frames/3.jpg").content.startswith(b"\xff\xd8")
    (able,) = [each["id"] for each in client.get("/api/v1/experiments").json() if "beliefs" in each["footage"]]
    session = post(client, "sessions", recipe={"experiment": able, "footage": {"start": 2}}, upload=upload["id"])
    assert session["frames"] == FRAMES - 2
    columns = columns_of(client, session, FRAMES - 3)
    assert columns["estimate"][-1] == pytest.approx([20 + FRAMES - 1] * 2, abs=0.5)
    assert columns["series"][-1]["particles"] == 80
    assert session["trackers"][0]["replays"] is True
    told = ended(client, explore(client, session["id"], kind="what-if"))
    assert (told["state"], "shown as it was recorded" in told["error"]) == ("failed", True)


def test_a_person_says_what_the_columns_are(client: httpx.Client) -> None:
    """A table with unknown column names is refused, shown, and accepted once its columns are named."""
    table = b"bild;nummer;links;oben;breit;hoch\n" + b"".join(b"%d;4;%d;20;30;40\n" % (t, 10 + t) for t in range(5))
    error_of(send(client, ("walk.csv", table)), 422)
    seen = client.post("/api/v1/uploads/table", json={"text": table.decode()}).json()
    assert [";".join(row) for row in (seen["header"], *seen["rows"])][:2] == table.decode().split("\n")[:2]
    assert [each["name"] for each in seen["meanings"]][:3] == ["frame", "target", "x"]
    columns = {"columns": json.dumps({"frame": 0, "target": 1, "x": 2, "y": 3, "w": 4, "h": 5})}
    files = [("file", ("walk.mp4", video(5))), ("file", ("walk.csv", table))]
    for sent, name in ((files[1:], "walk.csv"), (files, "walk.csv on walk.mp4")):
        upload = client.post("/api/v1/uploads", params=columns, files=sent).json()
        assert (upload["name"], upload["kind"], upload["frames"]) == (name, "beliefs", 5)
    wrong = client.post("/api/v1/uploads", params={"columns": json.dumps({"frame": 0})}, files=files[1:])
    assert "Expected the frame" in error_of(wrong, 422)["message"]


def test_results_clip_and_truth_come_together(client: httpx.Client) -> None:
    """They are one upload, with the pictures of the clip and errors against the truth; one frame has no result."""
    rows = [f"{t + 1},4,{11 + t},21,30,40,1,-1,-1,-1" for t in range(FRAMES)]
    missed = rows.pop(3)
    files = [("walk.mp4", video(FRAMES)), ("det.txt", "\n".join(rows).encode())]
    truth = ("gt.txt", "\n".join(row.replace(",21,", ",22,") for row in [*rows, missed]).encode())
    upload = accepted(client, *files, truth)
    assert (upload["kind"], upload["frames"], upload["name"]) == ("beliefs", FRAMES, "det.txt on walk.mp4")
    assert client.get(f"/api/v1/uploads/{upload['id']}/frames/3.jpg").content.startswith(b"\xff\xd8")
    session = post(client, "sessions", recipe={"experiment": "recorded", "footage": {}}, upload=upload["id"])
    assert columns_of(client, session, FRAMES - 1)["error"][-1] == pytest.approx(1.0)
    assert "call the truth gt.txt" in error_of(send(client, *files, ("other.txt", truth[1])), 422)["message"]


def test_a_table_becomes_a_session(client: httpx.Client) -> None:
    """A session follows the points of a table without a mark; its frames can be seen.

    A point keeps its name, even one that is called as a file on the server's disk. Tracks, pictures and marks are
    refused where they do not fit.
    """
    rows = [line.split(",") for line in table().splitlines()]
    never = [",".join([frame, "000000", *[""] * (len(rows[0]) - 2)]) for frame in {row[0] for row in rows[1:]}]
    tracks = accepted(client, ("prism.csv", "\n".join([table().rstrip("\n"), *never]).encode()))
    assert (tracks["name"], tracks["kind"], tracks["frames"]) == ("prism.csv", "tracks", 26)
    assert "Never seen and left out: 000000." in tracks["warnings"]
    assert client.get(f"/api/v1/uploads/{tracks['id']}/frames/3.jpg").content.startswith(b"\xff\xd8")

    def wish(upload: dict[str, Any], experiment: str = "structure", **footage: Any) -> dict[str, Any]:
        return {"recipe": {"experiment": experiment, "footage": footage}, "upload": upload["id"]}

    for experiment, words in (("ball", "must be pictures"), ("head", "must be pictures"), ("sine", "no recording")):
        assert words in refusal(client, wish(tracks, experiment))
    assert "must be tracks" in refusal(client, wish(accepted(client, ("walk.mp4", video(4)))))
    assert refusal(client, wish(tracks, mark={"kind": "box", "x": 1, "y": 1, "width": 9, "height": 9}))
    error_of(client.get(f"/api/v1/uploads/{tracks['id']}/mark", params={"experiment": "head", "frame": 0}), 422)
    session = post(client, "sessions", **wish(tracks, start=2))
    assert (session["frames"], session["recipe"]["footage"]["start"]) == (24, 2)
    columns = columns_of(client, session, 23)
    assert len(columns["estimate"][23]) == 3 * 14
    strengths = [row.get("depth_strength") for row in columns["series"]]
    assert (strengths[10], strengths[23] > 5) == (None, True)


def test_a_path_is_smoothed_but_is_not_a_shape(client: httpx.Client) -> None:
    """A table of one point becomes a session that follows it, gaps included; a shape needs more points."""
    rows = "".join(f"{3 * n},{'' if n == 5 else n * n / 9}\n" for n in range(20))
    upload = accepted(client, ("mouse.csv", ("x,y\n" + rows).encode()))["id"]
    wish = {"recipe": {"experiment": "structure", "footage": {}}, "upload": upload}
    assert "must be the tracks of 4 to 100 points" in refusal(client, wish)
    session = post(client, "sessions", recipe={"experiment": "trajectories", "footage": {}}, upload=upload)["id"]
    steer(client, session, "seek", frame=19)
    rows = taken(client, session, "paths").text.splitlines()
    assert (len(rows), rows[0].split(",")[:4]) == (21, ["frame", "track", "x", "y"])
    assert rows[6].startswith("5,1,,,")
