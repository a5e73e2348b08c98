"""Sweeps through the REST interface: plan, compute, look at cells, list rows, open a run, take the result away."""

import gc
import io
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import AsyncMock

import httpx
import numpy as np
import psutil
import pytest
from websockets.sync.client import connect

from pftrack.experiments import EXPERIMENTS
from pftrack.sweep import compare, read_result
from pftrack.sweep.cells import cells, quantity_named, samples
from pftrack_server.jobs.child_tasks import ChildTasks
from tests.server.host import Server, error_of, own_server, steer
from tests.server.sessions.test_duplex import hear
from tests.server.sweeping import RUNS, SMALL, begin_sweep, rows, until_state
from tests.server.teaching.class_room import farewell
from tests.waiting import wait_for

served = own_server(sweep_jobs=1, max_sweep_runs=5000, max_particles=4000)


@pytest.fixture
def client(served: Server) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=served.url, timeout=60) as http:
        yield http


@pytest.fixture(scope="module")
def sweep(served: Server) -> dict[str, Any]:
    """A sweep that is complete."""
    with httpx.Client(base_url=served.url, timeout=60) as http:
        return until_state(http, begin_sweep(http)["id"], "done")


@pytest.fixture
def url(sweep: dict[str, Any]) -> str:
    return f"/api/v1/sweeps/{sweep['id']}"


@pytest.fixture
def result(client: httpx.Client, url: str, tmp_path: Path) -> Any:
    """The sweep's result, read from its download."""
    path = tmp_path / "sweep.parquet"
    path.write_bytes(client.get(f"{url}/download").content)
    return read_result(path)


def test_the_loss_probability_is_measured_on_request(client: httpx.Client) -> None:
    """Its maps have the loss probability; the experiment lists the methods that know it, and others are refused."""
    begun = until_state(client, begin_sweep(client, loss_probability=True, trials=1)["id"], "done")
    assert begun["loss_probability"]
    assert begun["measures"][-1]["name"] == "mean_loss_probability"
    (cells,) = (one["measures"] for one in client.get(f"/api/v1/sweeps/{begun['id']}/cells").json()["maps"][:1])
    assert all(0.0 <= value <= 1.0 for value in cells["mean_loss_probability"])
    able = EXPERIMENTS["ball"].quality.loss_probability.models
    for query, trackers in (({}, list(able)), ({"recording": "video"}, [])):
        assert client.get("/api/v1/experiments/ball", params=query).json()["loss_trackers"] == trackers
    axes = [{"name": "sample_count", "values": [10, 20]}]
    wish = {"experiment": "sine", "axes": axes, "trackers": ["kalman"], "loss_probability": True}
    assert error_of(client.post("/api/v1/sweeps", json=wish), 422)["field"] == "loss_probability"


# Planning.


def test_examples(server: Server) -> None:
    """An experiment's example can be started unchanged under the usual limits."""
    with httpx.Client(base_url=server.url, timeout=60) as client:
        for name in ("ball", "prism"):
            wish = client.get(f"/api/v1/experiments/{name}/sweep").json()
            size = client.post("/api/v1/sweeps/estimate", json={**wish, "measure": False}).json()
            assert wish["experiment"] == name
            assert size["runs"] == size["conditions"] * len(wish["trackers"]) * wish["trials"], name
            assert size["problem"] is None, name


def test_size_and_time(client: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    """The size of a sweep is known at once, its time after some runs were measured, once for each plan."""
    before = len(client.get("/api/v1/sweeps").json())
    size = client.post("/api/v1/sweeps/estimate", json={**SMALL, "measure": False}).json()
    assert (size["runs"], size["conditions"], size["cells"], size["seconds"]) == (RUNS, 6, 6, None)
    assert size["axes"][0] == {"name": "occlusion_width_px", "count": 3, "first": [5.0, 55.0, 105.0]}
    assert client.post("/api/v1/sweeps/estimate", json=SMALL).json()["seconds"] > 0
    measure = AsyncMock(return_value=2.5)
    monkeypatch.setattr(ChildTasks, "run_beside", measure)
    seconds = [client.post("/api/v1/sweeps/estimate", json={**SMALL, "seed": 77}).json()["seconds"] for _ in range(2)]
    assert (seconds, measure.call_count) == ([2.5, 2.5], 1)
    assert len(client.get("/api/v1/sweeps").json()) == before


def test_what_cannot_be_planned(client: httpx.Client) -> None:
    """An impossible plan is refused with a sentence and the field that is wrong."""
    width = {"name": "occlusion_width_px"}
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"experiment": "juggling"}, "experiment"),
        ({"axes": []}, "axes"),
        ({"axes": [{"name": "colour_of_the_sky", "values": [1]}]}, "axes.0.name"),
        ({"axes": [{"name": "sample_count", "values": [10, "many"]}]}, "axes.0.values"),
        ({"axes": [{"name": "sample_count", "start": 1, "stop": 5, "step": 0}]}, "axes.0.step"),
        ({"axes": [{**width, "start": 0, "stop": 100, "step": 1e-6}]}, "axes.0.stop"),
        ({"axes": [{**width, "start": 0, "stop": 500, "step": 0.01}], "trials": 1}, "axes"),
        ({"trackers": ["hope"]}, "trackers"),
        ({"trials": 100_000}, "trials"),
        ({"frames": 30_000}, "frames"),
        ({"parameters": {"sample_count": -1}}, "parameters.sample_count"),
        ({"parameters": {"sample_count": 5000}}, "sample_count"),
        ({"axes": [{"name": "sample_count", "values": [10, 4001]}], "parameters": {}}, "sample_count"),
        ({"parameters": {"occlusion_width_px": 1}}, "parameters.occlusion_width_px"),
    ]
    before = len(client.get("/api/v1/sweeps").json())
    for changes, field in wrong:
        assert error_of(client.post("/api/v1/sweeps", json={**SMALL, **changes}), 422)["field"] == field
    impossible = {**SMALL, "parameters": {"gamma_min_px": 30, "gamma_max_px": 3}}
    assert "impossible" in error_of(client.post("/api/v1/sweeps", json=impossible), 422)["message"]
    assert len(client.get("/api/v1/sweeps").json()) == before


