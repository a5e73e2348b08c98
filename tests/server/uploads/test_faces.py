"""Faces in uploads: found, shown with their points, tracked from these, measured by a truth, and kept."""

import json
import math
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from pftrack.runs.reproduction import load
from pftrack.sources.sequence import open_sequence
from pftrack.vision.face import FEATURES, LINKS, TITLES, gaze
from tests.experiments.head.heads import Picture, empty, film, marked, pictures, simulated
from tests.server.host import Server, begin, error_of
from tests.server.uploads.test_uploads import accepted, columns_of
from tests.server.work.test_runs import save
from tests.session_requests import session_request

FRAMES = 8


@pytest.fixture(scope="module")
def shown() -> list[Picture]:
    return pictures(FRAMES, width=320)


@pytest.fixture(scope="module")
def late(shown: list[Picture]) -> bytes:
    """Seven frames of nobody, then the simulated driver, alone in the picture."""
    return film([empty(shown[0])] * 7 + shown)


@pytest.fixture(scope="module")
def known(server: Server, shown: list[Picture]) -> str:
    """The driver as an upload, for tests that do not change it."""
    with httpx.Client(base_url=server.url, timeout=60) as client:
        return str(put(client, film(shown))["id"])


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


def test_points_and_what_they_are(client: httpx.Client, known: str) -> None:
    """The points of the first face lie at their true places; those placed by the model are named.

    The experiment declares what it finds, and how its points are called and connected.
    """
    found = look(client, known).json()
    assert (found["frame"], found["looked"], found["remarks"]) == (0, 1, [])
    assert list(found["mark"]["points"]) == list(FEATURES)
    for name, place in marked().items():
        assert np.hypot(*np.subtract(found["mark"]["points"][name], place)) < 6
    assert found["placed"] == ["points.lmc", "points.rmc"]
    experiments = {each["id"]: each for each in client.get("/api/v1/experiments").json()}
    head, ball = experiments["head"], experiments["ball"]
    assert (head["finds"], head["hints"], head["target"], ball["finds"]) == ("points", ["box"], "face", None)
    points, _ = head["marks"]
    assert {handle["name"]: handle["title"] for handle in points["handles"]} == {
        f"points.{name}": title for name, title in TITLES.items()
    }
    assert points["links"] == [[f"points.{name}" for name in link] for link in LINKS]


def test_a_face_that_enters_late(client: httpx.Client, late: bytes) -> None:
    """The first frame with a face is found, and a long search can be continued in parts.

    A session without a mark begins at that face, and a second one with the found points gives the same estimates.
    """
    upload = put(client, late)["id"]
    found = look(client, upload).json()
    assert (found["frame"], len(found["mark"]["points"])) == (7, len(FEATURES))
    alone = look(client, upload, last=0).json()
    assert (alone["mark"], alone["looked"], alone["of"]) == (None, 1, 1)
    assert "found none in the picture" in alone["remarks"][0]
    onward = look(client, upload, looked=9).json()
    assert (onward["frame"], onward["looked"]) == (9, 10)
    first = begin(client, experiment="head", upload=upload)
    start, points = begun_at(first)
    assert (start, first["frames"], points) == (7, FRAMES, found["mark"]["points"])
    second = begin(client, experiment="head", upload=upload, start=start, points=points)
    assert columns_of(client, first, 4)["estimate"] == columns_of(client, second, 4)["estimate"]


def test_a_box_is_enough(client: httpx.Client, known: str) -> None:
    """In a box the face is found, for a session as for a look."""
    assert len(begun_at(begin(client, experiment="head", upload=known, box=[90, 20, 130, 160]))[1]) == len(FEATURES)
    xs, ys = zip(*marked().values(), strict=True)
    around = hint(min(xs) - 20, min(ys) - 20, float(np.ptp(xs)) + 40, float(np.ptp(ys)) + 40)
    assert look(client, known, hint=around).json()["placed"] == ["points.lmc", "points.rmc"]


