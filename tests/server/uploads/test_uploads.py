"""Uploads: cut off while they stream, decoded once before anybody uses them, deleted when they do not pass."""

import io
import socket
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image

from tests.conftest import BASE
from tests.making import encoded
from tests.server.confined import children
from tests.server.host import Server, begin, error_of, steer
from tests.session_requests import session_request
from tests.waiting import wait_for

SIZE = (64, 48)
HEAD = (
    b"POST %s/api/v1/uploads HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: %d\r\n"
    b"Content-Type: multipart/form-data; boundary=XX\r\n\r\n"
)
PART = b'--XX\r\nContent-Disposition: form-data; name="file"; filename="%s"\r\n\r\n%s'
"""A request for an upload, of so many bytes, and a file of a form, by name and content."""


def png(grey: int, size: tuple[int, int] = SIZE) -> bytes:
    """A picture of one shade with a red square."""
    width, height = size
    picture = np.full((height, width, 3), grey, np.uint8)
    picture[20:30, 20 + grey // 10 : 30 + grey // 10] = (220, 20, 20)
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "PNG")
    return file.getvalue()


def video(frames: int = 24) -> bytes:
    """A short video of a red square that moves."""
    pictures = np.full((frames, SIZE[1], SIZE[0], 3), 90, np.uint8)
    for number, picture in enumerate(pictures):
        picture[20:30, 10 + number : 20 + number] = (220, 20, 20)
    return encoded(pictures, 25)


def send(client: httpx.Client, *files: tuple[str, bytes]) -> httpx.Response:
    return client.post("/api/v1/uploads", files=[("file", file) for file in files])


def accepted(client: httpx.Client, *files: tuple[str, bytes]) -> dict[str, Any]:
    """What is told of an upload that is taken in."""
    answer = send(client, *files)
    assert answer.status_code == 201, answer.text
    told: dict[str, Any] = answer.json()
    return told


def columns_of(client: httpx.Client, session: dict[str, Any], frame: int | None = None) -> dict[str, Any]:
    """The numbers of a session, up to a frame."""
    if frame is not None:
        steer(client, session["id"], "seek", frame=frame)
    columns: dict[str, Any] = client.get(f"/api/v1/sessions/{session['id']}/diagnostics").json()["columns"]
    return columns


@pytest.fixture(scope="module")
def clip() -> bytes:
    return video()


# Taken in.


def test_a_video(client: httpx.Client, clip: bytes) -> None:
    """A video is told with what was found in it, its frames can be seen, and it can be deleted."""
    upload = accepted(client, ("square.mp4", clip))
    assert (upload["name"], upload["kind"], upload["frames"]) == ("square.mp4", "video", 24)
    assert (upload["width"], upload["height"], upload["size_bytes"]) == (*SIZE, len(clip))
    assert upload in client.get("/api/v1/uploads").json()
    frame = client.get(f"/api/v1/uploads/{upload['id']}/frames/3.jpg")
    assert frame.headers["cache-control"] == "private, max-age=86400"
    assert frame.headers["content-type"] == "image/jpeg"
    assert frame.content.startswith(b"\xff\xd8")
    assert error_of(client.get(f"/api/v1/uploads/{upload['id']}/frames/24.jpg"), 422)["message"]
    assert client.delete(f"/api/v1/uploads/{upload['id']}").status_code == 204
    error_of(client.get(f"/api/v1/uploads/{upload['id']}"), 404)


def test_pictures_in_natural_order(client: httpx.Client) -> None:
    """Several pictures make a sequence in the natural order of their names."""
    upload = accepted(client, *[(f"{number}.png", png(10 * number)) for number in (10, 2, 1)])
    assert (upload["kind"], upload["frames"], upload["name"]) == ("images", 3, "10.png and 2 more")
    frames = [client.get(f"/api/v1/uploads/{upload['id']}/frames/{number}.jpg") for number in range(3)]
    shades = [np.median(Image.open(io.BytesIO(frame.content)).convert("L")) for frame in frames]
    assert shades == pytest.approx([10, 20, 100], abs=3)


