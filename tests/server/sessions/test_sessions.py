"""Sessions through the REST interface: start, play, branch, move particles, and refusals by field."""

import time
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import httpx
import pytest
from pydantic import BaseModel, TypeAdapter, ValidationError

from pftrack.core.model.marks import Mark
from pftrack.core.model.recipe import Change, Footage, Recipe
from pftrack_server.core.bodies import RequestBody
from tests.server.asking import get
from tests.server.host import Server, begin, change_values, command, error_of, steer
from tests.session_requests import session_request
from tests.waiting import wait_for


def test_a_new_session_tells_everything(client: httpx.Client) -> None:
    """A session tells its declarations, the values in force, and the addresses of its page and scene.

    A client that chose the name can end a session without having seen the answer; no other session gets that name.
    Played at its last frame, a run begins again.
    """
    name, wish = "0123456789abcdef", {"experiment": "ball", "tracker": "apf", "frames": 5}
    body = session_request({**wish, "parameters": {"sample_count": 300}})
    answers = [client.post("/api/v1/sessions", json={**body, "id": given}) for given in (name, name, "../etc")]
    assert [answer.status_code for answer in answers] == [201, 409, 422]
    session = answers[0].json()
    assert (session["id"], session["tracker"], session["parameters"]["sample_count"]) == (name, "apf", 300)
    assert {item["name"] for item in session["declarations"]} == set(session["parameters"])
    assert (session["state"], session["position"], session["computed"]) == ("ready", 0, 0)
    assert (session["page"], session["viewer"]) == (f"session/{name}", f"viz/{name}/")
    assert get(client, name) == session
    steer(client, name, "speed", speed=0.1)
    steer(client, name, "seek", frame=4)
    assert steer(client, name, "play")["position"] == 0
    place = f"/api/v1/sessions/{name}"
    assert (client.delete(place).status_code, client.get(place).status_code) == (204, 404)


def test_plays_in_real_time(client: httpx.Client, session: dict[str, Any]) -> None:
    """A run plays at the source's rate times the requested speed, unless other programs keep the processor."""
    steer(client, session["id"], "speed", speed=2)
    steer(client, session["id"], "play")
    half_seconds = []
    for count in range(1, 6):
        wait_for(lambda count=count: get(client, session["id"])["computed"] >= 30 * count)
        half_seconds.append(time.monotonic())
    # At twice the requested rate it would last 1 s; at half of it no part would be below 1 s.
    assert half_seconds[-1] - half_seconds[0] > 1.2
    assert min(after - before for before, after in pairwise(half_seconds)) < 0.8


def test_branches_have_colours(client: httpx.Client, session: dict[str, Any]) -> None:
    """The shown branch has the estimate's colour; the branch drawn beside it has the second run's colour."""

    def colours_after(kind: str, **more: Any) -> dict[str, str]:
        return {branch["id"]: branch["colour"] for branch in steer(client, session["id"], kind, **more)["branches"]}

    steer(client, session["id"], "seek", frame=20)
    values = {"tracker": "condensation", "sample_count": 100}
    assert colours_after("branch", frame=8, values=values) == {"b0": "#009e73", "b1": "#0072b2"}
    assert colours_after("activate", branch="b0") == {"b0": "#0072b2", "b1": "#009e73"}
    colours_after("branch", frame=8, values=values)
    for before in ("b1", "b2"):
        colours_after("activate", branch=before)
        assert colours_after("activate", branch="b0")[before] == "#009e73"


def test_a_particle_is_moved_in_the_shown_frame(client: httpx.Client, session: dict[str, Any]) -> None:
    """In the newest frame a move changes the run, in the past it makes a branch; for another frame it is refused."""
    steer(client, session["id"], "seek", frame=9)
    assert steer(client, session["id"], "move", frame=9, particle=7, place=[-5, 60])["frame"] == 10
    found = get(client, session["id"])
    assert [(each["frame"], each["moved"]) for each in found["timeline"]] == [(10, ["Particle 7 moved to (0, 60)"])]
    steer(client, session["id"], "seek", frame=4)
    assert steer(client, session["id"], "move", frame=4, place=[40, 60])["branch"] == "b1"
    assert "pause" in error_of(command(client, session["id"], "move", frame=3, place=[40, 60]), 409)["message"]
    error_of(command(client, session["id"], "move", frame=4, particle=10**6, place=[40, 60]), 422)


