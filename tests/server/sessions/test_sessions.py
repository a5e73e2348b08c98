"""Sessions through the REST interface: start, steer, change, branch, bookmark, look."""

import time
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import httpx
import numpy as np

from pftrack.experiments import find
from pftrack.runs.loss import Loss
from tests.server.asking import get
from tests.server.host import begin, command, error_of, steer
from tests.session_requests import session_request
from tests.waiting import wait_for


class TestStarting:
    def test_tells_everything(self, client: httpx.Client) -> None:
        """A new session tells its declarations, the values in force and where to find its page and scene."""
        session = begin(client, tracker="apf", parameters={"sample_count": 300})
        assert session["state"] == "ready"
        assert session["tracker"] == "apf"
        assert session["parameters"]["sample_count"] == 300
        assert {item["name"] for item in session["declarations"]} == set(session["parameters"])
        assert session["position"] == session["computed"] == 0
        assert session["page"] == f"session/{session['id']}"
        assert session["viewer"] == f"viz/{session['id']}/"
        assert get(client, session["id"]) == session
        assert session["id"] in [item["id"] for item in client.get("/api/v1/sessions").json()]

    def test_presets(self, client: httpx.Client) -> None:
        """Presets are told as the library has them, which runs all of them; a session begins as one of them."""
        for experiment in client.get("/api/v1/experiments").json():
            told = [(it["tracker"], it["parameters"], it["seed"]) for it in experiment["presets"]]
            assert told == [(it.tracker, dict(it.parameters), it.seed) for it in find(experiment["id"]).presets]
        preset = find("ball").presets[-1]
        session = begin(client, tracker=preset.tracker, parameters=dict(preset.parameters), seed=preset.seed)
        assert session["tracker"] == preset.tracker

    def test_before_the_loss(self, client: httpx.Client) -> None:
        """The transport goes where the library says that a loss is to be watched from, if there is one."""
        session = begin(client, tracker="condensation", seed=5, frames=90)
        error_of(command(client, session["id"], "before_loss"), 409)
        steer(client, session["id"], "seek", frame=89)
        columns = client.get(f"/api/v1/sessions/{session['id']}/diagnostics").json()["columns"]
        expected = Loss(np.array(columns["lost"]), ("truth",) * 90).approach(columns["hidden"], 89)
        assert expected is not None
        assert steer(client, session["id"], "before_loss")["position"] == expected

    def test_a_name_of_ones_own(self, client: httpx.Client) -> None:
        """A client that has chosen the name can end a session whose answer it has not seen; no other is called so."""
        name = "0123456789abcdef"
        wish = {**session_request({"experiment": "ball", "frames": 5}), "id": name}
        assert client.post("/api/v1/sessions", json=wish).json()["id"] == name
        assert client.post("/api/v1/sessions", json=wish).status_code == 409
        assert client.post("/api/v1/sessions", json={**wish, "id": "../etc"}).status_code == 422
        assert client.delete(f"/api/v1/sessions/{name}").status_code == 204
        assert client.get(f"/api/v1/sessions/{name}").status_code == 404