def test_two_of_one_name_are_told_apart(client: httpx.Client, clip: bytes) -> None:
    """The second gets a number, wherever it is named; a name that was deleted is free again."""
    first, second, third = (accepted(client, ("twice.mp4", clip)) for _ in range(3))
    assert [it["name"] for it in (first, second, third)] == ["twice.mp4", "twice.mp4 (2)", "twice.mp4 (3)"]
    assert client.delete(f"/api/v1/uploads/{first['id']}").status_code == 204
    assert accepted(client, ("twice.mp4", clip))["name"] == "twice.mp4"
    longest = [accepted(client, ("x" * 300, clip))["name"] for _ in range(2)]
    assert longest == ["x" * 200, "x" * 190 + " (2)"]
    truth = {"file": ("truth.csv", b"frame,x,y,w,h\n0,10,20,10,10\n")}
    address = f"/api/v1/uploads/{second['id']}/truth"
    assert client.put(f"{address}?experiment=ball", files=truth).is_success
    told = client.get(f"{address}.csv?experiment=ball").headers["content-disposition"]
    assert told.endswith('"twice-2-truth.csv"')


def test_a_session_on_an_upload(client: httpx.Client, clip: bytes) -> None:
    """A session runs on an upload with the box of its target, and the upload cannot be deleted meanwhile.

    A box or a start outside the recording is refused with what is allowed.
    """
    upload = accepted(client, ("ball.mp4", clip))
    session = begin(client, upload=upload["id"], box=[10, 20, 10, 10], start=2)
    assert (session["frames"], session["width"], session["upload"]) == (22, SIZE[0], upload["id"])
    moved = steer(client, session["id"], "seek", frame=15)
    assert moved["computed"] == 15
    estimate = columns_of(client, session)["estimate"][15]
    assert abs(estimate[0] - (17 + 15 - 2)) < 12
    error_of(client.delete(f"/api/v1/uploads/{upload['id']}"), 409)
    client.delete(f"/api/v1/sessions/{session['id']}")
    wishes: list[tuple[dict[str, Any], str]] = [
        *(({"box": box}, "mark") for box in ([60, 20, 10, 10], [-1, 20, 10, 10], [0, 0, 1000, 1000])),
        ({"box": [0, 0, 10]}, "mark.height"),
        ({"box": "all"}, "mark.x"),
        ({"box": [0, 0, 10, 10], "start": 24}, "start"),
        ({"box": [0, 0, 10, 10], "frames": 25}, "frames"),
    ]
    for wish, field in wishes:
        body = session_request({"experiment": "ball", "upload": upload["id"], **wish})
        assert error_of(client.post("/api/v1/sessions", json=body), 422)["field"] == field
    assert client.delete(f"/api/v1/uploads/{upload['id']}").status_code == 204


# Refused.


def test_what_is_no_sequence(server: Server, client: httpx.Client) -> None:
    """Anything but a sequence of pictures is refused with what is allowed, and nothing of it is kept."""
    files = server.app.state.services.store.files
    before = len(list(files.uploads.iterdir()))
    for content in (b"", b"hello", b"ffconcat version 1.0\nfile /etc/passwd\n", png(40), b"%PDF-1.4"):
        error_of(send(client, ("video.mp4", content)), 422)
        assert len(list(files.uploads.iterdir())) == before
        assert list(files.incoming.iterdir()) == []