HEADERS = {"content-type": "application/json"}
LONG = "9" * 5000

BEGUN: list[tuple[Any, str]] = [
    ({}, "experiment"),
    ({"experiment": "chess"}, "experiment"),
    ({"tracker": "magic"}, "tracker"),
    *(({"seed": seed}, "seed") for seed in (-1, 2**70)),
    *(({"frames": frames}, "frames") for frames in (0, 10**6)),
    ({"parameters": [1]}, "timeline.0.values"),
    *(({**upload, "box": [0, 0, 9, 9]}, "upload") for upload in ({"upload": "nothing"}, {})),
    ({"timeline": [{"frame": 3, "values": {"sample_count": 0}}]}, "sample_count"),
    ({"frames": 40, "timeline": [{"frame": 40, "values": {"sample_count": 150}}]}, "timeline"),
    ({"surprise": 1}, "surprise"),
    (f'{{"recipe": {{"experiment": "ball", "seed": -{LONG}}}}}', "seed"),
]
"""Impossible sessions, of the ball by default, and the field at fault."""

CHANGES: list[tuple[Any, str]] = [
    *(({"sample_count": value}, "sample_count") for value in (0, 10**30, "abc", None, 1.5)),
    *(({"tracker": value}, "tracker") for value in ("magic", None)),
    ({"nonsense": 1}, "nonsense"),
    ({"gamma_min_px": 9, "gamma_max_px": 3}, "gamma_min_px"),
    ({"sample_count": 100, "occlusion_width_px": "wide"}, "occlusion_width_px"),
    *((f'{{"gamma_px": {number}}}', "gamma_px") for number in ("NaN", "Infinity", "1e999")),
    (f'{{"sample_count": {LONG}}}', "sample_count"),
]
"""Values that a session does not take, as such or as text."""

COMMANDS: list[tuple[Any, str | None]] = [
    *(({"kind": "restart", "seed": seed}, "seed") for seed in (-1, 2**53, 1.5)),
    ({"kind": "fly"}, "kind"),
    ({}, "kind"),
    *(({"kind": "seek", "frame": frame}, "frame") for frame in (240, -1, None)),
    *(({"kind": "speed", "speed": speed}, "speed") for speed in (11, 0.01, -1)),
    ({"kind": "play", "warp": 9}, "warp"),
    *(({"kind": "stop_at", "probability": wrong}, "probability") for wrong in (0, 1.5)),
    ({"kind": "branch", "frame": 5}, "frame"),
    ({"kind": "branch", "frame": 0, "values": {"tracker": "magic"}}, "tracker"),
    (f'{{"kind": "branch", "frame": 0, "values": {{"a": [1, {LONG}]}}}}', "a"),
    ({"kind": "inspect", "place": [1e9, 0]}, None),
    ({"kind": "inspect", "particle": 10**6}, "particle"),
    *((text, None) for text in ("", "{", "[]", "null", '"x"', "\x00")),
    ('{"kind": "change", "values": {"a": "\\ud800"}}', None),
]
"""Malformed commands, and commands for things that do not exist."""


@pytest.fixture(scope="module")
def stays(server: Server) -> Iterator[tuple[httpx.Client, dict[str, Any]]]:
    """The one session that receives all commands, and its client."""
    with httpx.Client(base_url=server.url, timeout=60, verify=False) as client:  # noqa: S501 - a local server
        session = begin(client)
        yield client, session
        assert get(client, session["id"]) == session, "nothing that was refused changed anything"
        client.delete(f"/api/v1/sessions/{session['id']}")


