"""Comparisons over REST: runs named in three ways, outlined at once, computed as a job, and refused in sentences."""

import csv
import io
import json
from typing import Any

import httpx
import pytest

from pftrack.experiments import find
from pftrack.runs.comparison import Comparison
from pftrack.runs.run import Run
from tests.server.follow_jobs import ended, written
from tests.server.host import begin, command, error_of, steer
from tests.server.uploads.test_uploads import send, video
from tests.session_requests import session_request

BALL = find("ball")


def ball(tracker: str = "h-spf", frames: int = 30, **more: Any) -> dict[str, Any]:
    return {"recipe": {"experiment": "ball", "tracker": tracker, "seed": 7, "frames": frames, **more}}


def compare(client: httpx.Client, *runs: dict[str, Any]) -> dict[str, Any]:
    answer = client.post("/api/v1/comparisons", json={"runs": list(runs)})
    assert answer.status_code == 202, answer.text
    return answer.json()


def compared(frames: int) -> Comparison:
    """Compare two trackers by the library."""
    runs = (Run(BALL, BALL.simulate(), tracker=name, seed=7, frames=frames) for name in ("h-spf", "condensation"))
    return Comparison.of(*runs).finish()


def outline(client: httpx.Client, *runs: dict[str, Any]) -> dict[str, Any]:
    """Return what is known of a comparison from the start."""
    return compare(client, *runs)["result"]


def refusal(client: httpx.Client, status: int, *runs: dict[str, Any]) -> str:
    return error_of(client.post("/api/v1/comparisons", json={"runs": list(runs)}), status)["message"]


def test_recipes_are_compared_as_the_library_compares_them(client: httpx.Client) -> None:
    """What differs is told at once, with recipes no longer than what is common; then come the library's numbers."""
    job = compare(client, ball(), ball("condensation", frames=25))
    begun = job["result"]
    assert [run["first"] for run in begun["runs"]] == [0, 0]
    assert [run["recipe"]["frames"] for run in begun["runs"]] == [30, 25]
    assert [run["shown"]["frames"] for run in begun["runs"]] == [25, 25]
    assert [setting["name"] for setting in begun["settings"]] == ["tracker"]
    done = ended(client, job)
    expected = compared(25).as_dict()
    assert done["state"] == "done"
    found = done["result"]["found"]
    assert found == {name: expected[name] for name in found}
    assert [run["name"] for run in done["result"]["runs"]] == expected["names"]
    assert client.delete(f"/api/v1/jobs/{job['id']}").status_code == 204
    assert "job does not exist" in error_of(client.get(f"/api/v1/jobs/{job['id']}"), 404)["message"]


def test_branches_and_saved_runs_are_named_by_references(client: httpx.Client) -> None:
    """A branch parts from its run in the frame after it left, also from that run saved, and by another tracker."""
    session = begin(client, tracker="h-spf")["id"]
    steer(client, session, "seek", frame=12)
    saved = client.post("/api/v1/runs", json={"session": session, "title": "Mine"}).json()["id"]
    command(client, session, "branch", frame=12, values={"tracker": "apf"})
    references = f"{session}:b0", f"{session}:b1", saved, f"{session}:b0:condensation"
    begun = compare(client, *({"reference": reference} for reference in references))
    assert [run["title"] for run in begun["result"]["runs"]][2:] == ["Mine", None]
    found = ended(client, begun)["result"]["found"]
    frames = {(it["first"], it["second"]): it["frame"] for it in found["partings"]}
    assert (frames[0, 1], frames[0, 2], frames[1, 2]) == (13, None, 13)
    assert found["first_difference"] == frames[0, 3] < 13


def test_a_recording_is_found_and_named_where_it_is_missing(client: httpx.Client) -> None:
    """Runs on an upload are compared picture by picture; without it the recipe is refused, and so is its saved run."""
    upload = send(client, ("clip.mp4", video(13))).json()  # as long as no other test's, which would stand for it
    mark = {"kind": "box", "x": 8, "y": 18, "width": 14, "height": 14}
    early, late = (
        {"recipe": {"experiment": "ball", "footage": {"sha256": upload["sha256"], "start": start, "mark": mark}}}
        for start in (0, 3)
    )
    job = compare(client, early, late)
    begun = job["result"]
    assert [run["first"] for run in begun["runs"]] == [3, 0]
    assert {run["upload"] for run in begun["runs"]} == {upload["id"]}
    assert ended(client, job)["state"] == "done"
    session = client.post("/api/v1/sessions", json=session_request(early)).json()["id"]
    saved = client.post("/api/v1/runs", json={"session": session}).json()["id"]
    client.delete(f"/api/v1/sessions/{session}")
    assert client.delete(f"/api/v1/uploads/{upload['id']}").status_code == 204
    linked = ({"recipe": run["recipe"]} for run in begun["runs"])
    assert "upload is missing; upload clip.mp4 first" in refusal(client, 422, *linked)
    assert "the clip clip.mp4, which is not on this server. Upload it first." in refusal(
        client, 409, {"reference": saved}, {"reference": saved}
    )