# Looking.


def test_a_complete_sweep(client: httpx.Client, sweep: dict[str, Any]) -> None:
    """A complete sweep has its plan, its size and its outcome."""
    assert (sweep["runs"], sweep["done"], sweep["conditions"], sweep["message"]) == (RUNS, RUNS, 6, None)
    assert [axis["unit"] for axis in sweep["axes"]] == ["px", "px"]
    assert sweep["page"] == f"sweep/{sweep['id']}"
    assert f"{RUNS} runs" in sweep["outcome"]
    assert sweep in client.get("/api/v1/sweeps").json()
    assert 'pftrack_sweeps{state="done"}' in client.get("/metrics").text


def test_cells(client: httpx.Client, url: str, result: Any) -> None:
    """The cells are those that the library counts in the downloaded result, over any two axes."""
    for x, y in [("occlusion_width_px", "distracter_radius_px"), ("distracter_radius_px", "none")]:
        shown = client.get(f"{url}/cells", params={"x": x, "y": y}).json()
        known = cells(result, x, None if y == "none" else y)
        assert shown["done"] == RUNS
        for one in shown["maps"]:
            other = known[one["tracker"]]
            assert one["runs"] == other.runs.ravel().tolist()
            assert one["runs"] == [shown["planned"]] * len(one["runs"])
            assert one["successes"] == other.successes.ravel().tolist()
            assert one["low"] == pytest.approx(other.low.ravel().tolist(), abs=1e-5)
            errors = [np.nan if value is None else value for value in one["error"]]
            assert errors == pytest.approx(other.mean_error.ravel().tolist(), rel=1e-5, nan_ok=True)
            assert one["measures"].keys() == other.measures.keys()
            inside = other.measures["inside_share"].ravel().tolist()
            assert one["measures"]["inside_share"] == pytest.approx(inside, rel=1e-5)


@pytest.mark.parametrize(
    ("name", "tests", "level", "correction"),
    [
        ("success", ("mcnemar", "chi-square"), 0.05, "holm"),
        ("median_error_px", ("signed-rank", "rank-sum"), 0.2, "none"),
    ],
)
def test_comparison(
    client: httpx.Client, url: str, result: Any, name: str, tests: tuple[str, str], level: float, correction: Any
) -> None:
    """Methods are compared by a measure as the library compares them, by the published test on request."""
    query = {"first": "h-spf", "second": "pc-pf", "level": level, "correction": correction, "measure": name}
    shown = client.get(f"{url}/cells", params=query).json()["comparison"]
    axes = "occlusion_width_px", "distracter_radius_px"
    quantity = quantity_named(result.plan, name)
    compared = compare(quantity, cells(result, *axes), samples(result, quantity, *axes), "h-spf", "pc-pf")
    assert (shown["measure"], shown["test"]) == (name, tests[0])
    codes = compared.significance(level, correction).codes.ravel()
    assert shown["verdict"] == [["untested", "none", "first", "second"][code] for code in codes]
    paired = compared.paired
    known = {"difference": compared.difference, "paired": paired.mean, "pairs": paired.pairs, "paired_low": paired.low}
    for column, numbers in known.items():
        values = [np.nan if value is None else value for value in shown[column]]
        assert values == pytest.approx(numbers.ravel().tolist(), rel=1e-5, abs=1e-5, nan_ok=True), column
    assert client.get(f"{url}/cells", params={**query, "test": "chi-square"}).json()["comparison"]["test"] == tests[1]


