"""Filters of the server's owner: files named on its command line, which sessions follow; recipes name their hashes."""

import asyncio
import json
import os
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import httpx
import pytest
import yaml

from pftrack.core.model.parameters import LONGEST_FILE
from pftrack.experiments import find
from pftrack.experiments.own.code import digest_of
from pftrack.experiments.own.extension import example_of
from pftrack_server.core.settings import Settings
from pftrack_server.store.files import DataDirectory
from tests.server.asking import get
from tests.server.follow_jobs import bring_in, ended, import_refusal
from tests.server.host import Server, begin, change_values, command, error_of, granted, post, running, steer
from tests.waiting import wait_for

TEXT = example_of(find("ball"))
TOKEN = "a token of the owner"
HEADERS = {"Authorization": f"Bearer {TOKEN}"}
FAILING = TEXT.replace("return np.log(0.02", "return np.log(-0.5")
FAILING_LINE = TEXT[: TEXT.index("def log_likelihood")].count("\n") + 1


@contextmanager
def owned(folder: Path) -> Iterator[tuple[Server, httpx.Client]]:
    """Run a server whose owner has named the file `mine.py` of a folder, with a client that has the token."""
    file = folder / "mine.py"
    file.write_text(TEXT)
    with (
        running(Settings(data_dir=folder / "data", filters=(file,), token=TOKEN)) as server,
        httpx.Client(base_url=server.url, timeout=60, headers=HEADERS, verify=False) as client,  # noqa: S501
    ):
        yield server, client


@pytest.fixture
def client(tmp_path: Path) -> Iterator[httpx.Client]:
    with owned(tmp_path) as (_, client):
        yield client


@pytest.fixture
def file(tmp_path: Path, client: httpx.Client) -> Path:
    return tmp_path / "mine.py"


def test_saving_the_file_changes_the_running_session(client: httpx.Client, file: Path) -> None:
    """The run continues at its frame as a branch, with the new parameters and defaults.

    Tracker and parameters that a person has chosen stay, also at the end of a run.
    """
    listed = next(each for each in client.get("/api/v1/experiments").json() if each["id"] == "ball")
    assert "mine" in [each["id"] for each in listed["trackers"]]
    session = begin(client, tracker="mine", frames=40)
    assert "noise_px" in [each["name"] for each in session["declarations"]]
    assert TEXT[:40] not in json.dumps(session), "pages are told the file's hash"
    session = session["id"]
    steer(client, session, "seek", frame=20)
    change_values(client, session, {"sample_count": 350})

    file.write_text(TEXT.replace("noise_px: float = 3.0", "extra: int = 7  # of no use\n    noise_px: float = 4.5"))
    told = wait_for(lambda: (now := get(client, session))["branch"] != "b0" and now)
    assert (told["position"], told["parameters"]["mine_version"], told["parameters"]["sample_count"]) == (20, 2, 350)
    assert (told["parameters"]["noise_px"], told["parameters"]["extra"]) == (4.5, 7)
    declared = lambda: {each["name"]: each for each in get(client, session)["declarations"]}  # noqa: E731
    extra = wait_for(lambda: declared().get("extra"))
    assert (extra["description"], extra["maximum"]) == ("Of no use.", 70)
    old = command(client, session, "activate", branch="b0").json()
    assert (old["branch"], old["parameters"]["mine_version"], old["parameters"]["noise_px"]) == ("b0", 1, 3.0)

    session = begin(client, tracker="mine", frames=40)["id"]
    steer(client, session, "seek", frame=39)
    change_values(client, session, {"tracker": "condensation", "sample_count": 444})
    chosen = get(client, session)
    file.write_text(file.read_text().replace("noise_px: float = 4.5", "noise_px: float = 5.5"))
    told = wait_for(lambda: (now := get(client, session))["branch"] != chosen["branch"] and now)
    assert told["tracker"] == "condensation"
    version = chosen["parameters"]["mine_version"] + 1
    assert told["parameters"] == chosen["parameters"] | {"mine_version": version, "noise_px": 5.5}


