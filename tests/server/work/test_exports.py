"""Files of sessions and saved runs: the declared ones are listed and can be downloaded, and no others."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import httpx
import numpy as np
import pandas as pd

from pftrack.experiments import find
from pftrack.output.exports.formats import FORMATS, exports_of
from tests.server.asking import columns
from tests.server.follow_jobs import asked, ended, taken, written
from tests.server.host import begin, error_of, steer


def file_of(client: httpx.Client, begun: httpx.Response) -> tuple[httpx.Response, dict[str, Any]]:
    """Wait for an export, and return its file and its job."""
    return written(client, begun), asked(client, begun.json())


def test_a_session_exports_what_its_experiment_offers(client: httpx.Client, tmp_path: Path) -> None:
    """The session lists its files; the table has its numbers, and a file that needs more frames says so.

    The film has a picture for each computed frame; the page is downloaded with as many frames.
    """
    session = begin(client)
    offered = {one["name"]: one for one in session["exports"]}
    assert set(offered) == {one.name for one in exports_of(find("ball"))} > {one.name for one in FORMATS}
    steer(client, session["id"], "seek", frame=9)
    address = f"/api/v1/sessions/{session['id']}/exports"
    assert "frames with two frames known before them" in ended(client, client.post(f"{address}/learned"))["error"]
    table = taken(client, session["id"], "csv")
    assert table.headers["content-type"].split(";")[0] == offered["csv"]["media_type"]
    read = pd.read_csv(io.StringIO(table.text))
    np.testing.assert_allclose(read["error"], columns(client, session["id"])["error"], atol=1e-6)

    film, told = file_of(client, client.post(f"{address}/mp4"))
    assert (told["name"], told["done"]) == ("ball-9.mp4", told["total"])
    assert film.headers["content-type"] == "video/mp4"
    (tmp_path / "film.mp4").write_bytes(film.content)
    reader = cv2.VideoCapture(str(tmp_path / "film.mp4"))
    assert [reader.read()[0] for _ in range(11)] == [True] * 10 + [False]
    assert client.delete(f"/api/v1/jobs/{told['id']}").status_code == 204
    assert "job does not exist" in error_of(client.get(told["result"]["address"]), 404)["message"]

    # The confined child loads viser itself for a page, which a browser saves and does not open.
    page, told = file_of(client, client.post(f"{address}/html"))
    assert told["name"] == "ball-9.html"
    assert page.headers["content-disposition"].startswith("attachment")
    assert '"frames":10' in page.text


def test_a_saved_run_is_exported_from_its_file(client: httpx.Client, tmp_path: Path) -> None:
    """A saved run lists its exports; a table has the saved frames, and an unknown plot is refused."""
    session = begin(client, experiment="sine", seed=5)
    steer(client, session["id"], "seek", frame=7)
    run = client.post("/api/v1/runs", json={"session": session["id"]}).json()
    steer(client, session["id"], "seek", frame=9)
    address = f"/api/v1/runs/{run['id']}/exports"
    offered = client.get(address).json()
    assert [one["name"] for one in offered["exports"]] == [one.name for one in FORMATS]
    assert [plot["id"] for plot in offered["plots"]] == [plot.id for plot in find("sine").display.plots]
    table, told = file_of(client, client.post(f"{address}/csv"))
    place = tmp_path / told["name"]
    place.write_bytes(table.content)
    assert (place.name, pd.read_csv(place)["frame"].tolist()) == ("sine-condensation-7.csv", list(range(8)))
    said = error_of(client.post(f"{address}/png", params={"plot": "gain"}), 409)["message"]
    assert "ine has no plot 'gain', only error, sigma" in said
    assert "xport must be one of csv" in error_of(client.post(f"{address}/docx"), 404)["message"]


def test_a_file_that_is_too_large_or_stopped_leaves_nothing(start_server: Callable[..., Any]) -> None:
    """A file beyond the limit is refused; after a failure or a stop its folder is deleted."""
    with start_server(max_export_bytes=2_000) as (served, client):
        outgoing = served.app.state.services.store.files.outgoing
        session = begin(client, experiment="sine", frames=4_000)
        address = f"/api/v1/sessions/{session['id']}/exports"
        small, _ = file_of(client, client.post(f"{address}/recipe"))
        assert small.json()["experiment"] == "sine"
        steer(client, session["id"], "seek", frame=400)
        failed = ended(client, client.post(f"{address}/csv"))
        assert (failed["state"], "File too large; make room" in failed["error"]) == ("failed", True)
        assert error_of(client.get(f"/api/v1/jobs/{failed['id']}/file"), 409)["message"] == failed["error"]
        begun = client.post(f"{address}/mp4").json()
        assert "still being written" in error_of(client.get(f"/api/v1/jobs/{begun['id']}/file"), 409)["message"]
        assert client.delete(f"/api/v1/jobs/{begun['id']}").status_code == 204
        assert len(list(outgoing.iterdir())) == 1
