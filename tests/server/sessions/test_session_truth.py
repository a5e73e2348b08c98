"""Truth for a session that runs already: as boxes or polygons, added and replaced."""

import json
from typing import Any

import httpx
import pytest

from pftrack_server.store.database import SessionRow
from tests.server.asking import columns, get
from tests.server.host import Server, box, error_of, steer

BOXES = "frame,x,y,w,h\n" + "".join(f"{frame},31,51,19,19\n" for frame in range(12))
POLYGONS = "frame,x1,y1,x2,y2,x3,y3\n" + "".join(f"{frame},100,10,110,30,90,30\n" for frame in range(12))
RECIPE = {"experiment": "ball", "tracker": "h-spf", "footage": {"mark": box(31, 51), "start": 0}}


@pytest.fixture
def recorded(client: httpx.Client, upload: str) -> dict[str, Any]:
    """A session on the clip."""
    return client.post("/api/v1/sessions", json={"recipe": RECIPE, "upload": upload}).json()


def give(client: httpx.Client, session: str, table: str) -> httpx.Response:
    return client.put(f"/api/v1/sessions/{session}/truth", files={"file": ("truth.csv", table.encode())})


def given(client: httpx.Client, session: str, table: str) -> dict[str, Any]:
    """Give a table, and return what is told of it."""
    return give(client, session, table).raise_for_status().json()


def test_truth_is_added_and_replaced_while_a_session_lives(
    server: Server, client: httpx.Client, upload: str, recorded: dict[str, Any]
) -> None:
    """The estimates stay the same to the bit; the errors, also of the next session, are those by the new table."""
    session = recorded["id"]
    assert recorded["truth_columns"] == ["frame", "x", "y", "w", "h"]
    steer(client, session, "seek", frame=9)
    before = columns(client, session)
    assert before["error"][9] is None

    told = given(client, session, BOXES)
    (kept,) = (row.spec for row in server.app.state.services.store.all(SessionRow) if row.id == session)
    assert len(json.loads(kept)["truth"]) == told["frames"] == 12, "nothing is lost by a crash"
    after = columns(client, session)
    assert after["estimate"] == before["estimate"]
    assert (after["error"][9] < 5, get(client, session)["position"]) == (True, 9)

    where = f"/api/v1/uploads/{upload}/truth.csv?experiment=ball"
    table = client.get(where)
    assert table.text == BOXES
    assert table.headers["content-disposition"].endswith('-truth.csv"')
    mark = recorded["truth_mark"]
    assert (mark["editor"]["kind"], mark["parts"]) == ("box", ["x", "y", "width", "height"])

    given(client, session, POLYGONS)
    assert client.get(where).text.startswith("frame,x,y,w,h\n0,90,10,20,20\n"), "the boxes around them"
    assert columns(client, session)["error"][9] > 50
    again = client.post("/api/v1/sessions", json={"recipe": RECIPE, "upload": upload}).json()
    assert columns(client, again["id"])["error"][0] > 50


def test_what_does_not_fit_the_clip_is_told(client: httpx.Client, upload: str, recorded: dict[str, Any]) -> None:
    """A playing run is measured by a table of a longer clip and continues; rows beyond are ignored with a warning.

    Boxes of a clip of another size have the same warning from the session and from the upload.
    """
    session = recorded["id"]
    steer(client, session, "speed", speed=0.1)
    steer(client, session, "play")
    told = given(client, session, BOXES + "".join(f"{frame},31,51,19,19\n" for frame in range(12, 15)))
    beyond = "The file lists 3 frames after the last of the recording, 11; they are left out."
    assert (told["frames"], told["warnings"], get(client, session)["state"]) == (12, [beyond], "playing")
    larger = BOXES.replace("31,51,19,19", "248,408,152,152")
    (outside,) = given(client, session, larger)["warnings"]
    assert outside.startswith("12 of 12 true boxes lie wholly outside the picture of 160 x 120 px: frames 0 to 11")
    file = {"file": ("truth.csv", larger.encode())}
    again = client.put(f"/api/v1/uploads/{upload}/truth", params={"experiment": "ball"}, files=file)
    assert again.raise_for_status().json()["warnings"] == [outside]


def test_a_wrong_table_changes_nothing(
    client: httpx.Client, upload: str, session: dict[str, str], recorded: dict[str, Any]
) -> None:
    """A wrong table is refused with its line, and a simulated scene takes none."""
    assert "does not hold results" in error_of(give(client, recorded["id"], "a,b\n1,2\n"), 422)["message"]
    assert columns(client, recorded["id"])["error"][0] is None
    assert "this session has none" in error_of(give(client, session["id"], BOXES), 409)["message"]
    table = client.get(f"/api/v1/uploads/{upload}/truth.csv?experiment=ball")
    assert "No truth was given" in error_of(table, 404)["message"]