def test_what_cannot_be_written(
    server: Server, client: httpx.Client, clip: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of an upload that the database does not take nothing is kept."""
    store = server.app.state.services.store
    before = list(store.files.uploads.iterdir())

    def fail(_: object) -> None:
        raise OSError("on purpose")

    monkeypatch.setattr(store, "add", fail)
    assert send(client, ("ball.mp4", clip)).status_code >= 500
    assert list(store.files.uploads.iterdir()) == before
    assert list(store.files.incoming.iterdir()) == []


def test_names(server: Server, client: httpx.Client, clip: bytes) -> None:
    """A name is only ever a title: only what may be shown of it is kept, and no part of it becomes a path.

    One that is far too long is refused in so many words. A video that was cut short is refused or taken with a
    warning, never a mistake of the server.
    """
    headers = {"content-type": "multipart/form-data; boundary=XX"}
    for name in ("../../../etc/passwd", "..\\..\\boot.ini", "a\0b.mp4", "y" * 500, "", "../../etc/only\u202ehere.mp4"):
        body = PART % (name.encode(), clip) + b"\r\n--XX--\r\n"
        answer = client.post("/api/v1/uploads", content=body, headers=headers)
        assert answer.status_code == 201, answer.text
        shown = answer.json()["name"]
        assert "/" not in shown
        assert "\\" not in shown
        assert shown.isprintable()
        assert 0 < len(shown) <= 200
        folder = server.app.state.services.store.files.uploads / answer.json()["id"]
        assert sorted(path.name for path in folder.iterdir()) == ["content", "index.json"]
    assert shown == "onlyhere.mp4"
    assert "too long" in error_of(send(client, ("x" * 5000 + ".mp4", clip)), 400)["message"]
    assert send(client, ("cut.mp4", clip[: len(clip) // 2])).status_code in {201, 422}


def test_bodies(server: Server, client: httpx.Client) -> None:
    """A body without a form and a file is refused, and nothing of it is kept."""
    form = "multipart/form-data; boundary=XX"
    other_field = b'--XX\r\nContent-Disposition: form-data; name="x"\r\n\r\nabc\r\n--XX--\r\n'
    parts = (b"nonsense", b"", PART % (b"a", b"abc"), other_field, b"--XX\r\n" + b"A" * 100_000)
    for kind, body in [("text/plain", b"x"), ("multipart/form-data", b"x"), *((form, part) for part in parts)]:
        answer = client.post("/api/v1/uploads", content=body, headers={"content-type": kind})
        assert answer.status_code in {400, 422}
        error_of(answer, answer.status_code)
        assert list(server.app.state.services.store.files.incoming.iterdir()) == []


# Limits.


def test_bytes_files_pixels_and_frames(start_server: Any, tmp_path: Path, clip: bytes) -> None:
    """Too many bytes are refused before any is read, or cut off while they stream; so are files and pictures."""
    limits = {"max_upload_bytes": 1_000_000, "max_upload_files": 3, "max_pixels": SIZE[0] * SIZE[1]}
    with start_server(**limits, max_frames=24) as (server, client):
        with socket.create_connection(("127.0.0.1", server.port)) as raw:
            raw.sendall(HEAD % (BASE.encode(), 99_999_999_999))
            assert b" 413 " in raw.recv(4096)

        def endless() -> Any:
            yield PART % (b"a.mp4", b"")
            for _ in range(400):
                yield b"\0" * 65536

        headers = {"content-type": "multipart/form-data; boundary=XX"}
        answer = client.post("/api/v1/uploads", content=endless(), headers=headers)
        assert "at most" in error_of(answer, 413)["message"]
        assert list((tmp_path / "data" / "incoming").iterdir()) == []
        answer = send(client, *[(f"{number}.png", png(number)) for number in range(4)])
        assert "at most 3 files" in error_of(answer, 413)["message"]
        assert send(client, ("ball.mp4", clip)).status_code == 201
        error_of(send(client, ("long.mp4", video(25))), 422)
        error_of(send(client, *[(f"Picture {number}.png", png(number, (64, 49))) for number in range(2)]), 422)


def test_a_browser_that_vanishes(server: Server, client: httpx.Client, endless: Path) -> None:
    """An upload whose sender vanishes, or waits no more while its file is decoded, leaves nothing behind."""
    incoming, before = server.app.state.services.store.files.incoming, set(children())
    with socket.create_connection(("127.0.0.1", server.port)) as raw:
        raw.sendall(HEAD % (BASE.encode(), 100_000) + PART % (b"a.mp4", b"abc"))
    wait_for(lambda: list(incoming.iterdir()) == [])
    assert client.get("/healthz").status_code == 200
    with pytest.raises(httpx.ReadTimeout):
        httpx.post(f"{server.url}/api/v1/uploads", files={"file": ("a.gif", endless.read_bytes())}, timeout=0.5)
    wait_for(lambda: set(children()) <= before and not list(incoming.iterdir()))


def test_pictures_have_the_names_that_people_know(client: httpx.Client) -> None:
    """What is wrong with a picture is told by the name that it was sent with."""
    answer = send(client, ("Left eye 10.png", png(1)), ("Left eye 9.png", png(1)[:60]))
    message = error_of(answer, 422)["message"]
    assert "Left eye 9.png is broken or cut short" in message
    assert "000000" not in message
    answer = send(client, ("One.png", png(1)), ("Two.png", png(1, (32, 32))))
    assert "Two.png is 32 x 32 px and One.png is 64 x 48 px" in error_of(answer, 422)["message"]