class TestTransport:
    def test_plays_in_real_time(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """A run plays at the source's rate times the speed asked for, where nothing else keeps the processor."""
        steer(client, session["id"], "speed", speed=2)
        steer(client, session["id"], "play")
        half_seconds = []
        for count in range(1, 6):
            wait_for(lambda count=count: get(client, session["id"])["computed"] >= 30 * count)
            half_seconds.append(time.monotonic())
        paused = steer(client, session["id"], "pause")
        assert paused["state"] in {"ready", "ended"}
        assert paused["playing"] is False
        # At twice the rate asked for it would last 1 s, at half of it no part would be below 1 s.
        assert half_seconds[-1] - half_seconds[0] > 1.2
        assert min(after - before for before, after in pairwise(half_seconds)) < 0.8

    def test_a_pause_cuts_a_long_seek_short(self, client: httpx.Client) -> None:
        """A seek into frames not computed yet can be cut short; it answers where it got to."""
        session = begin(client, frames=20_000, parameters={"sample_count": 5000})
        with ThreadPoolExecutor() as pool:
            seeking = pool.submit(steer, client, session["id"], "seek", frame=19_999)
            wait_for(lambda: get(client, session["id"])["computed"] > 5)
            paused = steer(client, session["id"], "pause")
            answered = seeking.result(10)
        assert 5 < answered["position"] <= paused["position"] < 19_999
        assert paused["state"] == "ready"

    def test_end_of_the_run(self, client: httpx.Client) -> None:
        """At the last frame a run has ended; play shows it again from the start."""
        session = begin(client, frames=5)
        assert steer(client, session["id"], "seek", frame=4)["state"] == "ended"
        assert steer(client, session["id"], "step")["position"] == 4
        steer(client, session["id"], "speed", speed=0.1)
        assert steer(client, session["id"], "play")["position"] == 0


def test_a_look_at_the_picture_interrupts_nothing(client: httpx.Client) -> None:
    """Asking for the picture while a seek is under way neither ends the seek nor waits for it."""
    session = begin(client, frames=2000, parameters={"sample_count": 20_000})
    place = f"/api/v1/sessions/{session['id']}"
    with ThreadPoolExecutor(1) as pool:
        seeking = pool.submit(command, client, session["id"], "seek", frame=150)
        for _ in range(5):
            answer = client.get(f"{place}/frame.png").raise_for_status()
            assert (answer.headers["content-type"], answer.content[:4]) == ("image/png", b"\x89PNG")
        assert seeking.result().json()["position"] == 150


class TestBranches:
    def test_branch_and_return(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """A branch has a title and a tracker of its own; the one that is shown has the estimate's colour."""
        steer(client, session["id"], "seek", frame=20)
        values = {"tracker": "condensation", "sample_count": 100}
        answer = command(client, session["id"], "branch", frame=8, title="What if", values=values)
        assert answer.status_code == 200
        branched = answer.json()
        assert (branched["position"], branched["tracker"]) == (8, "condensation")
        made = branched["branches"][1]
        assert (made["title"], made["parent"], made["frame"]) == ("What if", session["branch"], 8)
        assert [branch["colour"] for branch in branched["branches"]] == ["#009e73", "#0072b2"]
        back = command(client, session["id"], "activate", branch=session["branch"]).json()
        assert (back["branch"], back["position"], back["tracker"]) == (session["branch"], 20, session["tracker"])
        assert [branch["colour"] for branch in back["branches"]] == ["#0072b2", "#009e73"]

    def test_the_second_run_has_the_colour_that_it_has_in_the_scene(
        self, client: httpx.Client, session: dict[str, Any]
    ) -> None:
        """Of two other branches the one that is drawn beside the active one has the second run's colour."""
        steer(client, session["id"], "seek", frame=20)
        for _ in range(2):
            command(client, session["id"], "branch", frame=8, values={"tracker": "condensation"})
            command(client, session["id"], "activate", branch="b0")
        for before in ("b1", "b2"):
            command(client, session["id"], "activate", branch=before)
            shown = command(client, session["id"], "activate", branch="b0").json()["branches"]
            assert {branch["id"]: branch["colour"] for branch in shown}[before] == "#009e73"


class TestMoves:
    def test_a_particle_is_moved_in_the_frame_that_is_shown(
        self, client: httpx.Client, session: dict[str, Any]
    ) -> None:
        """In the newest frame it is a change of the run, in the past a branch; of another frame it is refused."""
        steer(client, session["id"], "seek", frame=9)
        answer = command(client, session["id"], "move", frame=9, particle=7, place=[-5, 60])
        assert (answer.status_code, answer.json()["frame"]) == (200, 10)
        found = get(client, session["id"])
        assert [(each["frame"], each["moved"]) for each in found["timeline"]] == [(10, ["Particle 7 moved to (0, 60)"])]
        steer(client, session["id"], "seek", frame=4)
        assert command(client, session["id"], "move", frame=4, place=[40, 60]).json()["branch"] == "b1"
        assert get(client, session["id"])["timeline"][-1]["moved"] == ["Estimate moved to (40, 60)"]
        assert "pause" in error_of(command(client, session["id"], "move", frame=3, place=[40, 60]), 409)["message"]
        error_of(command(client, session["id"], "move", frame=4, particle=10**6, place=[40, 60]), 422)


class TestBookmarks:
    def test_made_and_forgotten(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """A bookmark remembers the frame that is shown."""
        steer(client, session["id"], "seek", frame=9)
        url = f"/api/v1/sessions/{session['id']}/bookmarks"
        made = client.post(url, json={"note": "here"})
        assert made.status_code == 201
        assert (made.json()["frame"], made.json()["note"]) == (9, "here")
        assert client.post(url).status_code == 201
        assert len(get(client, session["id"])["bookmarks"]) == 2
        assert client.delete(f"{url}/{made.json()['id']}").status_code == 204
        error_of(client.delete(f"{url}/{made.json()['id']}"), 404)
