"""What sessions refuse through the REST interface, by the field that is wrong."""

from collections.abc import Iterator
from typing import Any

import httpx
import pytest
from pydantic import BaseModel, TypeAdapter, ValidationError

from pftrack.core.model.marks import Mark
from pftrack.core.model.recipe import Change, Footage, Recipe
from pftrack_server.core.bodies import RequestBody
from tests.server.host import Server, begin, change_values, command, error_of, steer
from tests.session_requests import session_request


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
        assert error_of(client.post("/api/v1/sessions", json=session_request(body)), 422)["field"] == field
        assert len(client.get("/api/v1/sessions").json()) == before

    def test_too_many_particles(self, start_server: Any) -> None:
        """The server's own limit of particles counts besides the parameter's."""
        with start_server(max_particles=500) as (_, client):
            session = begin(client, parameters={"sample_count": 500})
            answer = change_values(client, session["id"], {"sample_count": 501})
            assert error_of(answer, 422)["bound"] == "at most 500 on this server"

    def test_too_many_branches(self, start_server: Any) -> None:
        """A session's branches are limited, with a clear sentence; a change at the end of a run needs one more."""
        with start_server(max_branches=2) as (_, client):
            session = begin(client, frames=5)
            assert command(client, session["id"], "branch", frame=0).status_code == 200
            steer(client, session["id"], "seek", frame=4)
            changed = change_values(client, session["id"], {"sample_count": 50})
            for answer in (command(client, session["id"], "branch", frame=0), changed):
                assert "at most 2 branches" in error_of(answer, 409)["message"]


def test_unknown_session(server: Server, client: httpx.Client) -> None:
    """A session that is not there is a 404 in the one error shape, whatever is asked of it."""
    for method, path in [
        ("GET", ""),
        ("DELETE", ""),
        ("POST", "/resume"),
        ("GET", "/diagnostics"),
        ("GET", "/frame.png"),
        ("GET", "/explanation"),
        ("POST", "/bookmarks"),
        ("POST", "/commands"),
    ]:
        error_of(client.request(method, f"/api/v1/sessions/0123456789abcdef{path}"), 404)


LONG = "9" * 5000


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


@pytest.mark.parametrize(
    ("method", "path", "body", "field"),
    [
        ("POST", "", f'{{"experiment": "ball", "seed": {LONG}}}', "seed"),
        ("POST", "", f'{{"recipe": {{"experiment": "ball", "seed": -{LONG}}}}}', "seed"),
        ("POST", "/{}/commands", f'{{"kind": "change", "values": {{"sample_count": {LONG}}}}}', "sample_count"),
        ("POST", "/{}/commands", f'{{"kind": "branch", "frame": 0, "values": {{"a": [1, {LONG}]}}}}', "a"),
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
