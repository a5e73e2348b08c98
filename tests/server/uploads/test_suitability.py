"""Whether a target can be followed: asked of an upload before it is tracked, over the network."""

import base64
import json
from typing import Any

import cv2
import httpx
import numpy as np
import pytest

from tests.making import disc_film

FRAMES = 12


@pytest.fixture(scope="module")
def clip() -> bytes:
    """A red disc at 40, 60 on grey, 160 x 120 px."""
    return disc_film(FRAMES, speed_px=0)


@pytest.fixture
def upload(client: httpx.Client, clip: bytes) -> str:
    return str(client.post("/api/v1/uploads", files={"file": ("walk.mp4", clip)}).json()["id"])


def ask(client: httpx.Client, upload: str, mark: object, **more: Any) -> httpx.Response:
    query = {"experiment": "ball", "frame": 0, "mark": json.dumps(mark), **more}
    return client.get(f"/api/v1/uploads/{upload}/suitability", params=query)


def box(x: float, y: float, width: float = 19, height: float = 19) -> dict[str, object]:
    return {"kind": "box", "x": x, "y": y, "width": width, "height": height}


def test_a_target_that_stands_out(client: httpx.Client, upload: str) -> None:
    """It is told in a number, in words, and by a picture of the likelihood that is bright on the target alone.

    A box on the grey ground cannot be told from the ground, and what would help is said. A browser keeps the answer: a
    mark that is moved back to where it was is not weighed again; what is refused is asked again.
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
    encoded = base64.b64decode(found["picture"].removeprefix("data:image/jpeg;base64,"))
    picture = cv2.imdecode(np.frombuffer(encoded, np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (120, 160, 3)
    green = picture[:, :, 1].astype(int)  # what grows in viridis
    assert green[60, 40] > green[20, 120] + 60


def test_questions_that_make_no_sense(client: httpx.Client, upload: str) -> None:
    """Each is refused with a sentence that says what would be right."""
    questions: list[tuple[object, dict[str, Any], str]] = [
        (box(150, 60), {}, "within the picture of 160 x 120 px"),
        ({"kind": "points", "points": {}}, {}, "must be one of box"),
        ([1, 2], {}, "Mark must be a mark as a JSON object"),
        (box(31, 51), {"frame": 40}, "0 to 11"),
        (box(31, 51), {"experiment": "sine"}, "must be one that takes a video"),
    ]
    for mark, more, words in questions:
        answer = ask(client, upload, mark, **more)
        assert 400 <= answer.status_code < 500
        assert words in answer.json()["error"]["message"]


def test_the_verdict_changes_while_tracking(client: httpx.Client) -> None:
    """A disc that loses its colour separates no more, and the session says so and since when."""
    colours = [(210, 40, 40)] * FRAMES + [(112, 110, 110)] * FRAMES
    film = disc_film(2 * FRAMES, speed_px=0, colours=colours)
    upload = client.post("/api/v1/uploads", files={"file": ("fade.mp4", film)}).json()["id"]
    told = ask(client, upload, box(31, 51)).json()["remark"]
    assert "looked at picture 0, and around the same place in 8 pictures up to 23" in told.lower()
    for experiment in ("ball", "histogram"):
        recipe = {"experiment": experiment, "footage": {"mark": box(31, 51), "start": 0}}
        session = client.post("/api/v1/sessions", json={"recipe": recipe, "upload": upload}).json()
        where = f"/api/v1/sessions/{session['id']}"
        said = [
            client.post(f"{where}/commands", json={"kind": "seek", "frame": frame}).json()["look"]
            for frame in (FRAMES - 1, 2 * FRAMES - 1, 3)
        ]
        assert said[0].startswith("Separates well from the start"), said
        assert "since frame" in said[1], said
        assert not said[1].startswith("Separates well"), said
        assert said[2].startswith("Separates well from the start"), said
