"""Truth for a session that runs already: as boxes or polygons, added and replaced."""

import json

import httpx

from pftrack_server.store.database import SessionRow
from tests.server.asking import columns
from tests.server.host import Server, error_of, steer
from tests.server.uploads.test_suitability import box
from tests.server.uploads.test_suitability import clip as clip  # noqa: PLC0414 - a fixture
from tests.server.uploads.test_suitability import upload as upload  # noqa: PLC0414 - a fixture

BOXES = "frame,x,y,w,h\n" + "".join(f"{frame},31,51,19,19\n" for frame in range(12))
POLYGONS = "frame,x1,y1,x2,y2,x3,y3\n" + "".join(f"{frame},100,10,110,30,90,30\n" for frame in range(12))


def give(client: httpx.Client, session: str, table: str) -> httpx.Response:
    return client.put(f"/api/v1/sessions/{session}/truth", files={"file": ("truth.csv", table.encode())})


def test_truth_is_added_and_replaced_while_a_session_lives(server: Server, client: httpx.Client, upload: str) -> None:
    """The estimates stay to the bit, the errors are those by the new table, and the next session has it, too."""
    recipe = {"experiment": "ball", "footage": {"mark": box(31, 51), "start": 0}}
    session = client.post("/api/v1/sessions", json={"recipe": recipe, "upload": upload}).json()
    assert session["truth_columns"] == ["frame", "x", "y", "w", "h"]
    steer(client, session["id"], "seek", frame=9)
    before = columns(client, session["id"])
    assert before["error"][9] is None

    told = give(client, session["id"], BOXES).raise_for_status().json()
    (kept,) = (row.spec for row in server.app.state.services.store.all(SessionRow) if row.id == session["id"])
    assert len(json.loads(kept)["truth"]) == 12, "nothing is lost by a crash"
    assert told["frames"] == 12
    after = columns(client, session["id"])
    assert after["estimate"] == before["estimate"]
    assert after["error"][9] < 5  # type: ignore[operator]
    assert client.get(f"/api/v1/sessions/{session['id']}").json()["position"] == 9

    where = f"/api/v1/uploads/{upload}/truth.csv?experiment=ball"
    table = client.get(where)
    assert table.text == BOXES
    assert table.headers["content-disposition"].endswith('-truth.csv"')
    assert session["truth_mark"]["editor"]["kind"] == "box"
    assert session["truth_mark"]["parts"] == ["x", "y", "width", "height"]

    give(client, session["id"], POLYGONS).raise_for_status()
    assert client.get(where).text.startswith("frame,x,y,w,h\n0,90,10,20,20\n"), "the boxes around them"
    assert columns(client, session["id"])["error"][9] > 50  # type: ignore[operator]
    again = client.post("/api/v1/sessions", json={"recipe": recipe, "upload": upload}).json()
    assert columns(client, again["id"])["error"][0] > 50  # type: ignore[operator]


def test_a_run_that_plays_goes_on_playing(client: httpx.Client, upload: str) -> None:
    """Measured by a table of a longer clip: its rows beyond this one are left out, and told."""
    recipe = {"experiment": "ball", "footage": {"mark": box(31, 51), "start": 0}}
    session = client.post("/api/v1/sessions", json={"recipe": recipe, "upload": upload}).json()["id"]
    steer(client, session, "speed", speed=0.1)
    steer(client, session, "play")
    longer = BOXES + "".join(f"{frame},31,51,19,19\n" for frame in range(12, 15))
    told = give(client, session, longer).raise_for_status().json()
    assert told["frames"] == 12
    assert told["warnings"] == ["The file lists 3 frames after the last of the recording, 11; they are left out."]
    assert client.get(f"/api/v1/sessions/{session}").json()["state"] == "playing"


def test_boxes_of_a_clip_of_another_size_are_told(client: httpx.Client, upload: str) -> None:
    """By the session and by the upload, in the same words; a target that leaves the picture is nothing to tell."""
    recipe = {"experiment": "ball", "footage": {"mark": box(31, 51), "start": 0}}
    session = client.post("/api/v1/sessions", json={"recipe": recipe, "upload": upload}).json()["id"]
    larger = "frame,x,y,w,h\n" + "".join(f"{frame},248,408,152,152\n" for frame in range(12))
    (told,) = give(client, session, larger).raise_for_status().json()["warnings"]
    assert told.startswith(
        "12 of 12 true boxes lie wholly outside the picture of 160 x 120 px: frames 0 to 11; that of frame 0 is 248"
    )
    file = {"file": ("truth.csv", larger.encode())}
    again = client.put(f"/api/v1/uploads/{upload}/truth", params={"experiment": "ball"}, files=file)
    assert again.raise_for_status().json()["warnings"] == [told]
    leaves = BOXES.replace("11,31,51", "11,160,51")
    assert give(client, session, leaves).raise_for_status().json()["warnings"] == []


def test_what_is_no_truth_changes_nothing(client: httpx.Client, upload: str, session: dict[str, str]) -> None:
    """A wrong table is refused with its line, and a scene that is simulated knows its own."""
    recipe = {"experiment": "ball", "footage": {"mark": box(31, 51), "start": 0}}
    begun = client.post("/api/v1/sessions", json={"recipe": recipe, "upload": upload}).json()
    assert "does not hold results" in error_of(give(client, begun["id"], "a,b\n1,2\n"), 422)["message"]
    assert columns(client, begun["id"])["error"][0] is None
    assert "this session has none" in error_of(give(client, session["id"], BOXES), 409)["message"]
    table = client.get(f"/api/v1/uploads/{upload}/truth.csv?experiment=ball")
    assert "No truth was given" in error_of(table, 404)["message"]
