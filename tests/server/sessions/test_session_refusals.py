"""What sessions refuse through the REST interface, by the field that is wrong."""

from collections.abc import Iterator
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

HEADERS = {"content-type": "application/json"}
LONG = "9" * 5000

BEGUN: list[tuple[Any, str]] = [
    ({}, "experiment"),
    ({"experiment": "chess"}, "experiment"),
    ({"tracker": "magic"}, "tracker"),
    ({"seed": -1}, "seed"),
    ({"seed": "x"}, "seed"),
    ({"seed": 2**70}, "seed"),
    ({"frames": 0}, "frames"),
    ({"frames": 10**6}, "frames"),
    ({"parameters": {"sample_count": 0}}, "sample_count"),
    ({"parameters": [1]}, "timeline.0.values"),
    ({"upload": "nothing", "box": [0, 0, 9, 9]}, "upload"),
    ({"upload": "nothing"}, "upload"),
    ({"box": [0, 0, 9, 9]}, "upload"),
    ({"upload": "x", "box": [0, 0, 0, 9]}, "upload"),
    ({"timeline": [{"frame": 3, "values": {"sample_count": 0}}]}, "sample_count"),
    ({"frames": 40, "timeline": [{"frame": 40, "values": {"sample_count": 150}}]}, "timeline"),
    ({"surprise": 1}, "surprise"),
    (f'{{"recipe": {{"experiment": "ball", "seed": -{LONG}}}}}', "seed"),
]
"""Sessions that cannot be, on the ball unless told otherwise, and the field that is to blame."""

CHANGES: list[tuple[Any, str]] = [
    *(({"sample_count": value}, "sample_count") for value in (0, 10**30, "abc", None, [1], {"a": 1}, 1.5)),
    *(({"tracker": value}, "tracker") for value in ("magic", None, 3)),
    ({"nonsense": 1}, "nonsense"),
    ({"": 1}, ""),
    ({"gamma_min_px": 9, "gamma_max_px": 3}, "gamma_min_px"),
    ({"sample_count": 100, "occlusion_width_px": "wide"}, "occlusion_width_px"),
    *((f'{{"gamma_px": {number}}}', "gamma_px") for number in ("NaN", "Infinity", "-Infinity", "1e999")),
    (f'{{"sample_count": {LONG}}}', "sample_count"),
]
"""Values that a session does not take, as such or as text."""

COMMANDS: list[tuple[Any, str | None]] = [
    *(({"kind": "restart", "seed": seed}, "seed") for seed in (-1, 2**53, 1.5, "seven")),
    ({"kind": "fly"}, "kind"),
    ({}, "kind"),
    ({"kind": "seek"}, "frame"),
    *(({"kind": "seek", "frame": frame}, "frame") for frame in (240, -1, "soon")),
    ({"kind": "speed"}, "speed"),
    *(({"kind": "speed", "speed": speed}, "speed") for speed in (11, 0.01, -1)),
    ({"kind": "play", "warp": 9}, "warp"),
    *(({"kind": "stop_at", "probability": wrong}, "probability") for wrong in (0, 1.5, "often")),
    ({"kind": "branch", "frame": 5}, "frame"),
    ({"kind": "branch", "frame": 0, "values": {"tracker": "magic"}}, "tracker"),
    ({"kind": "branch", "frame": 0, "values": {"sample_count": 0}}, "sample_count"),
    (f'{{"kind": "branch", "frame": 0, "values": {{"a": [1, {LONG}]}}}}', "a"),
    ({"kind": "inspect", "place": [1e9, 0]}, None),
    ({"kind": "inspect", "particle": 10**6}, "particle"),
    *((text, None) for text in ("", "{", "[]", "null", "7", '"x"', '{"a": 1', "\x00")),
    ('{"kind": "change", "values": {"a": "\\ud800"}}', None),
]
"""Commands that are none, or ask for what is not there."""


@pytest.fixture(scope="module")
def stays(server: Server) -> Iterator[tuple[httpx.Client, dict[str, Any]]]:
    """One session to which all of it is said, and its client."""
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
    """A session, values, which have a bound, or a command: with the name of the field, where it has one."""
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
    """They count besides the parameter's own; a change at the end of a run needs one more branch."""
    with start_server(max_particles=500, max_branches=2) as (_, client):
        session = begin(client, frames=5, parameters={"sample_count": 500})
        answer = change_values(client, session["id"], {"sample_count": 501})
        assert error_of(answer, 422)["bound"] == "at most 500 on this server"
        assert command(client, session["id"], "branch", frame=0).status_code == 200
        steer(client, session["id"], "seek", frame=4)
        changed = change_values(client, session["id"], {"sample_count": 50})
        for answer in (command(client, session["id"], "branch", frame=0), changed):
            assert "at most 2 branches" in error_of(answer, 409)["message"]


def test_unknown_session_or_branch(stays: tuple[httpx.Client, dict[str, Any]]) -> None:
    """What is not there is a 404 in the one error shape, whatever is asked of it."""
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
