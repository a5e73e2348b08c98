"""Why a session's target was lost, over REST."""

from typing import Any

import httpx

import pftrack
from tests.server.host import begin, error_of, steer


def test_a_session_says_why_its_target_was_lost(client: httpx.Client) -> None:
    """The explanation of a session is that of the same run in Python; asked about a held frame it finds nothing."""
    values = {"occlusion_width_px": 100}
    session = begin(client, frames=60, seed=0, parameters=values)
    place = f"/api/v1/sessions/{session['id']}"
    before = client.get(f"{place}/explanation").json()["diagnosis"]
    assert (before["frame"], before["signs"]) == (None, [])
    steer(client, session["id"], "seek", frame=59)
    told = client.get(f"{place}/explanation").json()
    run = pftrack.run("ball", frames=60, **values)
    assert told == run.explain().as_dict()
    assert steer(client, session["id"], "before_loss")["position"] == told["before"]
    assert told["diagnosis"]["cause"] == "occlusion-longer-than-memory"
    nothing = client.get(f"{place}/explanation", params={"frame": 4}).json()
    calm = nothing["diagnosis"]
    assert (calm["frame"], calm["lost"], calm["signs"], nothing["before"]) == (4, False, [], None)


def test_a_frame_that_is_not_there_is_refused(client: httpx.Client, session: dict[str, Any]) -> None:
    """What has not been computed cannot be explained; the refusal says how far the run is."""
    answer = client.get(f"/api/v1/sessions/{session['id']}/explanation", params={"frame": 9})
    assert "a frame that has been computed, 0 to 0" in error_of(answer, 422)["message"]


def test_a_client_is_never_told_of_another_branch(client: httpx.Client) -> None:
    """Of a branch that was left, which a change may just have done, the answer is empty."""
    session = begin(client, frames=20)
    place, left = f"/api/v1/sessions/{session['id']}/explanation", session["branch"]
    steer(client, session["id"], "seek", frame=9)
    made = steer(client, session["id"], "branch", frame=4)["branch"]
    told = {name: client.get(place, params={"branch": name}).json() for name in (left, made)}
    assert told == {left: None, made: client.get(place).json()}
