"""Sweeps of a filter of the server's owner, and sweeps on an upload."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

import pftrack
from pftrack.experiments import find
from pftrack.experiments.own.extension import example_of
from pftrack_server.core.settings import Settings
from tests.server.host import Server, error_of, running, steer
from tests.server.sweeping import allow, rows, show, until_state
from tests.server.uploads.test_uploads import send, video
from tests.waiting import wait_for

TEXT = example_of(find("ball"))
TOKEN = "a token of the owner"
SMALL: dict[str, Any] = {
    "experiment": "ball",
    "axes": [{"name": "occlusion_width_px", "values": [5, 55]}],
    "trackers": ["mine", "condensation"],
    "trials": 2,
    "frames": 12,
    "seed": 3,
    "parameters": {"sample_count": 100},
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.py"
    path.write_text(TEXT)
    return path


@pytest.fixture
def client(file: Path, tmp_path: Path) -> Iterator[httpx.Client]:
    with (
        running(Settings(data_dir=tmp_path / "data", filters=(file,), token=TOKEN)) as server,
        httpx.Client(base_url=server.url, timeout=60, headers={"Authorization": f"Bearer {TOKEN}"}) as connected,
    ):
        yield connected


def test_a_file_is_a_tracker_of_a_sweep(client: httpx.Client, file: Path) -> None:
    """Its runs come to the numbers that Python has, are taken away as files, and open as sessions of that text."""
    size = client.post("/api/v1/sweeps/estimate", json=SMALL).json()
    assert (size["runs"], size["problem"]) == (8, None)
    begun = client.post("/api/v1/sweeps", json=SMALL).json()
    assert [each["title"] for each in begun["trackers"]] == ["mine.py", find("ball").trackers["condensation"].title]
    file.write_text(TEXT.replace("noise_px: float = 3.0", "noise_px: float = 9.0"))
    told = until_state(client, begun["id"], "done", 240)
    assert (told["done"], told["problems"]) == (8, 0)

    row = next(each for each in rows(client, begun["id"], x="occlusion_width_px")["rows"] if each["tracker"] == "mine")
    opened = client.post(f"/api/v1/sweeps/{begun['id']}/rows/{row['run']}/open").json()
    assert (opened["tracker"], opened["parameters"]["noise_px"]) == ("mine", 3.0)
    path = file.with_name("elsewhere") / "mine.py"
    path.parent.mkdir()
    path.write_text(TEXT)
    values = {"occlusion_width_px": 5, "sample_count": 100}
    run = pftrack.run("ball", tracker=str(path), seed=row["seed"], frames=12, **values)
    assert run.summary().verdict.mean_error == pytest.approx(row["mean_error"])

    table = client.get(f"/api/v1/sweeps/{begun['id']}/download", params={"format": "csv"}).text
    assert table.count(',"mine",') == 4
    report = client.get(f"/api/v1/sweeps/{begun['id']}/download", params={"format": "html"})
    assert report.status_code == 200
    assert "mine" in report.text


def test_a_mistake_is_told_with_its_line(client: httpx.Client, file: Path) -> None:
    """One that cannot be read refuses the sweep; one that shows in a step is the problem of its runs alone."""
    file.write_text(TEXT + "def broken(:\n")
    refused = error_of(client.post("/api/v1/sweeps", json=SMALL), 422)
    assert refused["field"] == "trackers"
    assert f"mine.py, line {len(TEXT.splitlines()) + 1}" in refused["message"]

    file.write_text(TEXT + "\nraise RuntimeError('not today')\n")
    begun = client.post("/api/v1/sweeps", json=SMALL).json()
    wait_for(
        lambda: show(client, begun["id"])["state"] not in {"running", "stopped"} or show(client, begun["id"])["message"]
    )
    told = show(client, begun["id"])
    assert told["state"] != "done"
    assert f"mine.py, line {len(TEXT.splitlines()) + 2}" in told["message"]

    file.write_text(TEXT.replace("return np.log(0.02", "return np.log(-0.5"))
    begun = client.post("/api/v1/sweeps", json=SMALL).json()
    assert until_state(client, begun["id"], "done")["problems"] == 4
    line = TEXT[: TEXT.index("def log_likelihood")].count("\n") + 1
    problems = {each["tracker"]: each["problem"] for each in rows(client, begun["id"])["rows"]}
    assert problems["condensation"] is None
    assert f"mine.py, line {line}" in problems["mine"]


def test_text_of_nobody_is_not_executed(client: httpx.Client) -> None:
    """A file that the server was not started with is not a tracker, and a body brings none."""
    refused = error_of(client.post("/api/v1/sweeps", json={**SMALL, "trackers": ["theirs"]}), 422)
    assert refused["field"] == "trackers"
    assert client.post("/api/v1/sweeps", json={**SMALL, "filters": {"theirs": [TEXT]}}).status_code == 422


MARK = {"kind": "box", "x": 10, "y": 20, "width": 10, "height": 10}
PLAN: dict[str, Any] = {
    "experiment": "histogram",
    "axes": [{"name": "sample_count", "values": [30, 60]}],
    "trackers": ["condensation", "apf"],
    "trials": 2,
    "frames": 8,
    "footage": {"mark": MARK, "start": 1},
}


@pytest.fixture
def upload(client: httpx.Client) -> dict[str, Any]:
    return send(client, ("ball.mp4", video(12))).json()


def begun(client: httpx.Client, upload: dict[str, Any], **changes: Any) -> dict[str, Any]:
    answer = client.post("/api/v1/sweeps", json={**PLAN, "upload": upload["id"], **changes})
    assert answer.status_code == 201, answer.text
    return answer.json()


def allow_all(server: Server) -> None:
    allow(server.app.state.services.store.files.sweep("0" * 16).parent)


def test_it_is_computed_and_opened(server: Server, client: httpx.Client, upload: dict[str, Any]) -> None:
    """Its runs are measured by the trackers' own account, and each opens as a session on the upload."""
    allow_all(server)
    sweep = begun(client, upload)
    assert (sweep["recording"], sweep["judged"], sweep["frames"]) == ("ball.mp4", False, 8)
    assert sweep["title"].startswith("Colours of a window · ball.mp4 · ")
    assert {"following_share", "mean_deviation"} <= {measure["name"] for measure in sweep["measures"]}
    assert until_state(client, sweep["id"], "done")["problems"] == 0
    asked = {"x": "sample_count", "first": "condensation", "second": "apf", "measure": "mean_deviation"}
    compared = client.get(f"/api/v1/sweeps/{sweep['id']}/cells", params=asked).json()
    assert compared["comparison"]["pairs"] == [2, 2]
    row = rows(client, sweep["id"], x="sample_count")["rows"][0]
    session = client.post(f"/api/v1/sweeps/{sweep['id']}/rows/{row['run']}/open").json()
    steer(client, session["id"], "seek", frame=7)
    columns = client.get(f"/api/v1/sessions/{session['id']}/diagnostics").json()["columns"]
    assert len(columns["estimate"]) == 8
    saved = client.post("/api/v1/runs", json={"session": session["id"]}).json()
    assert saved["summary"]["mean_deviation"] == row["measures"]["mean_deviation"]
    client.delete(f"/api/v1/sessions/{session['id']}")
    assert client.delete(f"/api/v1/uploads/{upload['id']}").status_code == 204
    gone = client.post(f"/api/v1/sweeps/{sweep['id']}/rows/{row['run']}/open")
    assert "This sweep needs the clip " in error_of(gone, 409)["message"]


