"""Runs: saved, downloaded, imported elsewhere and opened again, with the same numbers."""

import json
import zipfile
from io import BytesIO
from pathlib import Path
from typing import Any

import httpx
import pytest

from pftrack.experiments import find
from pftrack.runs.reproduction import load
from pftrack_server.work.runs import outcome
from tests.server.follow_jobs import bring_in, import_refusal
from tests.server.host import Server, begin, change_values, error_of, post, steer
from tests.server.uploads.test_uploads import columns_of, send, video


def save(client: httpx.Client, session: str, **more: Any) -> dict[str, Any]:
    return dict(post(client, "runs", session=session, **more))


def opened(client: httpx.Client, run: str) -> dict[str, Any]:
    return dict(post(client, f"runs/{run}/open"))


def made(client: httpx.Client) -> dict[str, Any]:
    """A run with a change of tracker and a bookmark, 40 frames long."""
    session = begin(client, parameters={"sample_count": 150})
    steer(client, session["id"], "seek", frame=20)
    change_values(client, session["id"], {"tracker": "apf"})
    client.post(f"/api/v1/sessions/{session['id']}/bookmarks", json={"note": "here"})
    steer(client, session["id"], "seek", frame=39)
    steer(client, session["id"], "seek", frame=30)
    return save(client, session["id"], title="My run")


def test_the_outcome_of_a_run_that_is_judged_by_its_end() -> None:
    """The share is over the frames that the measure uses, not over all."""
    for experiment, last in (("linkage", 6), ("histogram", 10)):
        name = find(experiment).simulate().success
        row = {"experiment": experiment, "frames": 120, "labelled_frames": 120, "success": True}
        said = outcome({**row, "success_measure": name, name: 1.0})
        assert said == f"100 % held in the last {last} frames, 120 frames in all"


def test_saved_listed_and_opened(client: httpx.Client, tmp_path: Path) -> None:
    """A saved run is listed with its outcome, a picture and its date, and opens with its bookmarks.

    Downloaded it replays in the library. Imported elsewhere it is computed once in a confined process, and opens.
    """
    run = made(client)
    assert (run["title"], run["frames"], run["tracker"], run["seed"]) == ("My run", 40, "apf", 7)
    assert "40 frames" in run["outcome"]
    assert run in client.get("/api/v1/runs").json()
    assert client.get(f"/api/v1/runs/{run['id']}").json() == run
    picture = client.get(run["thumbnail"])
    assert picture.content.startswith(b"\x89PNG")
    assert picture.headers["cache-control"] == "private, max-age=86400"
    assert client.get(f"/api/v1/runs/{run['id']}").headers["cache-control"] == "private, no-cache"
    download = client.get(f"/api/v1/runs/{run['id']}/download")
    assert download.headers["content-disposition"].endswith('.pft"')
    for whole in (picture, download):
        head = client.head(whole.url)
        assert (head.status_code, head.content) == (200, b"")
        assert head.headers["content-length"] == str(len(whole.content))

    expected = run["summary"]["estimates_sha256"]
    session = opened(client, run["id"])
    assert (session["position"], session["computed"], session["tracker"]) == (30, 39, "apf")
    assert session["bookmarks"][0]["note"] == "here"
    assert save(client, session["id"])["summary"]["estimates_sha256"] == expected
    (tmp_path / "run.pft").write_bytes(download.content)
    replayed = load(tmp_path / "run.pft")
    replayed.seek(39)
    assert replayed.estimates_sha256 == expected
    brought = bring_in(client, download.content, "from a friend.pft")
    assert (brought["title"], brought["summary"]["reproduced"]) == ("from a friend", True)
    assert brought["summary"]["estimates_sha256"] == expected
    opened(client, brought["id"])
    assert client.delete(f"/api/v1/runs/{run['id']}").status_code == 204
    for end in ("", "/download", "/thumbnail.png"):
        error_of(client.get(f"/api/v1/runs/{run['id']}{end}"), 404)


def a_run(**recipe: Any) -> bytes:
    """Return a file that says that it is a run of the ball."""
    raw = {"format": "pftrack-run", "version": 2, "recipe": {"experiment": "ball", "frames": 20, **recipe}}
    file = BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("run.json", json.dumps(raw | {"computed": 1, "estimates_sha256": "0" * 64}))
    return file.getvalue()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        *((content, "not a saved run") for content in (b"", b"hello", b"PK\x03\x04" + b"\0" * 100)),
        (b"PK\x05\x06" + b"\0" * 18, "not a saved run"),
        (a_run(seed=2**53), "between 0 and 9007199254740991"),
        (a_run(seed=7, timeline=[{"frame": 20, "values": {"sample_count": 90}}]), "frames 0 to 19"),
        (a_run(footage={"mark": {"base64": "eHg="}}), "not on this server; upload it first"),
        (a_run(timeline=[{"frame": 0, "values": {"base64": "eHg="}}]), "base64"),
    ],
)
def test_other_files_are_refused(server: Server, client: httpx.Client, content: bytes, words: str) -> None:
    """A file that is not a run, or has a value that no page can show, is refused, and nothing is stored.

    Browsers would round the seed; no value of a record is taken for the bytes of an answer.
    """
    files = server.app.state.services.store.files
    before = set(files.runs.iterdir())
    assert words in import_refusal(client, content)
    assert (set(files.runs.iterdir()), list(files.incoming.iterdir())) == (before, [])


def test_a_run_on_a_video(client: httpx.Client) -> None:
    """A run on a video opens on the upload with the same content, and is refused if that is missing."""
    clip = video(20)
    upload = send(client, ("ball.mp4", clip)).json()
    session = begin(client, upload=upload["id"], box=[10, 20, 10, 10], start=1)
    numbers = columns_of(client, session, 12)["estimate"]
    run = save(client, session["id"])
    client.delete(f"/api/v1/sessions/{session['id']}")
    content = client.get(f"/api/v1/runs/{run['id']}/download").content
    again = opened(client, run["id"])
    assert (again["upload"], again["recipe"]["footage"]["start"]) == (upload["id"], 1)
    assert again["recipe"]["footage"]["mark"] == {"kind": "box", "x": 10, "y": 20, "width": 10, "height": 10}
    assert columns_of(client, again)["estimate"] == numbers
    client.delete(f"/api/v1/sessions/{again['id']}")
    client.delete(f"/api/v1/uploads/{upload['id']}")
    message = error_of(client.post(f"/api/v1/runs/{run['id']}/open"), 409)["message"]
    assert message.startswith(f"This run needs the clip {upload['name']}, which is not on this server.")
    assert "upload it first" in import_refusal(client, content)
    other = send(client, ("other name.mp4", clip)).json()
    assert opened(client, run["id"])["upload"] == other["id"]