@pytest.mark.parametrize("tracker", ["mine", "condensation"])
def test_a_saved_file_is_tried_at_once(client: httpx.Client, file: Path, tracker: str) -> None:
    """Even while the run is paused, or under another tracker; no frame is computed, and the newest mistake is shown.

    A mistake in a step stops the run at its last frame; a mended file continues it.
    """
    session = begin(client, tracker=tracker)["id"]
    steer(client, session, "seek", frame=5)
    problem = lambda: get(client, session)["problem"]  # noqa: E731 - one line of reading
    file.write_text(FAILING)
    told = wait_for(problem)
    assert (told["file"], told["line"]) == ("mine.py", FAILING_LINE)
    assert "log_likelihood returned NaN" in told["text"]
    if tracker == "mine":
        wait_for(lambda: get(client, session)["branch"] == "b1")
        assert "log_likelihood returned NaN" in error_of(command(client, session, "seek", frame=9), 422)["message"]
    told = get(client, session)
    assert (told["position"], told["computed"], told["state"]) == (5, 5, "ready")

    file.write_text(TEXT + "def broken(:\n")
    wait_for(lambda: problem()["line"] == len(TEXT.splitlines()) + 1)
    command(client, session, "seek", frame=6)
    assert "syntax" in problem()["text"], "the version before it may fail in the frames to come"

    file.write_text(TEXT)
    wait_for(lambda: problem() is None)
    assert steer(client, session, "seek", frame=9)["problem"] is None


def test_code_is_never_taken_over_the_network(client: httpx.Client, server: Server) -> None:
    """A recipe that brings another text is refused, by its text or its hash; so is a saved run.

    A server without the file says why it does not compute the run; nothing of the file is executed there.
    """
    evil = TEXT + "\nimport os; os.system('touch evil')\n"
    body = {"recipe": {"experiment": "ball", "tracker": "theirs", "filters": {"theirs": [evil]}}}
    assert "not here" in error_of(client.post("/api/v1/sessions", json=body), 422)["message"]
    saved = post(client, "runs", session=begin(client, tracker="mine")["id"])
    record = client.get(f"/api/v1/runs/{saved['id']}/download").content
    assert client.post(f"/api/v1/runs/{saved['id']}/open").status_code == 201
    assert bring_in(client, record)["tracker"] == "mine"
    with httpx.Client(base_url=server.url, timeout=60) as elsewhere:
        assert "trust" in import_refusal(elsewhere, record)


def test_a_page_on_this_machine_writes_the_file(client: httpx.Client, file: Path) -> None:
    """With the token, over what it has read; sessions go on with it."""
    (told,) = client.get("/api/v1/filters").json()
    assert (told["name"], told["experiment"], told["text"], told["editable"]) == ("mine", "ball", TEXT, True)
    assert [each["name"] for each in told["components"]] == ["u", "v", "u before", "v before"]
    assert next(each for each in told["hints"] if each["name"] == "resample")["returns"] == "(N,) whole numbers"
    session = begin(client, tracker="mine")["id"]
    steer(client, session, "seek", frame=4)
    changed = TEXT.replace("noise_px: float = 3.0", "noise_px: float = 2.0")
    body = {"text": changed, "before": told["digest"]}
    assert httpx.put(f"{client.base_url}api/v1/filters/mine", json=body).status_code == 401
    assert client.put("/api/v1/filters/mine", json=body).json()["text"] == changed == file.read_text()
    wait_for(lambda: get(client, session)["branch"] == "b1")
    assert "changed meanwhile" in error_of(client.put("/api/v1/filters/mine", json=body), 409)["message"]
    assert client.put("/api/v1/filters/other", json=body).status_code == 404


def test_a_server_that_others_reach_never_takes_code(tmp_path: Path) -> None:
    """It only shows the file; a server that executes files has a token, also on this machine."""
    file = tmp_path / "mine.py"
    file.write_text(TEXT)
    named: dict[str, Any] = {"data_dir": tmp_path / "data", "filters": (file,)}
    assert Settings(**named).token is not None
    assert Settings(**named).edits_filters
    for reachable in ({"host": "0.0.0.0"}, {"allowed_hosts": ("lab.example",)}, {"trusted_proxies": ("127.0.0.1",)}):
        assert not Settings(**named, token=TOKEN, **reachable).edits_filters
    with running(Settings(**named, token=TOKEN, allowed_hosts=("lab.example",))) as server:
        body = {"text": "x = 1", "before": ""}
        answer = httpx.put(f"{server.url}/api/v1/filters/mine", json=body, headers=HEADERS)
        assert "no other machine can reach" in error_of(answer, 409)["message"]
    assert file.read_text() == TEXT


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def steady(place: Path) -> Iterator[httpx.Client]:
    """A client of a server of this module's own."""
    with owned(place) as (_, steady):
        yield steady