REFUSED = [
    *(("begin", body, field) for body, field in BEGUN),
    *(("change", values, field) for values, field in CHANGES),
    *(("command", body, field) for body, field in COMMANDS),
]


@pytest.mark.parametrize(("what", "body", "field"), REFUSED)
def test_what_cannot_be_is_refused(
    stays: tuple[httpx.Client, dict[str, Any]], what: str, body: Any, field: str | None
) -> None:
    """The refusal names the field, and for a value its bound; nothing is begun or changed."""
    client, session = stays
    before, path = client.get("/api/v1/sessions").json(), f"/{session['id']}/commands"
    is_text = isinstance(body, str)
    if what == "begin":
        path, body = "", session_request(body if is_text or not body else {"experiment": "ball", **body})
    elif what == "change":
        body = f'{{"kind": "change", "values": {body}}}' if is_text else {"kind": "change", "values": body}
    said = {"content": body} if is_text else {"json": body}
    error = error_of(client.post(f"/api/v1/sessions{path}", headers=HEADERS, **said), 422)
    assert LONG not in str(body) or "at most 4300 digits" in error["message"]
    assert field is None or error["field"] == field
    assert error.get("bound") or is_text or what != "change"
    assert client.get("/api/v1/sessions").json() == before


def test_particles_and_branches_have_limits_of_the_server(start_server: Any) -> None:
    """They hold besides a parameter's own bounds; a change at the end of a run needs one more branch.

    A worker has the limits by which an upload is taken in, also where they are wider than usual.
    """
    most = {"max_particles": 500, "max_branches": 2, "max_upload_bytes": 3 * 1024**3, "max_frames": 300}
    with start_server(**most) as (server, client):
        session = begin(client, frames=5, parameters={"sample_count": 500})
        limits = server.run(server.manager.config(server.manager.get(session["id"]).spec)).limits
        assert (limits.file_bytes, limits.frames) == (3 * 1024**3, 300)
        answer = change_values(client, session["id"], {"sample_count": 501})
        assert error_of(answer, 422)["bound"] == "at most 500 on this server"
        assert command(client, session["id"], "branch", frame=0).status_code == 200
        steer(client, session["id"], "seek", frame=4)
        changed = change_values(client, session["id"], {"sample_count": 50})
        for answer in (command(client, session["id"], "branch", frame=0), changed):
            assert "at most 2 branches" in error_of(answer, 409)["message"]


def test_unknown_session_or_branch(stays: tuple[httpx.Client, dict[str, Any]]) -> None:
    """Every request for something unknown is a 404 in the one error shape."""
    client, session = stays
    paths = ["resume", "bookmarks", "commands", "diagnostics", "frame.png", "explanation", ""]
    for method, path in [*zip(["POST"] * 3 + ["GET"] * 4, paths, strict=True), ("DELETE", "")]:
        error_of(client.request(method, f"/api/v1/sessions/0123456789abcdef/{path}".rstrip("/")), 404)
    error_of(command(client, session["id"], "activate", branch="b9"), 404)
    error_of(client.get(f"/api/v1/sessions/{session['id']}/diagnostics?branch=b9"), 404)


def bodies(base: type[BaseModel] = RequestBody) -> Iterator[type[BaseModel]]:
    """All models of what a client sends, but for a recipe's."""
    for model in base.__subclasses__():
        yield model
        yield from bodies(model)


@pytest.mark.parametrize("model", [*bodies(), Recipe, Footage, Change, *Mark.__subclasses__()])
def test_true_is_not_the_number_one(model: type[Any]) -> None:
    """No number of any body takes it."""
    for name, field in TypeAdapter(model).json_schema()["properties"].items():
        kinds = {each.get("type") for each in (field, *field.get("anyOf", ()))}
        if kinds & {"integer", "number"}:
            with pytest.raises(ValidationError) as caught:
                TypeAdapter(model).validate_python({name: True})
            assert name in {each["loc"][0] for each in caught.value.errors() if each["loc"]}, name
