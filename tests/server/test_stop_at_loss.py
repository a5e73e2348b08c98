"""A session tells in each frame how probable it is that its target is lost, and stops where it is asked to."""

import math
from typing import Any

import httpx

import pftrack
from pftrack.runs.loss_probability import loss_probabilities
from tests.server.asking import columns, get
from tests.server.host import begin, error_of, steer
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
    client.post(f"/api/v1/sessions/{session['id']}/branches", json={"frame": 8})
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


def test_a_probability_is_between_nothing_and_certainty(client: httpx.Client, session: dict[str, Any]) -> None:
    """Others are refused with the field's name."""
    for wrong in (0, 1.5, "often"):
        body = {"action": "stop_at", "probability": wrong}
        answer = client.post(f"/api/v1/sessions/{session['id']}/transport", json=body)
        assert error_of(answer, 422)["field"] == "probability"


def _still(client: httpx.Client, session: str) -> dict[str, Any] | None:
    known = get(client, session)
    return None if known["playing"] else known
