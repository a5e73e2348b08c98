"""Comparisons over REST: runs named in three ways, outlined at once, computed as a job, or refused in a sentence."""

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
from tests.server.host import begin, command, error_of, granted, post, steer
from tests.server.uploads.test_uploads import send, video
from tests.session_requests import session_request

BALL = find("ball")


def ball(tracker: str = "h-spf", frames: int = 30, **more: Any) -> dict[str, Any]:
    return {"recipe": {"experiment": "ball", "tracker": tracker, "seed": 7, "frames": frames, **more}}


def compare(client: httpx.Client, *runs: dict[str, Any]) -> dict[str, Any]:
    return dict(post(client, "comparisons", runs=runs))


def outline(client: httpx.Client, *runs: dict[str, Any]) -> dict[str, Any]:
    """Return the outline of a comparison, which is known from the start."""
    return compare(client, *runs)["result"]


def refusal(client: httpx.Client, status: int, *runs: dict[str, Any]) -> str:
    return error_of(client.post("/api/v1/comparisons", json={"runs": list(runs)}), status)["message"]


def test_recipes_are_compared_as_the_library_compares_them(client: httpx.Client) -> None:
    """The differences come at once, with recipes no longer than what is common; then come the library's numbers.

    Files are written by jobs, like those of runs, and the JSON makes the comparison again.
    """
    runs = [ball(), ball("condensation", frames=25)]
    job = compare(client, *runs)
    begun = job["result"]
    told = [(run["first"], run["recipe"]["frames"], run["shown"]["frames"]) for run in begun["runs"]]
    assert told == [(0, 30, 25), (0, 25, 25)]
    assert [setting["name"] for setting in begun["settings"]] == ["tracker"]
    done = ended(client, job)
    own = (Run(BALL, BALL.simulate(), tracker=name, seed=7, frames=25) for name in ("h-spf", "condensation"))
    expected = Comparison.of(*own).finish().as_dict()
    found = done["result"]["found"]
    assert (done["state"], found) == ("done", {name: expected[name] for name in found})
    assert [run["name"] for run in done["result"]["runs"]] == expected["names"]
    assert client.delete(f"/api/v1/jobs/{job['id']}").status_code == 204
    assert "job does not exist" in error_of(client.get(f"/api/v1/jobs/{job['id']}"), 404)["message"]

    assert [one["name"] for one in begun["exports"]] == ["csv", "png", "svg", "json"]
    files = {name: export(client, name, runs) for name in ("csv", "svg", "json")}
    assert [row["frame"] for row in csv.DictReader(io.StringIO(files["csv"].decode()))] == 2 * list(map(str, range(25)))
    assert b"<svg" in files["svg"]
    said = json.loads(files["json"])
    assert said["outcomes"] == expected["outcomes"]
    assert outline(client, *({"recipe": run["recipe"]} for run in said["runs"]))["frames"] == 25
    answer = client.post("/api/v1/comparisons/exports/docx", json={"runs": runs})
    assert "one of csv, png, svg, json" in error_of(answer, 404)["message"]


def test_branches_and_saved_runs_are_named_by_references(client: httpx.Client) -> None:
    """A branch differs from its run, also a saved one, after the frame where it begins; so does another tracker."""
    session = begin(client, tracker="h-spf", frames=30)["id"]
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
    """Runs on an upload are compared picture by picture; without it their recipes and saved runs are refused."""
    upload = send(client, ("clip.mp4", video(13))).json()  # as long as no other test's, which would stand for it
    mark = {"kind": "box", "x": 8, "y": 18, "width": 14, "height": 14}
    early, late = (
        {"recipe": {"experiment": "ball", "footage": {"sha256": upload["sha256"], "start": start, "mark": mark}}}
        for start in (0, 3)
    )
    job = compare(client, early, late)
    begun = job["result"]
    assert [(run["first"], run["upload"]) for run in begun["runs"]] == [(3, upload["id"]), (0, upload["id"])]
    assert ended(client, job)["state"] == "done"
    session = client.post("/api/v1/sessions", json=session_request(early)).json()["id"]
    saved = client.post("/api/v1/runs", json={"session": session}).json()["id"]
    client.delete(f"/api/v1/sessions/{session}")
    assert client.delete(f"/api/v1/uploads/{upload['id']}").status_code == 204
    linked = ({"recipe": run["recipe"]} for run in begun["runs"])
    assert "upload is missing; upload clip.mp4 first" in refusal(client, 422, *linked)
    words = refusal(client, 409, {"reference": saved}, {"reference": saved})
    assert "the clip clip.mp4, which is not on this server. Upload it first." in words


