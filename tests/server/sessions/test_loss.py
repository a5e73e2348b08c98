"""The loss of a target: why a session lost it, how probable it is, and where the run stops."""

import math
from typing import Any

import httpx

import pftrack
from pftrack.runs.loss_probability import loss_probabilities
from tests.server.asking import columns, get
from tests.server.host import begin, command, error_of, steer
from tests.server.sessions.test_session_truth import given
from tests.server.sessions.test_session_truth import recorded as recorded  # noqa: PLC0414 - a fixture
from tests.waiting import wait_for


def test_only_the_active_branch_is_explained(client: httpx.Client) -> None:
    """A question about a branch that was left, perhaps by a change just now, has an empty answer."""
    session = begin(client, frames=20)
    place, left = f"/api/v1/sessions/{session['id']}/explanation", session["branch"]
    steer(client, session["id"], "seek", frame=9)
    made = steer(client, session["id"], "branch", frame=4)["branch"]
    told = {name: client.get(place, params={"branch": name}).json() for name in (left, made)}
    assert told == {left: None, made: client.get(place).json()}


def played(client: httpx.Client, session: str) -> dict[str, Any]:
    """Play as fast as possible until it stops, and return what the session tells then."""
    steer(client, session, "speed", speed=0)
    steer(client, session, "play")
    return wait_for(lambda: (known := get(client, session))["playing"] is False and known)


def test_a_session_tells_of_its_loss_what_the_library_tells(client: httpx.Client) -> None:
    """It stops in the first frame with the probability that was asked for; played again it does not stop there again.

    The probabilities are the library's to the bit, and the session declares their series by its role; a branch goes on
    with what its past tells. The explanation is the library's, too: for a frame with the target held it finds no cause;
    a frame not computed yet cannot be explained, and no frame is offered before the first loss.
    """

    def told() -> list[float | None]:
        return [measured.get("loss_probability") for measured in columns(client, session["id"])["series"]]

    values = {"occlusion_width_px": 100}
    run = pftrack.run("ball", frames=60, **values)
    said = loss_probabilities(run).tolist()
    session = begin(client, frames=60, seed=0, parameters=values)
    place = f"/api/v1/sessions/{session['id']}/explanation"
    before = client.get(place).json()["diagnosis"]
    assert (before["frame"], before["signs"]) == (None, [])
    assert "a frame that has been computed, 0 to 0" in error_of(client.get(place, params={"frame": 9}), 422)["message"]
    error_of(command(client, session["id"], "before_loss"), 409)
    assert [one["name"] for one in session["series"] if one["role"] == "loss_probability"] == ["loss_probability"]
    asked = steer(client, session["id"], "stop_at", probability=0.8)
    assert (asked["stop_at"], asked["stopped"]) == (0.8, "")
    stopped = played(client, session["id"])
    frame = next(number for number, one in enumerate(said) if one >= 0.8)
    assert stopped["position"] == stopped["computed"] == frame
    assert stopped["stopped"] == f"Stopped: probably lost, {100 * said[frame]:.0f} %"
    assert steer(client, session["id"], "stop_at")["stop_at"] is None
    ended = played(client, session["id"])
    assert (ended["state"], ended["stopped"]) == ("ended", "")
    assert told() == [None if math.isnan(one) else one for one in said]
    explained = client.get(place).json()
    assert explained == run.explain().as_dict()
    assert steer(client, session["id"], "before_loss")["position"] == explained["before"]
    assert explained["diagnosis"]["cause"] == "occlusion-longer-than-memory"
    nothing = client.get(place, params={"frame": 4}).json()
    calm = nothing["diagnosis"]
    assert (calm["frame"], calm["lost"], calm["signs"], nothing["before"]) == (4, False, [], None)
    steer(client, session["id"], "seek", frame=20)
    assert told()[1:21] == said[1:21]


def test_on_a_recording_a_mark_stops_it(client: httpx.Client, recorded: dict[str, Any]) -> None:
    """No probability is calibrated there, so that none is declared or told; a mark says that the target is lost."""
    session = recorded["id"]
    assert not [one for one in recorded["series"] if one["role"] == "loss_probability"]
    given(client, session, "frame,x,y,w,h\n3,31,51,19,19\n5,100,10,19,19\n")
    steer(client, session, "stop_at", probability=0.5)
    stopped = played(client, session)
    assert (stopped["position"], stopped["stopped"]) == (5, "Stopped: lost")
    told = columns(client, session)
    assert told["lost_by"][3:6] == ["truth", "", "truth"]
    assert not any("loss_probability" in one for one in told["series"])
