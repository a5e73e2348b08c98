"""What people call things: sessions, runs and files by their clip or preset, or by a name that somebody gave."""

import re
from typing import Any
from urllib.parse import unquote

import httpx
import pytest

from pftrack.experiments import find
from pftrack_server.work.runs import run_file_name
from tests.server.follow_jobs import taken
from tests.server.host import begin, box

PRESET = find("ball").presets[-1]


@pytest.fixture
def session(client: httpx.Client) -> dict[str, object]:
    """One that begins as a preset."""
    wish = {"experiment": "ball", "tracker": PRESET.tracker, "seed": PRESET.seed, "parameters": dict(PRESET.parameters)}
    return begin(client, **wish)


def test_a_session_is_called_by_its_preset_or_by_a_given_name(client: httpx.Client, session: dict[str, object]) -> None:
    """So are its saved runs and files; sessions and runs are found by their names."""
    path = f"/api/v1/sessions/{session['id']}"
    assert session["name"] == PRESET.title
    run = client.post("/api/v1/runs", json={"session": session["id"]}).json()
    assert run["title"].startswith(PRESET.title)
    recipe = taken(client, str(session["id"]), "recipe")
    assert f'filename="{run_file_name("ball", PRESET.title)}-' in recipe.headers["content-disposition"]
    assert client.patch(path, json={"name": " Tuesday's ball "}).json()["name"] == "Tuesday's ball"
    assert client.patch(f"/api/v1/runs/{run['id']}", json={"title": "Wednesday"}).json()["title"] == "Wednesday"
    found = {day: client.get("/api/v1/work", params={"q": day}).json() for day in ("tuesday", "wednesday")}
    assert [each["name"] for each in found["tuesday"]["sessions"]] == ["Tuesday's ball"]
    assert [each["id"] for each in found["wednesday"]["runs"]] == [run["id"]]
    saved = client.get(f"/api/v1/runs/{run['id']}/download")
    assert 'filename="ball-wednesday-' in saved.headers["content-disposition"]


def test_a_name_is_one_line_of_visible_characters(client: httpx.Client, session: dict[str, object]) -> None:
    """For sessions, runs and branches, characters that turn the direction of the following text are removed.

    Without a visible character a session gets its first name back, and a run, which a person saved, keeps its title.
    """
    path, posted = f"/api/v1/sessions/{session['id']}", {"session": session["id"]}
    run = client.post("/api/v1/runs", json=posted).json()["id"]
    for given, kept in {
        "<img src=x onerror=alert(1)>": "<img src=x onerror=alert(1)>",
        "\u202egpj.evil\u2066 a\x00\x1b[31m\x7f": "gpj.evil a[31m",
        "two\r\nlines\u2028and a third": "two lines and a third",
        "قطة 猫 é": "قطة 猫 é",
    }.items():
        assert client.patch(path, json={"name": given}).json()["name"] == kept
        assert client.post("/api/v1/runs", json={**posted, "title": given}).json()["title"] == kept
        assert client.patch(f"/api/v1/runs/{run}", json={"title": given}).json()["title"] == kept
        told = client.get(f"/api/v1/runs/{run}/download").headers["content-disposition"]
        assert not re.search(r"[<>\x00-\x1f\u202e]", unquote(told))
        made = client.post(f"{path}/commands", json={"kind": "branch", "frame": 0, "title": given}).json()["branches"]
        assert made[-1]["title"] == kept
    for blank in ("", " ", "\u202e", "\x00\n", "\u200b"):
        assert client.patch(path, json={"name": blank}).json()["name"] == PRESET.title
        assert client.patch(f"/api/v1/runs/{run}", json={"title": blank}).status_code == 422
    assert client.post("/api/v1/runs", json={**posted, "title": " "}).json()["title"].startswith(PRESET.title)
    assert client.patch(path, json={"name": "x" * 10_000}).status_code == 422


def test_names_of_files_are_plain() -> None:
    """Whatever people call a run, and whatever says no more than the experiment."""
    title = find("ball").title
    assert run_file_name("ball", title) == "ball"
    assert run_file_name("ball", f"{title} · Condensation") == "ball-condensation"
    assert run_file_name("ball", "../Straße: 100 %/a") == "ball-straße-100-a"
    assert run_file_name("gone", "a b") == "gone-a-b"
    assert len(run_file_name("ball", "x" * 200)) < 80


def test_a_clip_gives_its_name(client: httpx.Client, upload: str) -> None:
    """On a clip the target is not a ball behind an occluder, and the first controls are those that matter there."""
    recipe = {"experiment": "ball", "footage": {"mark": box(31, 51), "start": 0}}
    session: dict[str, Any] = client.post("/api/v1/sessions", json={"recipe": recipe, "upload": upload}).json()
    assert (session["name"], session["title"]) == ("walk", "Colour blob")
    groups = {each["name"]: each["group"] for each in session["declarations"]}
    assert set(session["about"]) < set(groups)
    assert "Occluder and look-alikes" not in {groups[name] for name in (*session["about"], next(iter(groups)))}
    assert client.post("/api/v1/runs", json={"session": session["id"]}).json()["title"].startswith("walk · ")
    assert client.get("/api/v1/work", params={"q": "blob walk"}).json()["found"]["runs"] == 1
    (listed,) = (each for each in client.get("/api/v1/experiments").json() if each["id"] == "ball")
    assert (listed["title"], listed["clip_title"]) == ("Ball behind an occluder", "Colour blob")