@pytest.mark.parametrize(
    ("runs", "status", "words"),
    [
        ([ball()], 422, "two to four runs to compare, got 1"),
        ([ball(), {"recipe": {"experiment": "sine"}}], 422, "in px, those of"),
        ([ball(), ball(frames=900_000)], 422, "on this server"),
        ([ball(), {"reference": "0123456789abcdef"}], 404, "saved run '0123456789abcdef' is not here"),
        ([ball(), {"reference": "0123456789abcdef:b0"}], 404, "branch 'b0' of a session"),
        ([ball(), {"reference": "0123456789abcdef:3"}], 404, "sweep does not exist"),
        ([ball(), {"reference": "a:b:c:d"}], 422, "session:branch or sweep:run, got 'a:b:c:d'"),
        ([ball(), {}], 422, "either a reference or a recipe"),
    ],
)
def test_impossible_comparisons(client: httpx.Client, runs: list[dict[str, Any]], status: int, words: str) -> None:
    """A wrong number of runs, other units, too many frames and unknown or deleted runs get a sentence each."""
    assert words in refusal(client, status, *runs)


SAVED = "/api/v1/comparisons/saved"


def test_a_comparison_is_stored_renamed_found_and_deleted(client: httpx.Client) -> None:
    """A stored comparison can be made again, renamed, and found by words."""
    begun = outline(client, ball(), ball("condensation"))
    runs = [{"recipe": run["recipe"]} for run in begun["runs"]]
    body = {"title": "Two trackers", "runs": runs, "position": 4, "arrangement": "over"}
    kept = granted(client.post(SAVED, json=body))
    place = f"{SAVED}/{kept['id']}"
    told = kept["title"], kept["experiments"], kept["trackers"]
    assert told == ("Two trackers", ["ball"], ["h-spf", "condensation"])
    found = client.get(place).json()
    assert (found["position"], found["arrangement"]) == (4, "over")
    again = outline(client, *({"recipe": run["recipe"]} for run in found["runs"]))
    assert [run["recipe"] for run in again["runs"]] == [run["recipe"] for run in begun["runs"]]

    assert granted(client.patch(place, json={"title": "  Why one is lost "}))["title"] == "Why one is lost"
    error_of(client.patch(place, json={"title": " "}), 422)
    work = client.get("/api/v1/work", params={"q": "why condensation"}).json()
    assert ([each["title"] for each in work["comparisons"]], work["found"]["comparisons"]) == (["Why one is lost"], 1)
    assert [each["id"] for each in client.get(SAVED).json()] == [kept["id"]]

    client.delete(place).raise_for_status()
    for method in ("GET", "DELETE"):
        assert "comparison does not exist" in error_of(client.request(method, place), 404)["message"]


def test_limits_of_stored_comparisons(start_server: Any) -> None:
    """A single run, an invisible name, unknown experiments and trackers and one too many are refused.

    No path of a recording is stored.
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


def export(client: httpx.Client, name: str, runs: list[dict[str, Any]]) -> bytes:
    """Return a file of a comparison."""
    begun = client.post(f"/api/v1/comparisons/exports/{name}", json={"runs": runs, "title": "Two: trackers/"})
    assert begun.json()["name"] == f"compare-two-trackers.{name}"
    return written(client, begun).content
