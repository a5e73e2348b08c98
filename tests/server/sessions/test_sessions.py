"""Sessions through the REST interface: start, steer, change, branch, bookmark, look."""

import time
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import httpx

from pftrack.experiments import find
from tests.server.asking import get
from tests.server.host import begin, command, error_of, steer
from tests.session_requests import session_request
from tests.waiting import wait_for


def test_a_new_session_tells_everything(client: httpx.Client) -> None:
    """A new session tells its declarations, the values in force and where to find its page and scene."""
    session = begin(client, tracker="apf", parameters={"sample_count": 300})
    assert (session["state"], session["tracker"], session["parameters"]["sample_count"]) == ("ready", "apf", 300)
    assert {item["name"] for item in session["declarations"]} == set(session["parameters"])
    assert session["position"] == session["computed"] == 0
    assert (session["page"], session["viewer"]) == (f"session/{session['id']}", f"viz/{session['id']}/")
    assert get(client, session["id"]) == session
    assert session["id"] in [item["id"] for item in client.get("/api/v1/sessions").json()]


def test_presets_are_told_as_the_library_has_them(client: httpx.Client) -> None:
    """A session begins as one of them by their trackers, parameters and seeds."""
    for experiment in client.get("/api/v1/experiments").json():
        told = [(it["tracker"], it["parameters"], it["seed"]) for it in experiment["presets"]]
        assert told == [(it.tracker, dict(it.parameters), it.seed) for it in find(experiment["id"]).presets]


def test_a_name_of_ones_own(client: httpx.Client) -> None:
    """A client that has chosen the name can end a session whose answer it has not seen; no other is called so."""
    wish = {**session_request({"experiment": "ball", "frames": 5}), "id": "0123456789abcdef"}
    answers = [client.post("/api/v1/sessions", json=body) for body in (wish, wish, {**wish, "id": "../etc"})]
    assert [answer.status_code for answer in answers] == [201, 409, 422]
    place = f"/api/v1/sessions/{wish['id']}"
    assert answers[0].json()["id"] == wish["id"]
    assert (client.delete(place).status_code, client.get(place).status_code) == (204, 404)


def test_plays_in_real_time(client: httpx.Client, session: dict[str, Any]) -> None:
    """A run plays at the source's rate times the speed asked for, where nothing else keeps the processor."""
    steer(client, session["id"], "speed", speed=2)
    steer(client, session["id"], "play")
    half_seconds = []
    for count in range(1, 6):
        wait_for(lambda count=count: get(client, session["id"])["computed"] >= 30 * count)
        half_seconds.append(time.monotonic())
    paused = steer(client, session["id"], "pause")
    assert (paused["state"] in {"ready", "ended"}, paused["playing"]) == (True, False)
    # At twice the rate asked for it would last 1 s, at half of it no part would be below 1 s.
    assert half_seconds[-1] - half_seconds[0] > 1.2
    assert min(after - before for before, after in pairwise(half_seconds)) < 0.8


def test_a_pause_cuts_a_long_seek_short(client: httpx.Client) -> None:
    """A seek into frames not computed yet can be cut short; it answers where it got to."""
    session = begin(client, frames=20_000, parameters={"sample_count": 5000})
    with ThreadPoolExecutor() as pool:
        seeking = pool.submit(steer, client, session["id"], "seek", frame=19_999)
        wait_for(lambda: get(client, session["id"])["computed"] > 5)
        paused = steer(client, session["id"], "pause")
        answered = seeking.result(10)
    assert 5 < answered["position"] <= paused["position"] < 19_999
    assert paused["state"] == "ready"


def test_end_of_the_run(client: httpx.Client) -> None:
    """At the last frame a run has ended; play shows it again from the start."""
    session = begin(client, frames=5)["id"]
    assert steer(client, session, "seek", frame=4)["state"] == "ended"
    assert steer(client, session, "step")["position"] == 4
    steer(client, session, "speed", speed=0.1)
    assert steer(client, session, "play")["position"] == 0


