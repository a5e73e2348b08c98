"""Filters that a recipe names by their hash: nothing but what the server's owner has named is read, let alone run."""

import asyncio
import json
import os
import zipfile
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import httpx
import pytest
import yaml

from pftrack.core.model.parameters import LONGEST_FILE
from pftrack.experiments.own.code import digest_of
from pftrack_server.store.files import DataDirectory
from tests.server.follow_jobs import ended
from tests.server.host import begin, command, error_of
from tests.server.store.test_filters import TEXT, owned


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def client(place: Path) -> Iterator[httpx.Client]:
    """A client of a server of this module's own, beside a folder of files that it was not started with."""
    (place / "Downloads").mkdir()
    with owned(place) as (_, client):
        yield client


@pytest.fixture
def evil(place: Path) -> Iterator[dict[str, Any]]:
    """A recipe that brings a text and names a file with the same text, which lies elsewhere on the server's disk."""
    run = place / "it-has-run"
    run.unlink(missing_ok=True)
    text = f"{TEXT}\nopen({str(run)!r}, 'w').close()\n"
    (place / "Downloads" / "evil.py").write_text(text)
    filters = {"evil": [text], "b": ["sha256:../../Downloads/evil"]}
    yield {"experiment": "ball", "tracker": "evil", "frames": 9, "filters": filters}
    assert not run.exists()


def saved(recipe: dict[str, Any]) -> dict[str, Any]:
    """The form in which a saved run with a recipe is sent."""
    said = {"format": "pftrack-run", "version": 2, "recipe": recipe, "computed": 1, "estimates_sha256": ""}
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("run.json", json.dumps(said))
    return {"files": {"file": ("evil.pft", packed.getvalue())}}


def lecture(recipe: dict[str, Any]) -> dict[str, Any]:
    return {"title": "x", "items": [{"session": {"recipe": recipe}}]}


def twice(recipe: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"json": {"runs": [{"recipe": recipe}, {"recipe": recipe}], **more}}


WAYS_IN: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    "sessions": lambda recipe: {"json": {"recipe": recipe}},
    "runs/import": saved,
    "comparisons": twice,
    "comparisons/saved": lambda recipe: twice(recipe, title="x"),
    "comparisons/exports/csv": twice,
    "source-code": twice,
    "lectures": lambda recipe: {"json": lecture(recipe)},
    "lectures/import": lambda recipe: {"content": f"---\n{yaml.safe_dump(lecture(recipe))}---\n"},
}


def test_no_way_in_leads_to_a_file_elsewhere(client: httpx.Client, evil: dict[str, Any]) -> None:
    """A recipe with anything but a text or a hash in hexadecimal digits is refused, and nothing of it has run."""
    for way, body in WAYS_IN.items():
        told = error_of(client.post(f"/api/v1/{way}", **body(evil)), 422)["message"]
        assert "64 hexadecimal digits in lower case" in told or "recipe.filters.b.0" in told, way


def test_every_way_in_takes_a_hash_that_is_known(client: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that what is refused above is refused for its filter alone.

    No way in reads a filter's file in the event loop, which a slow disk would stop.
    """
    read: list[bool] = []
    kept_under = DataDirectory._filter

    def watched(files: DataDirectory, digest: str) -> str | None:
        read.append(asyncio._get_running_loop() is None)
        return kept_under(files, digest)

    monkeypatch.setattr(DataDirectory, "_filter", watched)
    recipe = {"experiment": "ball", "tracker": "mine", "frames": 9, "filters": {"mine": [digest_of(TEXT)]}}
    for way, body in WAYS_IN.items():
        answer = client.post(f"/api/v1/{way}", **body(recipe))
        assert answer.is_success, answer.text
    assert len(read) > 3
    assert all(read)


REPLACEMENTS: dict[str, Callable[[Path], object]] = {
    "another text": lambda path: path.write_text(f"{TEXT}\nx = 1\n"),
    "no text": lambda path: path.write_bytes(b"\xff\xfe"),
    "too large": lambda path: path.write_bytes(TEXT.encode() + bytes(4 * LONGEST_FILE)),
    "folder": Path.mkdir,
    "FIFO": os.mkfifo,
    "link": lambda path: path.symlink_to(path),
}


@pytest.fixture(scope="module")
def session(client: httpx.Client) -> str:
    """A session by the owner's filter, whose worker has its text."""
    name: str = begin(client, tracker="mine", frames=45)["id"]
    command(client, name, "seek", frame=40)
    return name


@pytest.mark.parametrize("name", REPLACEMENTS)
def test_no_replacement_is_used(client: httpx.Client, place: Path, session: str, name: str) -> None:
    """Whatever it is; all that would execute it says so, and the server goes on."""
    kept = place / "data" / "filters" / f"{digest_of(TEXT).removeprefix('sha256:')}.py"
    recipe = client.get(f"/api/v1/sessions/{session}").json()["recipe"]
    kept.rename(kept.with_name("aside"))
    try:
        REPLACEMENTS[name](kept)
        for way in ("sessions", "comparisons", "comparisons/exports/csv"):
            refused = error_of(client.post(f"/api/v1/{way}", **WAYS_IN[way](recipe)), 422)
            assert "version of the file that is not here" in refused["message"], way
        of = f"/api/v1/sessions/{session}"
        jobs = (
            client.post("/api/v1/runs/import", **saved(recipe)),
            client.post(f"{of}/fits", json={"numbers": ["gamma_px"]}),
            client.post(f"{of}/exports/csv"),
            client.post(f"{of}/explorations", json={"kind": "ensemble", "seconds": 5}),
        )
        for begun in jobs:
            told = ended(client, begun)
            assert "version of the file that is not here" in told["error"], told["kind"]
    finally:
        if kept.is_dir() and not kept.is_symlink():
            kept.rmdir()
        else:
            kept.unlink()
        kept.with_name("aside").rename(kept)
