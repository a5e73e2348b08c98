"""Sweeps on an upload: planned by its parameters, computed on its content, and opened as sessions on it."""

from typing import Any

import httpx
import pytest

from tests.server.host import Server, error_of, post
from tests.server.sweeping import allow, rows, until_state
from tests.server.uploads.test_uploads import columns_of, send, video
from tests.waiting import wait_for

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
    return dict(post(client, "sweeps", **{**PLAN, "upload": upload["id"], **changes}))


def allow_all(server: Server) -> None:
    allow(server.app.state.services.store.files.sweep("0" * 16).parent)


def test_it_is_computed_and_opened(server: Server, client: httpx.Client, upload: dict[str, Any]) -> None:
    """Its runs are measured without truth, and each opens as a session on the upload."""
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
    assert len(columns_of(client, session, 7)["estimate"]) == 8
    saved = client.post("/api/v1/runs", json={"session": session["id"]}).json()
    assert saved["summary"]["mean_deviation"] == row["measures"]["mean_deviation"]
    client.delete(f"/api/v1/sessions/{session['id']}")
    assert client.delete(f"/api/v1/uploads/{upload['id']}").status_code == 204
    gone = client.post(f"/api/v1/sweeps/{sweep['id']}/rows/{row['run']}/open")
    assert "This sweep needs the clip " in error_of(gone, 409)["message"]


def test_other_seeds_alone(server: Server, client: httpx.Client, upload: dict[str, Any]) -> None:
    """Without an axis the trials are other seeds of one setting, whose size and time are known before.

    A parameter of the simulated scene, an unmarked target, a start beyond the end and another upload are refused.
    """
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"axes": [{"name": "sway_px", "values": [1]}]}, "no parameter 'sway_px' on a recording"),
        ({"footage": {"start": 1}}, "mark is missing"),
        ({"footage": {"mark": MARK, "start": 12}}, "a frame of the upload, 0 to 11"),
        ({"upload": "0123456789abcdef"}, "upload is missing"),
        ({"experiment": "sine"}, "takes no recording"),
    ]
    for changes, words in wrong:
        answer = client.post("/api/v1/sweeps", json={**PLAN, "upload": upload["id"], **changes})
        assert words in error_of(answer, 422)["message"]
    allow_all(server)
    body = {**PLAN, "axes": [], "upload": upload["id"], "parameters": {"sample_count": 30}}
    size = client.post("/api/v1/sweeps/estimate", json=body).json()
    assert (size["runs"], size["frames"], size["problem"], size["seconds"] > 0) == (4, 8, None, True)
    sweep = until_state(client, begun(client, upload, axes=[], parameters={"sample_count": 30})["id"], "done")
    assert sweep["done"] == 4
    found = client.get(f"/api/v1/sweeps/{sweep['id']}/cells").json()
    assert [one["runs"] for one in found["maps"]] == [[2], [2]]


def test_it_needs_its_upload(start_server: Any) -> None:
    """An upload cannot be deleted under a running sweep, which resumes only with the upload's content."""
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
