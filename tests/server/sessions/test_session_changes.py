"""What is changed in a session through the REST interface: parameters, branches and bookmarks."""

from typing import Any

import httpx

from tests.server.asking import get
from tests.server.host import command, error_of, steer


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
