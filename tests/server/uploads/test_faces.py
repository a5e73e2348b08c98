"""Faces in uploads: found, shown with their points, tracked from these, measured by a truth, and kept."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from pftrack.runs.reproduction import load
from pftrack.sources.sequence import open_sequence
from pftrack.vision.face import FEATURES, LINKS, TITLES, gaze
from tests.experiments.head.heads import Picture, empty, film, marked, pictures, simulated
from tests.experiments.head.test_head_recording import turning
from tests.server.follow_jobs import bring_in
from tests.server.host import Server, begin, error_of, steer
from tests.server.uploads.test_uploads import accepted, columns_of
from tests.server.work.test_runs import estimates, save
from tests.session_requests import session_request

FRAMES = 12


@pytest.fixture(scope="module")
def shown() -> list[Picture]:
    return pictures(FRAMES, width=320)


@pytest.fixture(scope="module")
def late(shown: list[Picture]) -> bytes:
    """Seven frames of nobody, then the simulated driver, alone in the picture."""
    return film([empty(shown[0])] * 7 + shown)


@pytest.fixture(scope="module")
def known(server: Server, shown: list[Picture]) -> str:
    """The driver as an upload, for tests that leave it as it is."""
    with httpx.Client(base_url=server.url, timeout=60) as client:
        return str(put(client, film(shown))["id"])


@pytest.fixture(scope="module")
def known_late(server: Server, late: bytes) -> str:
    """The clip of who enters late as an upload, for tests that leave it as it is."""
    with httpx.Client(base_url=server.url, timeout=60) as client:
        return str(put(client, late)["id"])


def put(client: httpx.Client, content: bytes) -> dict[str, Any]:
    return accepted(client, ("face.mp4", content))


def look(client: httpx.Client, upload: str, frame: int = 0, **more: Any) -> httpx.Response:
    query = {"experiment": "head", "frame": frame, **more}
    return client.get(f"/api/v1/uploads/{upload}/mark", params=query, timeout=60)


def hint(x: float, y: float, width: float, height: float) -> str:
    return json.dumps({"kind": "box", "x": x, "y": y, "width": width, "height": height})


def begun_at(session: dict[str, Any]) -> tuple[int, dict[str, Any]]:
    """The frame of the upload at which a session begins, and the points there."""
    footage = session["recipe"]["footage"]
    assert footage["mark"]["kind"] == "points"
    return footage["start"], footage["mark"]["points"]


def poses(start: int = 0) -> str:
    """The true poses of the clip, as a file has them."""
    lines = ["frame,yaw_deg,pitch_deg,roll_deg"]
    for index, frame in enumerate(simulated(FRAMES)):
        yaw, pitch, roll = np.rad2deg(gaze(frame.target.position))
        lines.append(f"{start + index},{yaw + 3:.4f},{pitch - 5:.4f},{roll:.4f}")
    return "\n".join(lines)


def put_truth(client: httpx.Client, upload: str, text: str, experiment: str = "head") -> httpx.Response:
    files = {"file": ("my poses.csv", text.encode())}
    return client.put(f"/api/v1/uploads/{upload}/truth", params={"experiment": experiment}, files=files)


# Found.


def test_points_and_what_they_are(client: httpx.Client, known: str) -> None:
    """The points of the first face lie where they truly are; it is told which were placed by the model."""
    found = look(client, known).json()
    assert (found["frame"], found["looked"], found["remarks"]) == (0, 1, [])
    assert list(found["mark"]["points"]) == list(FEATURES)
    for name, place in marked().items():
        assert np.hypot(*np.subtract(found["mark"]["points"][name], place)) < 6
    assert found["placed"] == ["points.lmc", "points.rmc"]
    experiments = {each["id"]: each for each in client.get("/api/v1/experiments").json()}
    assert (experiments["head"]["finds"], experiments["head"]["hints"]) == ("points", ["box"])
    assert experiments["head"]["target"] == "face"
    points, box = experiments["head"]["marks"]
    assert "chin" in box["instruction"]
    assert "person's own" in experiments["head"]["advice"]
    assert {handle["name"]: handle["title"] for handle in points["handles"]} == {
        f"points.{name}": title for name, title in TITLES.items()
    }
    assert points["links"] == [[f"points.{name}" for name in link] for link in LINKS]
    assert experiments["head"]["truth_columns"] == ["frame", "yaw_deg", "pitch_deg", "roll_deg"]
    assert experiments["ball"]["finds"] is None
    assert [mark["kind"] for mark in experiments["ball"]["marks"]] == ["box"]


def test_who_enters_late(client: httpx.Client, known_late: str) -> None:
    """The first frame with a face is told, and for a single frame without one why there is none.

    What was looked into before is not looked into again, so that a long search can be told in parts.
    """
    found = look(client, known_late).json()
    assert (found["frame"], len(found["mark"]["points"])) == (7, len(FEATURES))
    alone = look(client, known_late, last=0).json()
    assert (alone["mark"], alone["looked"], alone["of"]) == (None, 1, 1)
    assert "found none in the picture" in alone["remarks"][0]
    onward = look(client, known_late, looked=9).json()
    assert (onward["frame"], onward["looked"]) == (9, 10)


def test_a_later_face_from_the_front_is_preferred(client: httpx.Client) -> None:
    """A page is proposed the picture that a session without points would begin at, and told why."""
    upload = put(client, film(turning(92, 94, 100, 102, 104, 106), 15))["id"]
    found = look(client, upload).json()
    assert found["frame"] in {2, 4}
    assert found["remarks"] == ["In frame 0 the face looks aside."]
    session = begin(client, experiment="head", upload=upload)
    assert begun_at(session) == (found["frame"], found["mark"]["points"])
    alone = look(client, upload, last=0).json()
    assert (alone["frame"], "better start" in alone["remarks"][-1]) == (0, True)


def test_a_box_is_enough(client: httpx.Client, known: str, shown: list[Picture]) -> None:
    """In a box the face is found; where none is recognised a mean face fills the box, within the picture."""
    points = marked()
    xs, ys = zip(*points.values(), strict=True)
    around = hint(min(xs) - 20, min(ys) - 20, float(np.ptp(xs)) + 40, float(np.ptp(ys)) + 40)
    found = look(client, known, hint=around).json()
    assert found["placed"] == ["points.lmc", "points.rmc"]
    nobody = put(client, film([empty(shown[0])] * 3))["id"]
    placed = look(client, nobody, hint=hint(250, 100, 70, 140)).json()
    assert placed["placed"] == [f"points.{name}" for name in FEATURES]
    assert "mean face" in placed["remarks"][0]
    assert all(250 <= x <= 319 and 100 <= y <= 239 for x, y in placed["mark"]["points"].values())
    assert placed["mark"]["points"]["reye"][0] < placed["mark"]["points"]["leye"][0]


def test_why_there_is_none(client: httpx.Client, shown: list[Picture]) -> None:
    """A picture without a face to be tracked is refused in a sentence, and a session on it in the same.

    Of two faces one is proposed, and it is said how to have the other.
    """
    picture = shown[0]
    for changed, words in (
        (empty(picture), "found none in the picture"),
        (np.ascontiguousarray(picture[::-1, ::-1]), "upside down"),
    ):
        upload = put(client, film([changed] * 2))["id"]
        found = look(client, upload, last=0).json()
        assert found["mark"] is None
        assert words in found["remarks"][0]
        body = session_request({"experiment": "head", "upload": upload})
        assert words in error_of(client.post("/api/v1/sessions", json=body, timeout=60), 422)["message"]
    found = look(client, put(client, film([np.hstack([picture, picture])] * 2))["id"]).json()
    assert len(found["mark"]["points"]) == len(FEATURES)
    assert "draw a box around another one" in found["remarks"][0]


def test_questions_that_make_no_sense(client: httpx.Client, known: str) -> None:
    """A frame, a box or an experiment that is not to be had is refused with what is allowed."""
    questions: list[tuple[dict[str, Any], str | None]] = [
        ({"frame": 99}, None),
        ({"frame": -1}, "frame"),
        ({"hint": "1,2,3"}, "hint"),
        ({"hint": '{"kind": "points", "points": {"nose": [1, 2]}}'}, None),
        ({"hint": hint(300, 200, 90, 90)}, None),
        ({"experiment": "sine"}, "experiment"),
        ({"experiment": "ball"}, None),
    ]
    for query, field in questions:
        assert error_of(look(client, known, **query), 422).get("field") == field, query
    message = error_of(look(client, known, frame=5, last=2), 422)["message"]
    assert "Last must be a frame from 5 on" in message


# Tracked.


def test_points_are_where_it_begins(client: httpx.Client, known: str) -> None:
    """A session begins at the points that it was given, shows them, and has no box then.

    Of a box what was found in it is kept.
    """
    points = {name: list(place) for name, place in marked().items()}
    session = begin(client, experiment="head", upload=known, points=points)
    assert begun_at(session) == (0, points)
    assert steer(client, session["id"], "seek", frame=FRAMES - 1)["computed"] == FRAMES - 1
    assert columns_of(client, session)["searching"][-1] is False
    session = begin(client, experiment="head", upload=known, box=[90, 20, 130, 160])
    assert len(begun_at(session)[1]) == len(FEATURES)


def test_what_was_found_is_kept(client: httpx.Client, known_late: str) -> None:
    """Without a box the face is found, later than asked for if need be, and a second start does not look again."""
    first = begin(client, experiment="head", upload=known_late)
    start, points = begun_at(first)
    assert (start, first["frames"], len(points)) == (7, FRAMES, len(FEATURES))
    second = begin(client, experiment="head", upload=known_late, start=start, points=points)
    for session in (first, second):
        steer(client, session["id"], "seek", frame=FRAMES - 1)
    assert estimates(client, first["id"]) == estimates(client, second["id"])


def test_the_server_may_be_restarted(start_server: Any, late: bytes) -> None:
    """A session on a face outlives the server, with its points and its truth."""
    with start_server() as (_, client):
        upload = put(client, late)["id"]
        assert put_truth(client, upload, poses(7)).status_code == 200
        session = begin(client, experiment="head", upload=upload)
        before = columns_of(client, session, 9)
    with start_server() as (_, client):
        again = client.post(f"/api/v1/sessions/{session['id']}/resume", timeout=60).json()
        assert begun_at(again) == begun_at(session)
        after = columns_of(client, session)
        assert (after["estimate"], after["error"]) == (before["estimate"], before["error"])


def test_what_does_not_go_together(client: httpx.Client, known: str) -> None:
    """A point that is unknown, no point or outside is refused by its name, and points that make no face too.

    An upload, a box and points are refused by the one that is too much, missing or not finite.
    """
    two, line = {"nose": [1, 1], "leye": [2, 2]}, {name: [100 + 9 * at, 100] for at, name in enumerate(FEATURES)}
    outside = "within the picture of 320 x 240 px"
    wishes: list[tuple[dict[str, Any], str | None, str]] = [
        ({"points": {"nose": [10, 10]}}, None, "at least two of nose"),
        ({"points": {"leye": [1, 1], "ear": [2, 2]}}, "mark.points.ear", "one of nose"),
        ({"points": {"leye": [190, 90], "reye": [320, 90]}}, "mark.points.reye", outside),
        ({"points": {"leye": [190, 90], "reye": [140]}}, "mark.points.reye.1", "required"),
        ({"points": {"leye": [190, 90], "reye": [190, 90]}}, None, "all at one place"),
        ({"points": line}, None, "on one line"),
        ({"points": {"leye": [math.nan, 1], "reye": [9, 9]}}, "mark.points.leye.0", ""),
        ({"experiment": "ball"}, "mark", ""),
        ({"experiment": "ball", "points": two}, "mark.kind", ""),
        ({"upload": None, "points": two}, "upload", ""),
        ({"upload": None, "box": [1, 1, 9, 9]}, "upload", ""),
    ]
    for wish, field, words in wishes:
        body = json.dumps(session_request({"experiment": "head", "upload": known, **wish}))
        answer = client.post("/api/v1/sessions", content=body, headers={"content-type": "application/json"})
        error = error_of(answer, 422)
        assert error.get("field") == field, wish
        assert words in error["message"]


# Kept.


def test_a_saved_run_reopens_with_the_same_face(client: httpx.Client, late: bytes, tmp_path: Path) -> None:
    """Points, start and poses are in the saved run: here and in the library it has the same hash."""
    upload = put(client, late)["id"]
    assert put_truth(client, upload, poses(7)).status_code == 200
    session = begin(client, experiment="head", upload=upload)
    start, points = begun_at(session)
    moved = {**points, "nose": [points["nose"][0] + 1.5, points["nose"][1]]}
    session = begin(client, experiment="head", upload=upload, points=moved, start=start)
    steer(client, session["id"], "seek", frame=FRAMES - 1)
    run = save(client, session["id"])
    opened = client.post(f"/api/v1/runs/{run['id']}/open", timeout=60).json()
    assert begun_at(opened) == (7, moved)
    assert save(client, opened["id"])["summary"]["estimates_sha256"] == run["summary"]["estimates_sha256"]
    assert all(error is not None for error in columns_of(client, opened)["error"])

    content = client.get(f"/api/v1/runs/{run['id']}/download").content
    brought = bring_in(client, content)
    assert brought["summary"]["reproduced"] is True
    (tmp_path / "run.pft").write_bytes(content)
    (tmp_path / "face.mp4").write_bytes(late)
    again = load(tmp_path / "run.pft", open_sequence=lambda _: open_sequence(tmp_path / "face.mp4"))
    again.finish()
    assert again.estimates_sha256 == run["summary"]["estimates_sha256"]


@pytest.fixture
def judged(client: httpx.Client, known: str) -> Iterator[str]:
    """The clip as an upload that has no truth, neither before nor after the test."""
    yield known
    for experiment in ("head", "ball"):
        client.delete(f"/api/v1/uploads/{known}/truth", params={"experiment": experiment})


# Truth.


def test_poses_measure_a_session(client: httpx.Client, judged: str) -> None:
    """A table of poses is told in short, measures what begins from then on, and can be forgotten."""
    path = f"/api/v1/uploads/{judged}/truth?experiment=head"
    assert client.get(path).json() is None
    given = put_truth(client, judged, poses()).json()
    assert given == {"frames": FRAMES, "first": 0, "last": FRAMES - 1, "warnings": []}
    assert client.get(path).json() == given
    session = begin(client, experiment="head", upload=judged)
    errors = columns_of(client, session, FRAMES - 1)["error"]
    assert errors[0] == pytest.approx(0, abs=1e-6)
    assert 0 < max(errors) < 10
    assert client.delete(path).status_code == 204
    assert client.get(path).json() is None


def test_boxes_measure_a_ball(client: httpx.Client, judged: str) -> None:
    """The kind of truth is that of the experiment."""
    answer = put_truth(client, judged, "frame,x,y,w,h\n0,10,20,10,10\n1,11,20,10,10\n", "ball")
    assert answer.json()["frames"] == 2
    assert client.get(f"/api/v1/uploads/{judged}/truth?experiment=head").json() is None
    session = begin(client, upload=judged, box=[10, 20, 10, 10])
    assert columns_of(client, session)["error"][0] is not None
    steer(client, session["id"], "seek", frame=1)
    saved = save(client, session["id"])
    assert saved["summary"]["success_measure"] == "inside_share"
    share = f"{100 * saved['summary']['inside_share']:.0f} %"
    assert saved["outcome"] == f"{share} inside the true box, 2 frames in all"


def test_what_is_no_truth(client: httpx.Client, judged: str) -> None:
    """A table that cannot be used is refused with its line and what is allowed, and what was there stays."""
    put_truth(client, judged, poses())
    head = "frame,yaw_deg,pitch_deg,roll_deg"
    for text, words in (
        ("", f"The file, line 1: expected the columns {head.replace(',', ', ')}"),
        (f"{head}\n0,1,left,3\n", "line 2: pitch_deg must be a number of degrees"),
        (f"{head}\n900,1,2,3\n", "0 to 11; the file begins at frame 900"),
        ("\x00\x01", "The file"),
    ):
        assert words in error_of(put_truth(client, judged, text), 422)["message"]
    assert client.get(f"/api/v1/uploads/{judged}/truth?experiment=head").json()["frames"] == FRAMES


def test_an_upload_that_was_deleted_meanwhile(start_server: Any, late: bytes) -> None:
    """Where the upload has gone while its table was read, nothing is kept, and that is said."""
    with start_server() as (server, client):
        upload = put(client, late)["id"]
        files = server.app.state.services.store.files
        files.remove("uploads", upload)
        assert "deleted" in error_of(put_truth(client, upload, poses()), 409)["message"]
        assert not files.truth(upload, "poses").parent.exists()
