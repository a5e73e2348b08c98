"""Uploaded recordings of beliefs: through the door of videos, to a session like any."""

from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

import pftrack
from tests.server.host import error_of, steer
from tests.server.test_uploads import send, video
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
            rec(t, particles=rng.standard_normal((80, 4)) + 20.0 + t, box=(10 + t, 10 + t, 21, 21))
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
    client.delete(f"/api/v1/sessions/{session['id']}")


def test_a_damaged_recording_is_refused(client: httpx.Client, recording: bytes) -> None:
    """What was cut before anything was said is refused in a sentence."""
    assert "recording" in error_of(send(client, ("mine.pft", recording[:200])), 422)["message"]
