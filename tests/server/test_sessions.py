"""Sessions through the REST interface: start, steer, change, branch, end."""

import time
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import httpx
import pytest

from pftrack.experiments import find
from pftrack.runs.loss import before_loss
from pftrack.runs.run import Change, Run
from tests.server.host import Server, begin, error_of, steer
from tests.waiting import wait_for


def get(client: httpx.Client, session: str) -> dict[str, Any]:
    found: dict[str, Any] = client.get(f"/api/v1/sessions/{session}").json()
    return found


def timeline_of(session: dict[str, Any]) -> list[dict[str, Any]]:
    """Return a session's timeline as a client writes one."""
    return [{"frame": change["frame"], "values": change["values"]} for change in session["timeline"]]


def columns(client: httpx.Client, session: str, branch: str | None = None) -> dict[str, list[Any]]:
    query = {"branch": branch} if branch else {}
    found: dict[str, list[Any]] = client.get(f"/api/v1/sessions/{session}/diagnostics", params=query).json()["columns"]
    return found


def estimates(run: Run) -> list[list[float]]:
    return [list(row.estimate) for row in run.diagnostics]


class TestStarting:
    def test_tells_everything(self, client: httpx.Client) -> None:
        """A new session tells its declarations, the values in force and where to find its page and scene."""
        session = begin(client, tracker="apf", parameters={"sample_count": 300})
        assert session["state"] == "ready"
        assert session["tracker"] == "apf"
        assert session["parameters"]["sample_count"] == 300
        assert {item["name"] for item in session["declarations"]} == set(session["parameters"])
        assert session["position"] == session["computed"] == 0
        assert session["page"] == f"/session/{session['id']}"
        assert session["viewer"] == f"/viz/{session['id']}/"
        assert get(client, session["id"]) == session
        assert session["id"] in [item["id"] for item in client.get("/api/v1/sessions").json()]

    def test_every_experiment_and_preset(self, client: httpx.Client) -> None:
        """Every preset of every experiment starts."""
        for experiment in client.get("/api/v1/experiments").json():
            for preset in experiment["presets"]:
                body = {name: preset[name] for name in ("tracker", "parameters", "seed")}
                session = begin(client, experiment=experiment["id"], **body)
                assert session["tracker"] == preset["tracker"]
                client.delete(f"/api/v1/sessions/{session['id']}")

    def test_a_change_past_the_end(self, client: httpx.Client) -> None:
        """A change that no frame would see is refused, with the frames that there are."""
        timeline = [{"frame": 40, "values": {"sample_count": 150}}]
        body = {"experiment": "ball", "frames": 40, "timeline": timeline}
        error = error_of(client.post("/api/v1/sessions", json=body), 422)
        assert (error["field"], error["value"], error["bound"]) == (
            "timeline",
            40,
            "changes within the run, frames 0 to 39",
        )

    def test_the_values_at_the_beginning(self, client: httpx.Client) -> None:
        """A change is told with the value that it replaced, that of the beginning included."""
        session = begin(client, parameters={"sample_count": 300})
        steer(client, session["id"], "seek", frame=3)
        client.patch(f"/api/v1/sessions/{session['id']}/parameters", json={"sample_count": 200})
        now = get(client, session["id"])
        change = now["timeline"][-1]
        assert (change["frame"], change["before"]["sample_count"]) == (4, 300)
        assert (change["values"]["sample_count"], now["parameters"]["sample_count"]) == (200, 200)

    def test_before_the_loss(self, client: httpx.Client) -> None:
        """The transport goes where the library says that a loss is to be watched from, if there is one."""
        session = begin(client, tracker="condensation", seed=5, frames=90)
        error_of(client.post(f"/api/v1/sessions/{session['id']}/transport", json={"action": "before_loss"}), 409)
        steer(client, session["id"], "seek", frame=89)
        columns = client.get(f"/api/v1/sessions/{session['id']}/diagnostics").json()["columns"]
        expected = before_loss(columns["lost"], columns["hidden"], 89)
        assert expected is not None
        assert steer(client, session["id"], "before_loss")["position"] == expected

    def test_timeline(self, client: httpx.Client) -> None:
        """A session started with a timeline computes what the library computes with it."""
        timeline = [{"frame": 10, "values": {"sample_count": 150}}, {"frame": 20, "values": {"tracker": "apf"}}]
        session = begin(client, timeline=timeline, position=40)
        assert timeline_of(session) == timeline
        assert session["position"] == 40
        experiment = find("ball")
        changes = (Change(10, {"sample_count": 150}), Change(20, {"tracker": "apf"}))
        run = Run(experiment, experiment.simulate(), seed=7, timeline=changes)
        run.seek(40)
        assert columns(client, session["id"])["estimate"] == estimates(run)

    def test_end(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """An ended session is gone."""
        assert client.delete(f"/api/v1/sessions/{session['id']}").status_code == 204
        error_of(client.get(f"/api/v1/sessions/{session['id']}"), 404)


class TestTransport:
    def test_same_numbers_as_the_library(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """A run through the server has the same estimates, to the bit, as one by the library."""
        steer(client, session["id"], "speed", speed=0)
        steer(client, session["id"], "play")
        wait_for(lambda: get(client, session["id"])["state"] == "ended", 30)
        saved = client.post("/api/v1/runs", json={"session": session["id"]}).json()
        experiment = find("ball")
        run = Run(experiment, experiment.simulate(), seed=7)
        run.finish()
        assert saved["summary"]["estimates_sha256"] == run.estimates_sha256
        assert columns(client, session["id"])["estimate"] == estimates(run)

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

    def test_step_and_back(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """Step and back move by one frame and stop at the ends."""
        assert steer(client, session["id"], "back")["position"] == 0
        assert steer(client, session["id"], "step")["position"] == 1
        assert steer(client, session["id"], "step")["computed"] == 2
        back = steer(client, session["id"], "back")
        assert (back["position"], back["computed"]) == (1, 2)

    def test_seek_forward_and_rewind(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """A seek computes what is missing, and a rewind changes no number."""
        assert steer(client, session["id"], "seek", frame=80)["position"] == 80
        before = columns(client, session["id"])
        assert steer(client, session["id"], "seek", frame=13)["position"] == 13
        assert steer(client, session["id"], "seek", frame=80)["computed"] == 80
        assert columns(client, session["id"]) == before
        assert len(before["frame"]) == 81

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

    def test_restart(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """A restart keeps the values in force and forgets the past."""
        steer(client, session["id"], "seek", frame=20)
        client.patch(f"/api/v1/sessions/{session['id']}/parameters", json={"sample_count": 200, "tracker": "apf"})
        again = steer(client, session["id"], "restart")
        assert (again["position"], again["computed"], again["tracker"]) == (0, 0, "apf")
        assert timeline_of(again) == [{"frame": 0, "values": {"sample_count": 200}}]
        assert columns(client, session["id"])["frame"] == [0]

    def test_restart_with_another_seed(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """The run begins anew as one that was started with that seed, and the session tells the seed."""
        again = steer(client, session["id"], "restart", seed=12)
        assert (again["recipe"]["seed"], again["position"]) == (12, 0)
        steer(client, session["id"], "seek", frame=10)
        other = begin(client, seed=12, position=10)
        assert columns(client, session["id"])["estimate"] == columns(client, other["id"])["estimate"]
        assert steer(client, session["id"], "restart", seed=2**53 - 1)["recipe"]["seed"] == 2**53 - 1
        assert steer(client, session["id"], "restart")["recipe"]["seed"] == 2**53 - 1

    def test_another_seed_is_no_seed_of_one_branch(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """All branches share their past, and so the seed."""
        steer(client, session["id"], "seek", frame=20)
        client.post(f"/api/v1/sessions/{session['id']}/branch", json={"frame": 10})
        body = {"action": "restart", "seed": 12}
        answer = client.post(f"/api/v1/sessions/{session['id']}/transport", json=body)
        assert "All 2 branches" in error_of(answer, 409)["message"]
        assert get(client, session["id"])["recipe"]["seed"] == session["recipe"]["seed"]

    @pytest.mark.parametrize(
        ("body", "field"),
        [
            ({"action": "restart", "seed": -1}, "seed"),
            ({"action": "restart", "seed": 2**53}, "seed"),
            ({"action": "restart", "seed": 1.5}, "seed"),
            ({"action": "restart", "seed": "seven"}, "seed"),
            ({"action": "fly"}, "action"),
            ({}, "action"),
            ({"action": "seek"}, "frame"),
            ({"action": "seek", "frame": 240}, "frame"),
            ({"action": "seek", "frame": -1}, "frame"),
            ({"action": "seek", "frame": "soon"}, "frame"),
            ({"action": "speed"}, "speed"),
            ({"action": "speed", "speed": 11}, "speed"),
            ({"action": "speed", "speed": 0.01}, "speed"),
            ({"action": "speed", "speed": -1}, "speed"),
            ({"action": "play", "warp": 9}, "warp"),
        ],
    )
    def test_refuses(self, client: httpx.Client, session: dict[str, Any], body: dict[str, Any], field: str) -> None:
        """A wrong transport command is refused with the field's name."""
        answer = client.post(f"/api/v1/sessions/{session['id']}/transport", json=body)
        assert error_of(answer, 422)["field"] == field


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

    def test_at_the_end_there_is_no_next_frame(self, client: httpx.Client) -> None:
        """A change at the last frame is a conflict that says what to do."""
        session = begin(client, frames=3)
        steer(client, session["id"], "seek", frame=2)
        answer = client.patch(f"/api/v1/sessions/{session['id']}/parameters", json={"sample_count": 100})
        assert "go back" in error_of(answer, 409)["message"]


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


class TestPictures:
    def test_current_frame(self, client: httpx.Client, session: dict[str, Any]) -> None:
        """The frame that is shown can be had as a PNG."""
        answer = client.get(f"/api/v1/sessions/{session['id']}/frame.png")
        assert answer.headers["content-type"] == "image/png"
        assert answer.content.startswith(b"\x89PNG")


class TestBadWishes:
    @pytest.mark.parametrize(
        ("body", "field"),
        [
            ({}, "experiment"),
            ({"experiment": "chess"}, "experiment"),
            ({"experiment": "ball", "tracker": "magic"}, "tracker"),
            ({"experiment": "ball", "seed": -1}, "seed"),
            ({"experiment": "ball", "seed": "x"}, "seed"),
            ({"experiment": "ball", "seed": 2**70}, "seed"),
            ({"experiment": "ball", "frames": 0}, "frames"),
            ({"experiment": "ball", "frames": 10**6}, "frames"),
            ({"experiment": "ball", "parameters": {"sample_count": 0}}, "sample_count"),
            ({"experiment": "ball", "parameters": [1]}, "timeline.0.values"),
            ({"experiment": "ball", "upload": "nothing", "box": [0, 0, 9, 9]}, "upload"),
            ({"experiment": "ball", "upload": "nothing"}, "upload"),
            ({"experiment": "ball", "box": [0, 0, 9, 9]}, "upload"),
            ({"experiment": "ball", "upload": "x", "box": [0, 0, 0, 9]}, "upload"),
            ({"experiment": "ball", "timeline": [{"frame": 3, "values": {"sample_count": 0}}]}, "sample_count"),
            ({"experiment": "ball", "surprise": 1}, "surprise"),
        ],
    )
    def test_refuses(self, client: httpx.Client, body: dict[str, Any], field: str) -> None:
        """A session that cannot be is refused with the field's name, and leaves no session behind."""
        before = len(client.get("/api/v1/sessions").json())
        assert error_of(client.post("/api/v1/sessions", json=body), 422)["field"] == field
        assert len(client.get("/api/v1/sessions").json()) == before

    def test_full_house(self, start_server: Any) -> None:
        """A full house answers 503 with a clear sentence, and has room again when a session ends."""
        with start_server(max_sessions=2) as (_, client):
            first = begin(client)
            begin(client)
            answer = client.post("/api/v1/sessions", json={"experiment": "ball"})
            assert "All 2 places are taken" in error_of(answer, 503)["message"]
            client.delete(f"/api/v1/sessions/{first['id']}")
            begin(client)

    def test_too_many_particles(self, start_server: Any) -> None:
        """The server's own limit of particles counts besides the parameter's."""
        with start_server(max_particles=500) as (_, client):
            session = begin(client, parameters={"sample_count": 500})
            answer = client.patch(f"/api/v1/sessions/{session['id']}/parameters", json={"sample_count": 501})
            assert error_of(answer, 422)["bound"] == "at most 500 on this server"

    def test_too_many_branches(self, start_server: Any) -> None:
        """A session's branches are limited, with a clear sentence."""
        with start_server(max_branches=2) as (_, client):
            session = begin(client)
            url = f"/api/v1/sessions/{session['id']}/branch"
            assert client.post(url, json={"frame": 0}).status_code == 201
            assert "at most 2 branches" in error_of(client.post(url, json={"frame": 0}), 409)["message"]


def test_unknown_session(server: Server, client: httpx.Client) -> None:
    """A session that is not there is a 404 in the one error shape, whatever is asked of it."""
    for method, path in [
        ("GET", ""),
        ("DELETE", ""),
        ("POST", "/resume"),
        ("GET", "/diagnostics"),
        ("GET", "/frame.png"),
        ("POST", "/bookmarks"),
    ]:
        error_of(client.request(method, f"/api/v1/sessions/0123456789abcdef{path}"), 404)


def test_a_look_at_the_picture_interrupts_nothing(client: httpx.Client) -> None:
    """Asking for the picture while a seek is under way neither ends the seek nor waits for it."""
    session = begin(client, frames=2000, parameters={"sample_count": 20_000})
    place = f"/api/v1/sessions/{session['id']}"
    with ThreadPoolExecutor(1) as pool:
        seeking = pool.submit(client.post, f"{place}/transport", json={"action": "seek", "frame": 150})
        for _ in range(5):
            assert client.get(f"{place}/frame.png").status_code == 200
        assert seeking.result().json()["position"] == 150


LONG = "9" * 5000


@pytest.mark.parametrize(
    ("method", "path", "body", "field"),
    [
        ("POST", "", f'{{"experiment": "ball", "seed": {LONG}}}', "seed"),
        ("POST", "", f'{{"recipe": {{"experiment": "ball", "seed": -{LONG}}}}}', "seed"),
        ("PATCH", "/{}/parameters", f'{{"alpha": 1, "sample_count": {LONG}}}', "sample_count"),
        ("POST", "/{}/branch", f'{{"frame": 0, "parameters": {{"alpha": [1, {LONG}]}}}}', "parameters.alpha.1"),
    ],
)
def test_long_numbers(
    client: httpx.Client, session: dict[str, Any], method: str, path: str, body: str, field: str
) -> None:
    """A number with more digits than can be read is refused by the name of its field."""
    address = f"/api/v1/sessions{path.format(session['id'])}"
    answer = client.request(method, address, content=body, headers={"content-type": "application/json"})
    error = error_of(answer, 422)
    assert error["field"] == field
    assert "at most 4300 digits" in error["message"]
