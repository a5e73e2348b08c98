"""What is changed in a session through the REST interface: parameters, branches and bookmarks."""

from typing import Any

import httpx
import pytest

from tests.server.asking import columns, get, timeline_of
from tests.server.host import begin, error_of, steer


class TestParameters:
    def test_takes_effect_in_the_next_frame(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """A change at the newest frame counts from the next one and stands on the timeline."""
        steer(client, session["id"], "seek", frame=10)
        answer = client.patch(f"/api/v1/sessions/{session['id']}/parameters", json={"sample_count": 200})
        assert answer.status_code == 200
        assert answer.json()["frame"] == 11
        assert answer.json()["parameters"]["sample_count"] == 200
        assert answer.json()["branch"] == session["branch"]
        steer(client, session["id"], "step")
        made = [measured["particles"] for measured in columns(client, session["id"])["series"]]
        assert made[10] == session["parameters"]["sample_count"]
        assert made[11] == 200
        assert timeline_of(get(client, session["id"])) == [{"frame": 11, "values": {"sample_count": 200}}]

    def test_tracker_is_a_parameter(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """The tracker changes like a parameter."""
        answer = client.patch(f"/api/v1/sessions/{session['id']}/parameters", json={"tracker": "apf"})
        assert answer.json()["tracker"] == "apf"
        assert get(client, session["id"])["tracker"] == "apf"

    def test_in_the_past_it_branches(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """A change in the past makes a branch that goes on there and leaves the old one as it was."""
        steer(client, session["id"], "seek", frame=30)
        before = columns(client, session["id"])
        steer(client, session["id"], "seek", frame=12)
        answer = client.patch(f"/api/v1/sessions/{session['id']}/parameters", json={"sample_count": 200}).json()
        assert answer["branch"] != session["branch"]
        assert answer["frame"] == 13
        now = get(client, session["id"])
        assert (now["position"], now["computed"]) == (12, 12)
        assert [branch["frame"] for branch in now["branches"]] == [0, 12]
        steer(client, session["id"], "seek", frame=30)
        branch = columns(client, session["id"])
        assert branch["estimate"][:13] == before["estimate"][:13]
        assert branch["estimate"][13] != before["estimate"][13]
        assert columns(client, session["id"], session["branch"]) == before

    def test_at_the_end_it_branches_from_the_start(self, client: httpx.Client) -> None:
        """A run that has ended takes another tracker: it is told beforehand that it begins again, as a branch."""
        session = begin(client, frames=8)
        points = []
        for frame in (4, 7, 3):
            steer(client, session["id"], "seek", frame=frame)
            points.append(get(client, session["id"])["branch_point"])
        assert points == [None, 0, 3]
        steer(client, session["id"], "seek", frame=7)
        before = columns(client, session["id"])
        answer = client.patch(f"/api/v1/sessions/{session['id']}/parameters", json={"tracker": "condensation"})
        assert answer.status_code == 200, answer.text
        now = get(client, session["id"])
        assert (now["tracker"], now["position"], now["computed"], now["branch_point"]) == ("condensation", 0, 0, None)
        assert [branch["frame"] for branch in now["branches"]] == [0, 0]
        client.patch(f"/api/v1/sessions/{session['id']}/parameters", json={"sample_count": 200})
        assert len(get(client, session["id"])["branches"]) == 2
        steer(client, session["id"], "seek", frame=7)
        assert columns(client, session["id"], session["branch"]) == before

    def test_fixed_parameters_begin_the_run_anew(self, client: httpx.Client) -> None:
        """A parameter that cannot change in mid-run begins it anew, with the same seed."""
        for experiment in client.get("/api/v1/experiments").json():
            session = begin(client, experiment=experiment["id"])
            fixed = [
                item for item in session["declarations"] if not item["live"] and item["kind"] in {"integer", "number"}
            ]
            if not fixed:
                continue
            steer(client, session["id"], "seek", frame=5)
            name, value = fixed[0]["name"], fixed[0]["maximum"]
            answer = client.patch(f"/api/v1/sessions/{session['id']}/parameters", json={name: value})
            assert answer.status_code == 200, answer.text
            now = get(client, session["id"])
            assert (now["position"], now["computed"], now["recipe"]["seed"]) == (0, 0, session["recipe"]["seed"])
            assert timeline_of(now) == [{"frame": 0, "values": {name: value}}]
            return
        pytest.skip("no experiment has a parameter that is fixed during a run")

    @pytest.mark.parametrize(
        ("values", "field"),
        [
            ({"sample_count": 0}, "sample_count"),
            ({"sample_count": -1}, "sample_count"),
            ({"sample_count": 10**9}, "sample_count"),
            ({"sample_count": 10**30}, "sample_count"),
            ({"sample_count": "abc"}, "sample_count"),
            ({"sample_count": None}, "sample_count"),
            ({"sample_count": [1]}, "sample_count"),
            ({"sample_count": {"a": 1}}, "sample_count"),
            ({"sample_count": 1.5}, "sample_count"),
            ({"tracker": "magic"}, "tracker"),
            ({"tracker": None}, "tracker"),
            ({"tracker": 3}, "tracker"),
            ({"nonsense": 1}, "nonsense"),
            ({"": 1}, ""),
            ({"gamma_min_px": 9, "gamma_max_px": 3}, None),
            ({"sample_count": 100, "occlusion_width_px": "wide"}, "occlusion_width_px"),
        ],
    )
    def test_refuses(
        self, client: httpx.Client, session: dict[str, Any], values: dict[str, Any], field: str | None
    ) -> None:
        """A value that cannot be accepted is refused whole, with field, bound and value, and nothing changes."""
        error = error_of(client.patch(f"/api/v1/sessions/{session['id']}/parameters", json=values), 422)
        assert error["bound"]
        if field is None:
            assert error["field"] in values
        else:
            assert error["field"] == field
        assert get(client, session["id"])["parameters"] == session["parameters"]

    @pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999"])
    def test_refuses_what_is_no_number(self, client: httpx.Client, session: dict[str, Any], number: str) -> None:
        """A number that is not finite is refused with field, bound and value."""
        headers = {"content-type": "application/json"}
        url = f"/api/v1/sessions/{session['id']}/parameters"
        for name in ("sample_count", "gamma_px"):
            error = error_of(client.patch(url, content=f'{{"{name}": {number}}}', headers=headers), 422)
            assert error["field"] == name
            assert "value" in error

    @pytest.mark.parametrize(
        "body", ["", "{", "[]", "null", "7", '"x"', '{"a": 1', "\x00", '{"sample_count": "\\ud800"}']
    )
    def test_refuses_what_is_no_object(self, client: httpx.Client, session: dict[str, Any], body: str) -> None:
        """A body that is no JSON object is refused in the one error shape."""
        url = f"/api/v1/sessions/{session['id']}/parameters"
        error_of(client.patch(url, content=body, headers={"content-type": "application/json"}), 422)


class TestBranches:
    def test_branch_and_return(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """A branch has a title and a tracker of its own; the one that is shown has the estimate's colour."""
        steer(client, session["id"], "seek", frame=20)
        body = {"frame": 8, "tracker": "condensation", "title": "What if", "parameters": {"sample_count": 100}}
        answer = client.post(f"/api/v1/sessions/{session['id']}/branch", json=body)
        assert answer.status_code == 201
        branched = answer.json()
        assert (branched["position"], branched["tracker"]) == (8, "condensation")
        made = branched["branches"][1]
        assert (made["title"], made["parent"], made["frame"]) == ("What if", session["branch"], 8)
        assert [branch["colour"] for branch in branched["branches"]] == ["#009e73", "#0072b2"]
        back = client.post(f"/api/v1/sessions/{session['id']}/branch/{session['branch']}/activate").json()
        assert (back["branch"], back["position"], back["tracker"]) == (session["branch"], 20, session["tracker"])
        assert [branch["colour"] for branch in back["branches"]] == ["#0072b2", "#009e73"]

    def test_the_second_run_has_the_colour_that_it_has_in_the_scene(
        self, client: httpx.Client, session: dict[str, Any]
    ) -> None:
        """Of two other branches the one that is drawn beside the active one has the second run's colour."""
        url = f"/api/v1/sessions/{session['id']}/branch"
        steer(client, session["id"], "seek", frame=20)
        for _ in range(2):
            client.post(url, json={"frame": 8, "tracker": "condensation"})
            client.post(f"{url}/b0/activate")
        for before in ("b1", "b2"):
            client.post(f"{url}/{before}/activate")
            shown = client.post(f"{url}/b0/activate").json()["branches"]
            assert {branch["id"]: branch["colour"] for branch in shown}[before] == "#009e73"

    def test_refuses(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """A branch from a frame that has not been computed, or with a wrong value, is refused and leaves no trace."""
        url = f"/api/v1/sessions/{session['id']}/branch"
        assert error_of(client.post(url, json={"frame": 5}), 422)["field"] == "frame"
        assert error_of(client.post(url, json={"frame": 0, "tracker": "magic"}), 422)["field"] == "tracker"
        assert (
            error_of(client.post(url, json={"frame": 0, "parameters": {"sample_count": 0}}), 422)["field"]
            == "sample_count"
        )
        assert len(get(client, session["id"])["branches"]) == 1
        error_of(client.post(f"{url}/b9/activate"), 404)
        error_of(client.get(f"/api/v1/sessions/{session['id']}/diagnostics?branch=b9"), 404)


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
