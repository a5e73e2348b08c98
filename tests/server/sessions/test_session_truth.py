"""Truth for a running session, and the verdict whether its target can be followed."""

import json
from typing import Any

import httpx
import pytest

from pftrack_server.store.database import SessionRow
from tests.making import disc_film
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
    server: Server, client: httpx.Client, upload: str, session: dict[str, Any], recorded: dict[str, Any]
) -> None:
    """The estimates stay the same to the bit; the errors, also of the next session, are those by the new table.

    A wrong table is refused with its line, and a simulated scene takes none.
    """
    where = f"/api/v1/uploads/{upload}/truth.csv?experiment=ball"
    assert "No truth was given" in error_of(client.get(where), 404)["message"]
    assert "this session has none" in error_of(give(client, session["id"], BOXES), 409)["message"]
    name = recorded["id"]
    assert "does not hold results" in error_of(give(client, name, "a,b\n1,2\n"), 422)["message"]
    assert recorded["truth_columns"] == ["frame", "x", "y", "w", "h"]
    steer(client, name, "seek", frame=9)
    before = columns(client, name)
    assert before["error"][9] is None

    told = given(client, name, BOXES)
    (kept,) = (row.spec for row in server.app.state.services.store.all(SessionRow) if row.id == name)
    assert len(json.loads(kept)["truth"]) == told["frames"] == 12, "nothing is lost by a crash"
    after = columns(client, name)
    assert after["estimate"] == before["estimate"]
    assert (after["error"][9] < 5, get(client, name)["position"]) == (True, 9)

    table = client.get(where)
    assert table.text == BOXES
    assert table.headers["content-disposition"].endswith('-truth.csv"')
    mark = recorded["truth_mark"]
    assert (mark["editor"]["kind"], mark["parts"]) == ("box", ["x", "y", "width", "height"])

    given(client, name, POLYGONS)
    assert client.get(where).text.startswith("frame,x,y,w,h\n0,90,10,20,20\n"), "the boxes around them"
    assert columns(client, name)["error"][9] > 50
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


FRAMES = 12


def ask(client: httpx.Client, upload: str, mark: object, **more: Any) -> httpx.Response:
    query = {"experiment": "ball", "frame": 0, "mark": json.dumps(mark), **more}
    return client.get(f"/api/v1/uploads/{upload}/suitability", params=query)


def test_a_target_that_stands_out(client: httpx.Client, upload: str) -> None:
    """The verdict has a number, words, and a picture of the likelihood; for a box on plain ground it has advice.

    A browser caches it, so that a mark moved back to its place is not weighed again; a refusal is not cached.
    """
    dull = ask(client, upload, box(100, 20)).raise_for_status().json()
    assert (dull["grade"], len(dull["advice"])) == ("not at all", 1)
    assert dull["value"] < 0.3
    headers = [ask(client, upload, mark).headers["cache-control"] for mark in (box(31, 51), {"kind": "box"})]
    assert headers == ["private, max-age=600", "private, no-cache"]
    found = ask(client, upload, box(31, 51)).raise_for_status().json()
    assert (found["grade"], found["advice"], found["better"]) == ("well", [], None)
    assert found["value"] > 0.9
    assert found["remark"].startswith("Separates well: ")
    assert found["picture"].startswith("data:image/jpeg;base64,/9j/")


def test_the_verdict_changes_while_tracking(client: httpx.Client) -> None:
    """When a disc loses its colour, the session reports that it no longer separates, and since which frame."""
    film = disc_film(2 * FRAMES, speed_px=0, colours=[(210, 40, 40)] * FRAMES + [(112, 110, 110)] * FRAMES)
    upload = client.post("/api/v1/uploads", files={"file": ("fade.mp4", film)}).json()["id"]
    told = ask(client, upload, box(31, 51)).json()["remark"]
    assert "looked at picture 0, and around the same place in 8 pictures up to 23" in told.lower()
    for experiment in ("ball", "histogram"):
        recipe = {"experiment": experiment, "footage": {"mark": box(31, 51), "start": 0}}
        session = client.post("/api/v1/sessions", json={"recipe": recipe, "upload": upload}).json()["id"]
        looks = [steer(client, session, "seek", frame=frame)["look"] for frame in (FRAMES - 1, 2 * FRAMES - 1, 3)]
        assert [look.startswith("Separates well from the start") for look in looks] == [True, False, True], looks
        assert "since frame" in looks[1], looks