def test_refused(client: httpx.Client, url: str) -> None:
    """Impossible questions are refused with the field, unknown sweeps and runs are not found.

    A complete sweep can neither be cancelled nor resumed.
    """
    both = {"first": "h-spf", "second": "pc-pf"}
    wrong: list[tuple[str, dict[str, Any], str]] = [
        ("cells", {"x": "seed"}, "x"),
        ("cells", {"x": "occlusion_width_px", "y": "occlusion_width_px"}, "y"),
        ("cells", {**both, "second": "apf"}, "second"),
        ("cells", {**both, "measure": "beauty"}, "measure"),
        ("rows", {"i": 3}, "i"),
        ("rows", {"tracker": "apf"}, "tracker"),
    ]
    for path, query, field in wrong:
        assert error_of(client.get(f"{url}/{path}", params=query), 422)["field"] == field, query
    for path in ("", "/cells", "/rows", "/download"):
        error_of(client.get(f"/api/v1/sweeps/0123456789abcdef{path}"), 404)
    for action in ("cancel", "resume"):
        error_of(client.post(f"/api/v1/sweeps/nonsense/{action}"), 404)
        error_of(client.post(f"{url}/{action}"), 409)
    error_of(client.post(f"{url}/rows/{RUNS}/open"), 404)


def test_rows(client: httpx.Client, sweep: dict[str, Any]) -> None:
    """The runs of a cell come failures first, in pages, with the same seeds for every method."""
    found = rows(client, sweep["id"], i=1, j=1)
    assert (found["total"], len(found["rows"])) == (12, 12)
    successes = [row["success"] for row in found["rows"]]
    assert successes == sorted(successes)
    assert found["failures"] == successes.count(False) > 0
    assert all(row["conditions"] == {"occlusion_width_px": 55, "distracter_radius_px": 20} for row in found["rows"])
    pages = [rows(client, sweep["id"], i=1, j=1, limit=5, offset=offset)["rows"] for offset in (0, 5, 10)]
    assert [row for page in pages for row in page] == found["rows"]
    by_method = [rows(client, sweep["id"], i=1, j=1, tracker=name)["rows"] for name in ("h-spf", "pc-pf")]
    assert {row["seed"] for row in by_method[0]} == {row["seed"] for row in by_method[1]}


# Opening.


def test_fails_in_the_frame_of_the_row(client: httpx.Client, sweep: dict[str, Any], result: Any) -> None:
    """A failed run opens paused ten frames before its loss, fails in that frame, and has the row's estimates.

    It has been computed to ten frames after, so that it can be asked at once why it was lost.
    """
    failed = next(row for row in rows(client, sweep["id"], i=1, j=1)["rows"] if row["first_lost_frame"] > 10)
    session = client.post(f"/api/v1/sweeps/{sweep['id']}/rows/{failed['run']}/open").json()
    assert session["sweep"] == sweep["id"]
    loss = failed["first_lost_frame"]
    assert (session["position"], session["state"], session["frames"]) == (loss - 10, "ready", 40)
    assert (session["tracker"], session["recipe"]["seed"]) == (failed["tracker"], failed["seed"])
    assert session["parameters"]["occlusion_width_px"] == 55
    assert session["computed"] == min(loss + 10, 39)
    lost = client.get(f"/api/v1/sessions/{session['id']}/diagnostics").json()["columns"]["lost"]
    assert lost[: loss + 1] == [False] * loss + [True]
    explained = client.get(f"/api/v1/sessions/{session['id']}/explanation").json()
    assert (explained["diagnosis"]["lost"], explained["diagnosis"]["frame"]) == (True, loss)
    steer(client, session["id"], "seek", frame=39)
    saved = client.post("/api/v1/runs", json={"session": session["id"]}).json()
    row = result.table.filter(result.table["run"].to_numpy() == failed["run"]).to_pylist()[0]
    assert saved["summary"]["estimates_sha256"] == row["estimates_sha256"].hex()
    client.delete(f"/api/v1/sessions/{session['id']}")


