"""A session tells in each frame how probable it is that its target is lost, and stops where it is asked to."""

import math
from typing import Any

import httpx

import pftrack
from pftrack.runs.loss_probability import loss_probabilities
from tests.server.asking import columns, get
from tests.server.host import begin, steer
from tests.server.sessions.test_session_truth import give
from tests.server.uploads.test_suitability import box
from tests.server.uploads.test_suitability import clip as clip  # noqa: PLC0414 - a fixture
from tests.server.uploads.test_suitability import upload as upload  # noqa: PLC0414 - a fixture
from tests.waiting import wait_for

VALUES = {"occlusion_width_px": 100}
FRAMES = 60


def _told(client: httpx.Client, session: str) -> list[float | None]:
    return [measured.get("loss_probability") for measured in columns(client, session)["series"]]


def _library() -> list[float]:
    return loss_probabilities(pftrack.run("ball", frames=FRAMES, **VALUES)).tolist()


def test_frames_tell_what_the_library_tells(client: httpx.Client) -> None:
    """To the bit, and the session declares the series by its role; a branch goes on with what its past tells."""
    session = begin(client, frames=FRAMES, seed=0, parameters=VALUES)
    assert [one["name"] for one in session["series"] if one["role"] == "loss_probability"] == ["loss_probability"]
    steer(client, session["id"], "seek", frame=FRAMES - 1)
    said = _library()
    assert _told(client, session["id"]) == [None if math.isnan(one) else one for one in said]
    steer(client, session["id"], "seek", frame=20)
    assert _told(client, session["id"])[1:21] == said[1:21]


def test_it_stops_where_the_target_is_probably_lost_and_goes_on_from_there(client: httpx.Client) -> None:
    """It stops in the first frame with that probability and says so; played again it does not stop there once more."""
    session = begin(client, frames=FRAMES, seed=0, parameters=VALUES)
    asked = steer(client, session["id"], "stop_at", probability=0.8)
    assert (asked["stop_at"], asked["stopped"]) == (0.8, "")
    steer(client, session["id"], "speed", speed=0)
    steer(client, session["id"], "play")
    stopped = wait_for(lambda: _still(client, session["id"]))
    said = _library()
    frame = next(number for number, one in enumerate(said) if one >= 0.8)
    assert stopped["position"] == stopped["computed"] == frame
    assert stopped["stopped"] == f"Stopped: probably lost, {100 * said[frame]:.0f} %"
    assert steer(client, session["id"], "stop_at")["stop_at"] is None
    steer(client, session["id"], "play")
    ended = wait_for(lambda: _still(client, session["id"]))
    assert (ended["state"], ended["stopped"]) == ("ended", "")


def test_on_a_recording_a_mark_stops_it(client: httpx.Client, upload: str) -> None:
    """No probability is calibrated there, so that none is declared or told; a mark says that the target is lost."""
    recipe = {"experiment": "ball", "tracker": "h-spf", "footage": {"mark": box(31, 51), "start": 0}}
    session = client.post("/api/v1/sessions", json={"recipe": recipe, "upload": upload}).json()
    assert not [one for one in session["series"] if one["role"] == "loss_probability"]
    give(client, session["id"], "frame,x,y,w,h\n3,31,51,19,19\n5,100,10,19,19\n").raise_for_status()
    steer(client, session["id"], "stop_at", probability=0.5)
    steer(client, session["id"], "speed", speed=0)
    steer(client, session["id"], "play")
    stopped = wait_for(lambda: _still(client, session["id"]))
    assert (stopped["position"], stopped["stopped"]) == (5, "Stopped: lost")
    assert columns(client, session["id"])["lost_by"][3:6] == ["truth", "", "truth"]
    assert not any("loss_probability" in one for one in columns(client, session["id"])["series"])


def _still(client: httpx.Client, session: str) -> dict[str, Any] | None:
    known = get(client, session)
    return None if known["playing"] else known
