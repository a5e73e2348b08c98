"""Filters of the server's owner: files named on its command line, which sessions follow as they are saved."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from pftrack.experiments import find
from pftrack.experiments.own.extension import example_of
from pftrack_server.core.settings import Settings
from tests.server.asking import get
from tests.server.follow_jobs import bring_in, import_refusal
from tests.server.host import Server, begin, change_values, command, error_of, running, steer
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
    """From the frame where it stands, as a branch; new parameters are there, and new defaults in force."""
    listed = next(each for each in client.get("/api/v1/experiments").json() if each["id"] == "ball")
    assert "mine" in [each["id"] for each in listed["trackers"]]
    session = begin(client, tracker="mine")
    assert "noise_px" in [each["name"] for each in session["declarations"]]
    assert TEXT[:40] not in json.dumps(session), "pages are told the file's hash"
    steer(client, session["id"], "seek", frame=20)

    file.write_text(TEXT.replace("noise_px: float = 3.0", "extra: int = 7  # of no use\n    noise_px: float = 4.5"))
    wait_for(lambda: len(get(client, session["id"])["branches"]) == 2)
    told = get(client, session["id"])
    assert (told["position"], told["parameters"]["mine_version"]) == (20, 2)
    assert (told["parameters"]["noise_px"], told["parameters"]["extra"]) == (4.5, 7)
    declared = lambda: {each["name"]: each for each in get(client, session["id"])["declarations"]}  # noqa: E731
    extra = wait_for(lambda: declared().get("extra"))
    assert (extra["description"], extra["maximum"]) == ("Of no use.", 70)
    steer(client, session["id"], "seek", frame=30)
    old = command(client, session["id"], "activate", branch="b0").json()
    assert (old["branch"], old["parameters"]["mine_version"], old["parameters"]["noise_px"]) == ("b0", 1, 3.0)
    assert "extra" in old["parameters"]


@pytest.mark.parametrize("frame", [20, 39])
def test_saving_leaves_what_was_chosen(client: httpx.Client, file: Path, frame: int) -> None:
    """Tracker and parameters stay as they were chosen a moment ago, in the middle of a run and at its end."""
    session = begin(client, tracker="mine", frames=40)["id"]
    steer(client, session, "seek", frame=10)
    change_values(client, session, {"sample_count": 350})
    steer(client, session, "seek", frame=frame)
    change_values(client, session, {"tracker": "condensation", "sample_count": 444})
    chosen = get(client, session)

    file.write_text(TEXT.replace("noise_px: float = 3.0", "noise_px: float = 4.5"))
    told = wait_for(lambda: len(get(client, session)["branches"]) > len(chosen["branches"]) and get(client, session))
    assert told["tracker"] == "condensation"
    assert told["parameters"] == chosen["parameters"] | {"mine_version": 2, "noise_px": 4.5}


def test_a_mistake_is_told_with_its_line_and_the_run_stands(client: httpx.Client, file: Path) -> None:
    """In a file that is saved, and in a step; what was computed stays, and a mended file goes on."""
    session = begin(client, tracker="mine")["id"]
    steer(client, session, "seek", frame=5)
    file.write_text(TEXT + "def broken(:\n")
    told = wait_for(lambda: get(client, session)["problem"])
    assert (told["file"], told["line"]) == ("mine.py", len(TEXT.splitlines()) + 1)
    assert get(client, session)["branch"] == "b0"
    onward = steer(client, session, "seek", frame=6)
    assert onward["problem"] == told, "it is told as long as the file is as it is"
    steer(client, session, "seek", frame=5)

    file.write_text(FAILING)
    wait_for(lambda: get(client, session)["branch"] == "b1")
    refused = error_of(command(client, session, "seek", frame=9), 422)
    assert "log_likelihood returned NaN" in refused["message"]
    told = get(client, session)
    assert (told["position"], told["computed"], told["state"]) == (5, 5, "ready")
    assert told["problem"]["line"] == FAILING_LINE

    file.write_text(TEXT)
    wait_for(lambda: get(client, session)["branch"] == "b2")
    assert steer(client, session, "seek", frame=9)["problem"] is None


@pytest.mark.parametrize("tracker", ["mine", "condensation"])
def test_a_saved_file_is_tried_at_once(client: httpx.Client, file: Path, tracker: str) -> None:
    """While the run is paused, also under another tracker; no frame is computed, and the newest mistake stands."""
    session = begin(client, tracker=tracker)["id"]
    steer(client, session, "seek", frame=5)
    problem = lambda: get(client, session)["problem"]  # noqa: E731 - one line of reading
    file.write_text(FAILING)
    told = wait_for(problem)
    assert (told["file"], told["line"]) == ("mine.py", FAILING_LINE)
    assert "log_likelihood returned NaN" in told["text"]
    assert (get(client, session)["position"], get(client, session)["computed"]) == (5, 5)

    file.write_text(TEXT + "def broken(:\n")
    wait_for(lambda: problem()["line"] == len(TEXT.splitlines()) + 1)
    command(client, session, "seek", frame=6)
    assert "syntax" in problem()["text"], "the version before it fails, or not, in the frames to come"

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
    session = begin(client, tracker="mine")["id"]
    saved = client.post("/api/v1/runs", json={"session": session}).json()
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
    """It serves the file to look at; and one that executes files has a token, also on this machine."""
    file = tmp_path / "mine.py"
    file.write_text(TEXT)
    assert Settings(data_dir=tmp_path, filters=(file,)).token is not None
    assert Settings(data_dir=tmp_path, filters=(file,)).edits_filters
    for reachable in ({"host": "0.0.0.0"}, {"allowed_hosts": ("lab.example",)}, {"trusted_proxies": ("127.0.0.1",)}):
        assert not Settings(data_dir=tmp_path, filters=(file,), token=TOKEN, **reachable).edits_filters
    open_settings = Settings(data_dir=tmp_path / "data", filters=(file,), token=TOKEN, allowed_hosts=("lab.example",))
    with running(open_settings) as server:
        body = {"text": "x = 1", "before": ""}
        answer = httpx.put(f"{server.url}/api/v1/filters/mine", json=body, headers=HEADERS)
        assert "no other machine can reach" in error_of(answer, 409)["message"]
    assert file.read_text() == TEXT
