"""Why a session's target was lost, over REST."""

import httpx

import pftrack
from tests.server.host import begin, command, error_of, steer


def test_a_session_says_why_its_target_was_lost(client: httpx.Client) -> None:
    """The explanation of a session is that of the same run in Python; asked about a held frame it finds nothing.

    What has not been computed cannot be explained, and before a loss nobody can be led to it.
    """
    values = {"occlusion_width_px": 100}
    session = begin(client, frames=60, seed=0, parameters=values)["id"]
    place = f"/api/v1/sessions/{session}/explanation"
    before = client.get(place).json()["diagnosis"]
    assert (before["frame"], before["signs"]) == (None, [])
    refused = error_of(client.get(place, params={"frame": 9}), 422)["message"]
    assert "a frame that has been computed, 0 to 0" in refused
    error_of(command(client, session, "before_loss"), 409)
    steer(client, session, "seek", frame=59)
    told = client.get(place).json()
    assert told == pftrack.run("ball", frames=60, **values).explain().as_dict()
    assert steer(client, session, "before_loss")["position"] == told["before"]
    assert told["diagnosis"]["cause"] == "occlusion-longer-than-memory"
    nothing = client.get(place, params={"frame": 4}).json()
    calm = nothing["diagnosis"]
    assert (calm["frame"], calm["lost"], calm["signs"], nothing["before"]) == (4, False, [], None)


def test_a_client_is_never_told_of_another_branch(client: httpx.Client) -> None:
    """Of a branch that was left, which a change may just have done, the answer is empty."""
    session = begin(client, frames=20)
    place, left = f"/api/v1/sessions/{session['id']}/explanation", session["branch"]
    steer(client, session["id"], "seek", frame=9)
    made = steer(client, session["id"], "branch", frame=4)["branch"]
    told = {name: client.get(place, params={"branch": name}).json() for name in (left, made)}
    assert told == {left: None, made: client.get(place).json()}