def saved(recipe: dict[str, Any]) -> dict[str, Any]:
    """The form in which a saved run with a recipe is sent."""
    said = {"format": "pftrack-run", "version": 2, "recipe": recipe, "computed": 1, "estimates_sha256": ""}
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("run.json", json.dumps(said))
    return {"files": {"file": ("evil.pft", packed.getvalue())}}


def twice(recipe: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"json": {"runs": [{"recipe": recipe}, {"recipe": recipe}], **more}}


WAYS_IN: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    "sessions": lambda recipe: {"json": {"recipe": recipe}},
    "runs/import": saved,
    "comparisons": twice,
    "comparisons/saved": lambda recipe: twice(recipe, title="x"),
    "comparisons/exports/csv": twice,
    "source-code": twice,
    "lectures": lambda recipe: {"json": {"title": "x", "items": [{"session": {"recipe": recipe}}]}},
    "lectures/import": lambda recipe: {
        "content": f"---\n{yaml.safe_dump({'title': 'x', 'items': [{'session': {'recipe': recipe}}]})}---\n"
    },
}


def test_every_way_in_takes_a_known_hash_alone(
    steady: httpx.Client, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A recipe with anything but texts and hexadecimal hashes is refused, and no file elsewhere is run.

    No way in reads a filter's file in the event loop: a slow disk would stop it.
    """
    text = f"{TEXT}\nopen({str(place / 'it-has-run')!r}, 'w').close()\n"
    (place / "Downloads").mkdir()
    (place / "Downloads" / "evil.py").write_text(text)
    filters = {"evil": [text], "b": ["sha256:../../Downloads/evil"]}
    evil = {"experiment": "ball", "tracker": "evil", "frames": 9, "filters": filters}
    known = {"experiment": "ball", "tracker": "mine", "frames": 9, "filters": {"mine": [digest_of(TEXT)]}}
    read: list[bool] = []
    kept_under = DataDirectory._filter

    def watched(files: DataDirectory, digest: str) -> str | None:
        read.append(asyncio._get_running_loop() is None)
        return kept_under(files, digest)

    monkeypatch.setattr(DataDirectory, "_filter", watched)
    for way, body in WAYS_IN.items():
        told = error_of(steady.post(f"/api/v1/{way}", **body(evil)), 422)["message"]
        assert "64 hexadecimal digits in lower case" in told or "recipe.filters.b.0" in told, way
        granted(steady.post(f"/api/v1/{way}", **body(known)))
    assert not (place / "it-has-run").exists()
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
def followed(steady: httpx.Client) -> str:
    """A session by the owner's filter, whose worker has its text."""
    name = begin(steady, tracker="mine", frames=45)["id"]
    command(steady, name, "seek", frame=40)
    return name


@pytest.mark.parametrize("name", REPLACEMENTS)
def test_no_replacement_is_used(steady: httpx.Client, place: Path, followed: str, name: str) -> None:
    """Everything that would execute a replaced file refuses it, and the server continues."""
    kept = place / "data" / "filters" / f"{digest_of(TEXT).removeprefix('sha256:')}.py"
    recipe = steady.get(f"/api/v1/sessions/{followed}").json()["recipe"]
    kept.rename(kept.with_name("aside"))
    try:
        REPLACEMENTS[name](kept)
        refused = error_of(steady.post("/api/v1/sessions", json={"recipe": recipe}), 422)["message"]
        assert "version of the file that is not here" in refused
        if name == "another text":
            of = f"/api/v1/sessions/{followed}"
            for begun in (
                steady.post("/api/v1/runs/import", **saved(recipe)),
                steady.post(f"{of}/fits", json={"numbers": ["gamma_px"]}),
                steady.post(f"{of}/exports/csv"),
                steady.post(f"{of}/explorations", json={"kind": "ensemble", "seconds": 5}),
            ):
                told = ended(steady, begun)
                assert "version of the file that is not here" in told["error"], told["kind"]
            for way in ("comparisons", "comparisons/exports/csv"):
                refused = error_of(steady.post(f"/api/v1/{way}", **twice(recipe)), 422)["message"]
                assert "version of the file that is not here" in refused, way
    finally:
        if kept.is_dir() and not kept.is_symlink():
            kept.rmdir()
        else:
            kept.unlink()
        kept.with_name("aside").rename(kept)