def test_a_look_at_the_picture_interrupts_nothing(client: httpx.Client) -> None:
    """Asking for the picture while a seek is under way neither ends the seek nor waits for it."""
    session = begin(client, frames=2000, parameters={"sample_count": 20_000})["id"]
    with ThreadPoolExecutor(1) as pool:
        seeking = pool.submit(command, client, session, "seek", frame=150)
        for _ in range(5):
            answer = client.get(f"/api/v1/sessions/{session}/frame.png").raise_for_status()
            assert (answer.headers["content-type"], answer.content[:4]) == ("image/png", b"\x89PNG")
        assert seeking.result().json()["position"] == 150


def test_branches_and_their_colours(client: httpx.Client, session: dict[str, Any]) -> None:
    """A branch has a title and a tracker of its own; the one that is shown has the estimate's colour.

    Of two others the one that is drawn beside the active one has the second run's colour, as in the scene.
    """

    def act(kind: str, **more: Any) -> tuple[dict[str, Any], dict[str, str]]:
        told = steer(client, session["id"], kind, **more)
        return told, {branch["id"]: branch["colour"] for branch in told["branches"]}

    steer(client, session["id"], "seek", frame=20)
    values = {"tracker": "condensation", "sample_count": 100}
    branched, colours = act("branch", frame=8, title="What if", values=values)
    assert (branched["position"], branched["tracker"]) == (8, "condensation")
    made = branched["branches"][1]
    assert (made["title"], made["parent"], made["frame"]) == ("What if", session["branch"], 8)
    assert colours == {"b0": "#009e73", "b1": "#0072b2"}
    back, colours = act("activate", branch="b0")
    assert (back["branch"], back["position"], back["tracker"]) == (session["branch"], 20, session["tracker"])
    assert colours == {"b0": "#0072b2", "b1": "#009e73"}
    act("branch", frame=8, values=values)
    for before in ("b1", "b2"):
        act("activate", branch=before)
        assert act("activate", branch="b0")[1][before] == "#009e73"


def test_a_particle_is_moved_in_the_frame_that_is_shown(client: httpx.Client, session: dict[str, Any]) -> None:
    """In the newest frame it is a change of the run, in the past a branch; of another frame it is refused."""
    steer(client, session["id"], "seek", frame=9)
    assert steer(client, session["id"], "move", frame=9, particle=7, place=[-5, 60])["frame"] == 10
    found = get(client, session["id"])
    assert [(each["frame"], each["moved"]) for each in found["timeline"]] == [(10, ["Particle 7 moved to (0, 60)"])]
    steer(client, session["id"], "seek", frame=4)
    assert steer(client, session["id"], "move", frame=4, place=[40, 60])["branch"] == "b1"
    assert get(client, session["id"])["timeline"][-1]["moved"] == ["Estimate moved to (40, 60)"]
    assert "pause" in error_of(command(client, session["id"], "move", frame=3, place=[40, 60]), 409)["message"]
    error_of(command(client, session["id"], "move", frame=4, particle=10**6, place=[40, 60]), 422)


def test_bookmarks_are_made_and_forgotten(client: httpx.Client, session: dict[str, Any]) -> None:
    """A bookmark remembers the frame that is shown."""
    steer(client, session["id"], "seek", frame=9)
    url = f"/api/v1/sessions/{session['id']}/bookmarks"
    made, other = client.post(url, json={"note": "here"}), client.post(url)
    assert (made.status_code, made.json()["frame"], made.json()["note"]) == (201, 9, "here")
    assert (other.status_code, len(get(client, session["id"])["bookmarks"])) == (201, 2)
    assert client.delete(f"{url}/{made.json()['id']}").status_code == 204
    error_of(client.delete(f"{url}/{made.json()['id']}"), 404)