def test_questions_that_make_no_sense(client: httpx.Client, known: str) -> None:
    """An impossible frame, box or experiment is refused by its field."""
    for query, field in (
        ({"frame": 99}, None),
        ({"hint": "1,2,3"}, "hint"),
        ({"hint": hint(300, 200, 90, 90)}, None),
        ({"experiment": "ball"}, None),
    ):
        assert error_of(look(client, known, **query), 422).get("field") == field, query
    assert "Last must be a frame from 5 on" in error_of(look(client, known, frame=5, last=2), 422)["message"]


def test_what_does_not_go_together(client: httpx.Client, known: str) -> None:
    """A wrong point is refused by its name; so is a mark of another kind, or one without an upload."""
    two = {"nose": [1, 1], "leye": [2, 2]}
    wishes: list[tuple[dict[str, Any], str | None]] = [
        ({"points": {"leye": [1, 1], "ear": [2, 2]}}, "mark.points.ear"),
        ({"points": {"leye": [190, 90], "reye": [140]}}, "mark.points.reye.1"),
        ({"points": {"leye": [math.nan, 1], "reye": [9, 9]}}, "mark.points.leye.0"),
        ({"experiment": "ball", "points": two}, "mark.kind"),
        ({"upload": None, "points": two}, "upload"),
    ]
    for wish, field in wishes:
        body = json.dumps(session_request({"experiment": "head", "upload": known, **wish}))
        answer = client.post("/api/v1/sessions", content=body, headers={"content-type": "application/json"})
        assert error_of(answer, 422).get("field") == field, wish


def test_a_saved_run_reopens_with_the_same_face(client: httpx.Client, late: bytes, tmp_path: Path) -> None:
    """Points, start and poses are in the saved run: here and in the library it has the same hash."""
    upload = put(client, late)["id"]
    assert put_truth(client, upload, poses(7)).status_code == 200
    points = {name: list(place) for name, place in marked().items()}
    session = begin(client, experiment="head", upload=upload, points=points, start=7)
    assert begun_at(session) == (7, points)
    assert columns_of(client, session, FRAMES - 1)["searching"][-1] is False
    run = save(client, session["id"])
    opened = client.post(f"/api/v1/runs/{run['id']}/open", timeout=60).json()
    assert begun_at(opened) == (7, points)
    assert save(client, opened["id"])["summary"]["estimates_sha256"] == run["summary"]["estimates_sha256"]
    assert all(error is not None for error in columns_of(client, opened)["error"])

    (tmp_path / "run.pft").write_bytes(client.get(f"/api/v1/runs/{run['id']}/download").content)
    (tmp_path / "face.mp4").write_bytes(late)
    again = load(tmp_path / "run.pft", open_sequence=lambda _: open_sequence(tmp_path / "face.mp4"))
    again.finish()
    assert again.estimates_sha256 == run["summary"]["estimates_sha256"]


def test_poses_measure_a_session(client: httpx.Client, known: str) -> None:
    """A table of poses is summarised, measures later sessions, survives a wrong table, and can be deleted."""
    path = f"/api/v1/uploads/{known}/truth?experiment=head"
    assert client.get(path).json() is None
    given = put_truth(client, known, poses()).json()
    assert given == {"frames": FRAMES, "first": 0, "last": FRAMES - 1, "warnings": []}
    wrong = error_of(put_truth(client, known, "frame,yaw_deg,pitch_deg,roll_deg\n0,1,left,3\n"), 422)["message"]
    assert "line 2: pitch_deg must be a number of degrees" in wrong
    assert client.get(path).json() == given
    errors = columns_of(client, begin(client, experiment="head", upload=known), FRAMES - 1)["error"]
    assert errors[0] == pytest.approx(0, abs=1e-6)
    assert 0 < max(errors) < 10
    assert (client.delete(path).status_code, client.get(path).json()) == (204, None)


def test_an_upload_that_was_deleted_meanwhile(server: Server, client: httpx.Client, late: bytes) -> None:
    """If an upload was deleted while its table was read, nothing is kept, and the refusal says so."""
    upload = put(client, late)["id"]
    files = server.app.state.services.store.files
    files.remove("uploads", upload)
    assert "deleted" in error_of(put_truth(client, upload, poses()), 409)["message"]
    assert not files.truth(upload, "poses").parent.exists()
    client.delete(f"/api/v1/uploads/{upload}")