@pytest.mark.parametrize(
    ("runs", "status", "said"),
    [
        ([ball()], 422, "two to four runs to compare, got 1"),
        ([ball()] * 5, 422, "two to four runs to compare, got 5"),
        ([ball(), {"recipe": {"experiment": "sine"}}], 422, "in px, those of"),
        ([ball(), {"recipe": {"experiment": "nothing"}}], 422, "nothing"),
        ([ball(), ball(timeline=[{"frame": 0, "values": {"sample_count": -3}}])], 422, "ample_count must be"),
        ([ball(), ball(frames=900_000)], 422, "on this server"),
        ([ball(), ball("viterbi")], 422, "viterbi"),
        ([ball(), {"reference": "0123456789abcdef"}], 404, "saved run '0123456789abcdef' is not here"),
        ([ball(), {"reference": "0123456789abcdef:b0"}], 404, "branch 'b0' of a session"),
        ([ball(), {"reference": "0123456789abcdef:3"}], 404, "sweep does not exist"),
        ([ball(), {"reference": "a:b:c:d"}], 422, "session:branch or sweep:run, got 'a:b:c:d'"),
        ([ball(), {}], 422, "either a reference or a recipe"),
    ],
)
def test_what_cannot_be_compared_is_said(
    client: httpx.Client, runs: list[dict[str, Any]], status: int, said: str
) -> None:
    """Wrong numbers of runs, other units, unknown and deleted runs and values out of bounds: a sentence each."""
    assert said in refusal(client, status, *runs)


SAVED = "/api/v1/comparisons/saved"


def test_a_comparison_is_kept_named_found_and_deleted(client: httpx.Client) -> None:
    """What is kept makes it again; a name may be given at any time, and words find it."""
    begun = outline(client, ball(), ball("condensation"))
    runs = [{"recipe": run["recipe"]} for run in begun["runs"]]
    body = {"title": "Two trackers", "runs": runs, "position": 4, "arrangement": "over"}
    kept = client.post(SAVED, json=body).raise_for_status().json()
    place = f"{SAVED}/{kept['id']}"
    assert kept["title"] == "Two trackers"
    assert (kept["experiments"], kept["trackers"]) == (["ball"], ["h-spf", "condensation"])
    found = client.get(place).json()
    assert (found["position"], found["arrangement"]) == (4, "over")
    again = outline(client, *({"recipe": run["recipe"]} for run in found["runs"]))
    assert [run["recipe"] for run in again["runs"]] == [run["recipe"] for run in begun["runs"]]

    renamed = client.patch(place, json={"title": "  Why one is lost "}).raise_for_status().json()
    assert renamed["title"] == "Why one is lost"
    error_of(client.patch(place, json={"title": " "}), 422)
    work = client.get("/api/v1/work", params={"q": "why condensation"}).json()
    assert [each["title"] for each in work["comparisons"]] == ["Why one is lost"]
    assert work["found"]["comparisons"] == 1
    assert [each["id"] for each in client.get(SAVED).json()] == [kept["id"]]

    client.delete(place).raise_for_status()
    for method in ("GET", "DELETE"):
        assert "comparison does not exist" in error_of(client.request(method, place), 404)["message"]


def test_what_is_kept_of_a_comparison_is_bounded(start_server: Any) -> None:
    """One run alone, a name that cannot be seen, unknown experiments and trackers and one too many are not kept.

    No path of a recording is kept.
    """
    clip = {"footage": {"name": "clip.mp4", "path": "/etc/hostname", "truth": {"0": [1.0, 2.0, 3.0, 4.0]}}}
    with start_server(max_comparisons=1) as (_, client):

        def keep(*runs: dict[str, Any], title: str = "clips") -> httpx.Response:
            return client.post(SAVED, json={"title": title, "runs": runs})

        body = ball(**clip), ball("condensation", **clip)
        for refused in (keep(ball()), keep(*body, title="\u200b"), keep(*body, {"recipe": {"experiment": "no-such"}})):
            error_of(refused, 422)
        assert "viterbi" in error_of(keep(ball(), ball("viterbi")), 422)["message"]
        assert client.get(SAVED).json() == []
        kept = keep(*body).raise_for_status().json()
        for run in client.get(f"{SAVED}/{kept['id']}").json()["runs"]:
            footage = run["recipe"]["footage"]
            assert (footage["name"], footage.get("path"), footage.get("truth")) == ("clip.mp4", None, None)
        assert "at most 1 comparisons" in error_of(keep(*body), 409)["message"]


def test_a_comparison_is_written_as_files(client: httpx.Client) -> None:
    """Each that is listed, by a job like those of runs; the table is that of the library."""
    runs = [ball(), ball("condensation")]
    offered = outline(client, *runs)["exports"]
    assert [one["name"] for one in offered] == ["csv", "png", "svg", "json"]
    written = {one["name"]: export(client, one["name"], runs) for one in offered}
    expected = compared(30)
    rows = list(csv.DictReader(io.StringIO(written["csv"].decode())))
    assert [row["name"] for row in rows] == [name for name in expected.names for _ in range(30)]
    errors = [row.error for each in expected.rows for row in each]
    assert [float(row["error"]) for row in rows] == errors
    assert written["png"].startswith(b"\x89PNG")
    assert b"<svg" in written["svg"]
    told = json.loads(written["json"])
    assert told["outcomes"] == expected.as_dict()["outcomes"]
    recipes = [{"recipe": run["recipe"]} for run in told["runs"]]
    assert outline(client, *recipes)["frames"] == 30, "it can be made again"
    answer = client.post("/api/v1/comparisons/exports/docx", json={"runs": runs})
    assert "one of csv, png, svg, json" in error_of(answer, 404)["message"]


def export(client: httpx.Client, name: str, runs: list[dict[str, Any]]) -> bytes:
    """Return a file of a comparison."""
    body = {"runs": runs, "title": "Two: trackers/"}
    begun = client.post(f"/api/v1/comparisons/exports/{name}", json=body)
    assert begun.json()["name"] == f"compare-two-trackers.{name}"
    return written(client, begun).content
