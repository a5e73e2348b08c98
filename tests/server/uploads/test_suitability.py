"""The verdict whether a target can be followed, before an upload is tracked and while it is."""

import json
from typing import Any

import httpx

from tests.making import disc_film
from tests.server.host import box, steer

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
    colours = [(210, 40, 40)] * FRAMES + [(112, 110, 110)] * FRAMES
    film = disc_film(2 * FRAMES, speed_px=0, colours=colours)
    upload = client.post("/api/v1/uploads", files={"file": ("fade.mp4", film)}).json()["id"]
    told = ask(client, upload, box(31, 51)).json()["remark"]
    assert "looked at picture 0, and around the same place in 8 pictures up to 23" in told.lower()
    for experiment in ("ball", "histogram"):
        recipe = {"experiment": experiment, "footage": {"mark": box(31, 51), "start": 0}}
        session = client.post("/api/v1/sessions", json={"recipe": recipe, "upload": upload}).json()["id"]
        looks = [steer(client, session, "seek", frame=frame)["look"] for frame in (FRAMES - 1, 2 * FRAMES - 1, 3)]
        assert [look.startswith("Separates well from the start") for look in looks] == [True, False, True], looks
        assert "since frame" in looks[1], looks