def test_another_method(client: httpx.Client, sweep: dict[str, Any], url: str) -> None:
    """The seed of a row opens with any method of the experiment and is compared with another one by references.

    The reference of a run that does not exist is refused, however large its number is.
    """
    row = rows(client, sweep["id"], i=0, j=0, tracker="h-spf")["rows"][0]
    opening = f"{url}/rows/{row['run']}/open"
    for tracker in ("pc-pf", "apf"):
        session = client.post(opening, json={"tracker": tracker}).json()
        assert (session["tracker"], session["recipe"]["seed"]) == (tracker, row["seed"])
        client.delete(f"/api/v1/sessions/{session['id']}")
    assert error_of(client.post(opening, json={"tracker": "hope"}), 422)["field"] == "tracker"
    named = [{"reference": f"{sweep['id']}:{row['run']}{more}"} for more in ("", ":pc-pf")]
    recipes = [it["recipe"] for it in client.post("/api/v1/comparisons", json={"runs": named}).json()["result"]["runs"]]
    assert [(it["tracker"], it["seed"]) for it in recipes] == [("h-spf", row["seed"]), ("pc-pf", row["seed"])]
    for run in (RUNS, 10**100):
        wish = {"runs": [{"reference": f"{sweep['id']}:{number}"} for number in (0, run)]}
        assert f"runs 0 to {RUNS - 1}" in error_of(client.post("/api/v1/comparisons", json=wish), 404)["message"]


# Taking away.


def test_report(client: httpx.Client, served: Server) -> None:
    """The report is one page that needs nothing else, and its maps are pictures; nothing is left behind."""
    # Few measures: each has a picture, which takes half a second. The page has them as PNG.
    few = {"experiment": "sine", "axes": [{"name": "sample_count", "values": [5, 10]}], "parameters": {}}
    url = f"/api/v1/sweeps/{begin_sweep(client, **few, trackers=['condensation'], trials=2)['id']}"
    until_state(client, url.rpartition("/")[2], "done")
    outgoing = served.app.state.services.store.files.outgoing
    before = set(outgoing.iterdir())
    page = client.get(f"{url}/download", params={"format": "html"})
    assert page.text.startswith("<!doctype html>")
    assert ("<script src" in page.text, "<link" in page.text) == (False, False)
    archive = zipfile.ZipFile(io.BytesIO(client.get(f"{url}/download", params={"format": "svg"}).content))
    assert archive.namelist()
    assert all(archive.read(name).startswith(b"<?xml") for name in archive.namelist())
    wait_for(lambda: set(outgoing.iterdir()) <= before)
    client.delete(url)


# Stream.


def test_the_map_fills(served: Server, client: httpx.Client) -> None:
    """The stream begins with the whole map, and its later messages add up to the end of the sweep."""
    begun = begin_sweep(client, trials=8, seed=11)
    with connect(f"{served.ws}/api/v1/sweeps/{begun['id']}/stream") as socket:
        hello = hear(socket)
        assert (hello["type"], hello["sweep"]["id"]) == ("hello", begun["id"])
        runs = {one["tracker"]: one["runs"] for one in hello["cells"]["maps"]}
        state = hello["sweep"]["state"]
        while state != "done":
            message = hear(socket, 30)
            if message["type"] == "cells":
                for one in message["maps"]:
                    for place, count in zip(message["at"], one["runs"], strict=True):
                        assert count > runs[one["tracker"]][place]
                        runs[one["tracker"]][place] = count
            elif message["type"] == "progress":
                state = message["sweep"]["state"]
        assert all(counts == [8] * 6 for counts in runs.values())
        socket.send('{"type": "ping", "version": 1, "sent": 5}')
        assert hear(socket) == {"type": "pong", "version": 1, "sent": 5.0}
        assert client.delete(f"/api/v1/sweeps/{begun['id']}").status_code == 204
        assert farewell(socket)[0] == 4404
    error_of(client.get(f"/api/v1/sweeps/{begun['id']}"), 404)


def test_a_wrong_stream_is_closed(served: Server, sweep: dict[str, Any]) -> None:
    """A stream over an unknown axis is closed with the reason; so is one whose page sends anything but a ping."""
    address = f"{served.ws}/api/v1/sweeps/{sweep['id']}/stream"
    for query in ("?x=hope", f"?x={'%E2%98%83' * 50}"):
        with connect(f"{address}{query}") as socket:
            assert farewell(socket)[0] == 4422
    with connect(address) as socket:
        hear(socket)
        socket.send("cancel")
        assert farewell(socket)[0] > 1000


def test_nothing_is_left_behind(served: Server, client: httpx.Client, sweep: dict[str, Any]) -> None:
    """Sweeps that are begun, watched and deleted leave no process, descriptor or file behind."""
    here = psutil.Process()
    counts = []
    for seed in range(4):
        begun = begin_sweep(client, seed=100 + seed)
        with connect(f"{served.ws}/api/v1/sweeps/{begun['id']}/stream") as socket:
            hear(socket)
        client.delete(f"/api/v1/sweeps/{begun['id']}")
        gc.collect()
        counts.append((here.num_fds(), len(here.children(recursive=True))))
    wait_for(lambda: here.num_fds() <= counts[1][0] + 1)
    wait_for(lambda: len(here.children(recursive=True)) <= counts[0][1])
    names = {path.name.split(".")[0] for path in served.app.state.services.store.files.sweeps.iterdir()}
    assert names == {item["id"] for item in client.get("/api/v1/sweeps").json()}