def test_other_seeds_alone(server: Server, client: httpx.Client, upload: dict[str, Any]) -> None:
    """Without an axis the trials are other seeds of one setting; the size and the time are told before."""
    allow_all(server)
    body = {**PLAN, "axes": [], "upload": upload["id"], "parameters": {"sample_count": 30}}
    size = client.post("/api/v1/sweeps/estimate", json=body).json()
    assert (size["runs"], size["frames"], size["problem"]) == (4, 8, None)
    assert size["seconds"] > 0
    sweep = until_state(client, begun(client, upload, axes=[], parameters={"sample_count": 30})["id"], "done")
    assert sweep["done"] == 4
    found = client.get(f"/api/v1/sweeps/{sweep['id']}/cells").json()
    assert [one["runs"] for one in found["maps"]] == [[2], [2]]


def test_it_needs_its_upload(start_server: Any) -> None:
    """While it is computed, its upload stays; without it, it does not go on, and with its content it does."""
    clip = video(12)
    with start_server() as (_, client):
        upload = send(client, ("ball.mp4", clip)).json()
        sweep = begun(client, upload, trials=200)
        assert "cancel it first" in error_of(client.delete(f"/api/v1/uploads/{upload['id']}"), 409)["message"]
        client.post(f"/api/v1/sweeps/{sweep['id']}/cancel")
        until_state(client, sweep["id"], "stopped")
        assert client.delete(f"/api/v1/uploads/{upload['id']}").status_code == 204
        refused = client.post(f"/api/v1/sweeps/{sweep['id']}/resume")
        assert "is not on this server. Upload it first." in error_of(refused, 409)["message"]
        send(client, ("again.mp4", clip))
        assert client.post(f"/api/v1/sweeps/{sweep['id']}/resume").status_code == 200
        wait_for(lambda: client.get(f"/api/v1/sweeps/{sweep['id']}").json()["done"] > 0, 60)
        client.post(f"/api/v1/sweeps/{sweep['id']}/cancel")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"axes": [{"name": "sway_px", "values": [1]}]}, "no parameter 'sway_px' on a recording"),
        ({"footage": {"start": 1}}, "mark must be given"),
        ({"footage": {"mark": MARK, "start": 12}}, "a frame of the upload, 0 to 11"),
        ({"upload": "0123456789abcdef"}, "upload is not here"),
        ({"experiment": "sine"}, "takes no recording"),
    ],
)
def test_what_is_wrong_is_told(
    client: httpx.Client, upload: dict[str, Any], changes: dict[str, Any], words: str
) -> None:
    """A parameter of the simulated scene, a target that is not marked, a start beyond the end, another upload."""
    answer = client.post("/api/v1/sweeps", json={**PLAN, "upload": upload["id"], **changes})
    assert words in error_of(answer, 422)["message"]
