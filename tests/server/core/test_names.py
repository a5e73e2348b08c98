"""What people call things: sessions, runs and files by their clip or preset, or by a name that somebody gave."""

import re
from typing import Any
from urllib.parse import unquote

import httpx
import pytest

from pftrack.experiments import find
from pftrack_server.work.runs import run_file_name
from tests.server.follow_jobs import taken
from tests.server.host import begin
from tests.server.uploads.test_suitability import box
from tests.server.uploads.test_suitability import clip as clip  # noqa: PLC0414 - a fixture
from tests.server.uploads.test_suitability import upload as upload  # noqa: PLC0414 - a fixture

PRESET = find("ball").presets[-1]


@pytest.fixture
def session(client: httpx.Client) -> dict[str, object]:
    """One that begins as a preset."""
    wish = {"experiment": "ball", "tracker": PRESET.tracker, "seed": PRESET.seed, "parameters": dict(PRESET.parameters)}
    return begin(client, **wish)


def test_a_session_is_called_by_its_preset_or_by_a_name_that_is_given(
    client: httpx.Client, session: dict[str, object]
) -> None:
    """The run that is saved of it and the files that are made of it are, too; an empty name brings back the first.

    Sessions and runs are found by their names.
    """
    path = f"/api/v1/sessions/{session['id']}"
    assert session["name"] == PRESET.title
    run = client.post("/api/v1/runs", json={"session": session["id"]}).json()
    assert run["title"].startswith(PRESET.title)
    table = taken(client, str(session["id"]), "csv")
    assert f'filename="{run_file_name("ball", PRESET.title)}-' in table.headers["content-disposition"]
    assert client.patch(path, json={"name": " Tuesday's ball "}).json()["name"] == "Tuesday's ball"
    assert client.patch(f"/api/v1/runs/{run['id']}", json={"title": "Wednesday"}).json()["title"] == "Wednesday"
    found = {day: client.get("/api/v1/work", params={"q": day}).json() for day in ("tuesday", "wednesday")}
    assert [each["name"] for each in found["tuesday"]["sessions"]] == ["Tuesday's ball"]
    assert [each["id"] for each in found["wednesday"]["runs"]] == [run["id"]]
    saved = client.get(f"/api/v1/runs/{run['id']}/download")
    assert 'filename="ball-wednesday-' in saved.headers["content-disposition"]
    assert client.patch(path, json={"name": ""}).json()["name"] == PRESET.title
    assert client.patch(f"/api/v1/runs/{run['id']}", json={"title": ""}).status_code == 422


def test_a_name_is_one_line_of_what_can_be_seen(client: httpx.Client, session: dict[str, object]) -> None:
    """Of a session, a run and a branch: what turns the direction of all that follows is left out."""
    path = f"/api/v1/sessions/{session['id']}"
    run = client.post("/api/v1/runs", json={"session": session["id"]}).json()["id"]
    for given, kept in {
        "<img src=x onerror=alert(1)>": "<img src=x onerror=alert(1)>",
        "\u202egpj.evil\u2066 a\x00\x1b[31m\x7f": "gpj.evil a[31m",
        "two\r\nlines\u2028and a third": "two lines and a third",
        "قطة 猫 é": "قطة 猫 é",
    }.items():
        assert client.patch(path, json={"name": given}).json()["name"] == kept
        assert client.post("/api/v1/runs", json={"session": session["id"], "title": given}).json()["title"] == kept
        assert client.patch(f"/api/v1/runs/{run}", json={"title": given}).json()["title"] == kept
        told = client.get(f"/api/v1/runs/{run}/download").headers["content-disposition"]
        assert not re.search(r"[<>\x00-\x1f\u202e]", unquote(told))
        made = client.post(f"{path}/commands", json={"kind": "branch", "frame": 0, "title": given}).json()["branches"]
        assert made[-1]["title"] == kept


def test_a_name_that_cannot_be_seen_is_none(client: httpx.Client, session: dict[str, object]) -> None:
    """A session is called as before anybody named it; a run, which somebody saved, keeps its title."""
    path = f"/api/v1/sessions/{session['id']}"
    for blank in (" ", "\u202e", "\x00\n", "\u200b"):
        assert client.patch(path, json={"name": blank}).json()["name"] == PRESET.title
        run = client.post("/api/v1/runs", json={"session": session["id"], "title": blank}).json()
        assert run["title"].startswith(PRESET.title)
        assert client.patch(f"/api/v1/runs/{run['id']}", json={"title": blank}).status_code == 422
    assert client.patch(path, json={"name": "x" * 10_000}).status_code == 422


def test_names_of_files_are_plain() -> None:
    """Whatever people call a run, and whatever says no more than the experiment."""
    title = find("ball").title
    assert run_file_name("ball", title) == "ball"
    assert run_file_name("ball", f"{title} · Condensation") == "ball-condensation"
    assert run_file_name("ball", "../Straße: 100 %/a") == "ball-straße-100-a"
    assert run_file_name("gone", "a b") == "gone-a-b"
    assert len(run_file_name("ball", "x" * 200)) < 80


def test_a_clip_gives_its_name_and_what_follows_it_another(client: httpx.Client, upload: str) -> None:
    """A target tracked by its colour is not a ball behind an occluder, and what matters on a clip is turned first."""
    recipe = {"experiment": "ball", "footage": {"mark": box(31, 51), "start": 0}}
    session: dict[str, Any] = client.post("/api/v1/sessions", json={"recipe": recipe, "upload": upload}).json()
    assert (session["name"], session["title"]) == ("walk", "Colour blob")
    names = [each["name"] for each in session["declarations"]]
    assert set(session["about"]) < set(names)
    groups = {each["name"]: each["group"] for each in session["declarations"]}
    assert "Occluder and look-alikes" not in {groups[name] for name in session["about"]}
    assert groups[names[0]] != "Occluder and look-alikes"
    run = client.post("/api/v1/runs", json={"session": session["id"]}).json()
    assert run["title"].startswith("walk · ")
    assert client.get("/api/v1/work", params={"q": "blob walk"}).json()["found"]["runs"] == 1
    (listed,) = (each for each in client.get("/api/v1/experiments").json() if each["id"] == "ball")
    assert (listed["title"], listed["clip_title"]) == ("Ball behind an occluder", "Colour blob")
