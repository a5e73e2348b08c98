"""Uploaded recordings of beliefs: through the door of videos, to a session like any."""

import json
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

import pftrack
from tests.server.follow_jobs import ended
from tests.server.host import error_of, steer
from tests.server.uploads.test_uploads import send, video
from tests.server.work.test_explorations import explore
from tests.session_requests import session_request

FRAMES = 12


@pytest.fixture
def recording(tmp_path: Path) -> bytes:
    """What a loop has said of a clip."""
    clip = tmp_path / "walk.mp4"
    clip.write_bytes(video(FRAMES))
    rng = np.random.default_rng(0)
    with pftrack.record(tmp_path / "mine.pft", source=clip) as rec:
        for t in range(FRAMES):
            true_box = (10 + t if t < 6 else 60, 10 + t, 21, 21)
            rec(t, particles=rng.standard_normal((80, 4)) + 20.0 + t, box=(10 + t, 10 + t, 21, 21), true_box=true_box)
    return (tmp_path / "mine.pft").read_bytes()


def test_a_recording_becomes_a_session(client: httpx.Client, recording: bytes) -> None:
    """Its clip can be seen before, and its numbers are those of the loop."""
    upload = send(client, ("mine.pft", recording)).json()
    assert (upload["kind"], upload["frames"], upload["warnings"]) == ("beliefs", FRAMES, [])
    assert client.get(f"/api/v1/uploads/{upload['id']}/frames/3.jpg").content.startswith(b"\xff\xd8")
    listed = client.get("/api/v1/experiments").json()
    (able,) = [each["id"] for each in listed if "beliefs" in each["footage"]]
    wish: dict[str, Any] = {"recipe": {"experiment": able, "footage": {"start": 2}}, "upload": upload["id"]}
    answer = client.post("/api/v1/sessions", json=session_request(wish))
    assert answer.status_code == 201, answer.text
    session = answer.json()
    assert session["frames"] == FRAMES - 2
    steer(client, session["id"], "seek", frame=FRAMES - 3)
    columns = client.get(f"/api/v1/sessions/{session['id']}/diagnostics").json()["columns"]
    assert columns["estimate"][-1] == pytest.approx([20 + FRAMES - 1] * 2, abs=0.5)
    assert columns["series"][-1]["particles"] == 80
    assert session["trackers"][0]["replays"] is True
    told = ended(client, explore(client, session["id"], kind="what-if"))
    assert (told["state"], "shown as it was recorded" in told["error"]) == ("failed", True)
    client.delete(f"/api/v1/sessions/{session['id']}")


def test_a_damaged_recording_is_refused(client: httpx.Client, recording: bytes) -> None:
    """What was cut before anything was said is refused in a sentence."""
    assert "recording" in error_of(send(client, ("mine.pft", recording[:200])), 422)["message"]


def test_a_person_says_what_the_columns_are(client: httpx.Client) -> None:
    """A table with names of its own is refused, shown, and taken when it is said which column is which."""
    table = b"bild;nummer;links;oben;breit;hoch\n" + b"".join(b"%d;4;%d;20;30;40\n" % (t, 10 + t) for t in range(5))
    error_of(send(client, ("walk.csv", table)), 422)
    seen = client.post("/api/v1/uploads/table", json={"text": table.decode()}).json()
    assert seen["header"] == ["bild", "nummer", "links", "oben", "breit", "hoch"]
    assert seen["rows"][0] == ["0", "4", "10", "20", "30", "40"]
    assert [each["name"] for each in seen["meanings"]][:3] == ["frame", "target", "x"]
    said = {"frame": 0, "target": 1, "x": 2, "y": 3, "w": 4, "h": 5}
    files = {"file": ("walk.csv", table)}
    taken = client.post("/api/v1/uploads", params={"columns": json.dumps(said)}, files=files)
    assert taken.status_code == 201, taken.text
    assert (taken.json()["kind"], taken.json()["frames"]) == ("beliefs", 5)
    wrong = client.post("/api/v1/uploads", params={"columns": json.dumps({"frame": 0})}, files=files)
    assert "Expected the frame" in error_of(wrong, 422)["message"]
    error_of(client.post("/api/v1/uploads/table", json={"text": "a,b\n1,2\n"}), 422)


def test_results_clip_and_truth_come_together(client: httpx.Client) -> None:
    """They are one upload, whose pictures are the clip's and whose errors are against the truth; a frame is missed."""
    rows = [f"{t + 1},4,{11 + t},21,30,40,1,-1,-1,-1" for t in range(FRAMES)]
    missed = rows.pop(3)
    files = [("walk.mp4", video(FRAMES)), ("det.txt", "\n".join(rows).encode())]
    truth = ("gt.txt", "\n".join(row.replace(",21,", ",22,") for row in [*rows, missed]).encode())
    answer = send(client, *files, truth)
    assert answer.status_code == 201, answer.text
    upload = answer.json()
    assert (upload["kind"], upload["frames"]) == ("beliefs", FRAMES)
    assert upload["name"] == "det.txt on walk.mp4"
    assert client.get(f"/api/v1/uploads/{upload['id']}/frames/3.jpg").content.startswith(b"\xff\xd8")
    wish = {"recipe": {"experiment": "recorded", "footage": {}}, "upload": upload["id"]}
    session = client.post("/api/v1/sessions", json=session_request(wish)).json()
    steer(client, session["id"], "seek", frame=FRAMES - 1)
    columns = client.get(f"/api/v1/sessions/{session['id']}/diagnostics").json()["columns"]
    assert columns["error"][-1] == pytest.approx(1.0)
    client.delete(f"/api/v1/sessions/{session['id']}")
    refusal = error_of(send(client, *files, ("other.txt", truth[1])), 422)["message"]
    assert "call the truth gt.txt" in refusal
