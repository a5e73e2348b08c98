"""Uploads: limited while they stream, however cut into chunks; decoded once before use, deleted if refused."""

import io
import socket
import tempfile
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import httpx
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from PIL import Image
from starlette.requests import Request

from pftrack.core.refusal import RefusedError
from pftrack_server.core.errors import ApiError, disk_full
from pftrack_server.store.disk_budget import DiskBudget
from pftrack_server.uploads.multipart import Received, receive
from tests.apart import run
from tests.conftest import BASE
from tests.making import encoded
from tests.server.confined import children
from tests.server.host import Server, begin, error_of, granted, steer
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
    """A picture of one shade."""
    file = io.BytesIO()
    Image.new("RGB", size, (grey,) * 3).save(file, "PNG")
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
    return granted(send(client, *files))


def columns_of(client: httpx.Client, session: dict[str, Any], frame: int | None = None) -> dict[str, Any]:
    """The numbers of a session, up to a frame."""
    if frame is not None:
        steer(client, session["id"], "seek", frame=frame)
    return client.get(f"/api/v1/sessions/{session['id']}/diagnostics").json()["columns"]


@pytest.fixture(scope="module")
def clip() -> bytes:
    return video()


def test_a_video(client: httpx.Client, clip: bytes) -> None:
    """The answer has what was found in the video; its frames can be seen, and it can be deleted."""
    upload = accepted(client, ("square.mp4", clip))
    assert (upload["name"], upload["kind"], upload["frames"]) == ("square.mp4", "video", 24)
    assert (upload["width"], upload["height"], upload["size_bytes"]) == (*SIZE, len(clip))
    assert upload in client.get("/api/v1/uploads").json()
    frame = client.get(f"/api/v1/uploads/{upload['id']}/frames/3.jpg")
    assert (frame.headers["cache-control"], frame.headers["content-type"]) == ("private, max-age=86400", "image/jpeg")
    assert frame.content.startswith(b"\xff\xd8")
    error_of(client.get(f"/api/v1/uploads/{upload['id']}/frames/24.jpg"), 422)
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
    """The second gets a number; the name of a deleted upload is free again."""
    first, second, third = (accepted(client, ("twice.mp4", clip)) for _ in range(3))
    assert [it["name"] for it in (first, second, third)] == ["twice.mp4", "twice.mp4 (2)", "twice.mp4 (3)"]
    assert client.delete(f"/api/v1/uploads/{first['id']}").status_code == 204
    assert accepted(client, ("twice.mp4", clip))["name"] == "twice.mp4"
    assert [accepted(client, ("x" * 300, clip))["name"] for _ in range(2)] == ["x" * 200, "x" * 190 + " (2)"]
    truth, address = b"frame,x,y,w,h\n0,10,20,10,10\n", f"/api/v1/uploads/{second['id']}/truth"
    assert client.put(f"{address}?experiment=ball", files={"file": ("truth.csv", truth)}).is_success
    told = client.get(f"{address}.csv?experiment=ball").headers["content-disposition"]
    assert told.endswith('"twice-2-truth.csv"')


def test_a_session_on_an_upload(client: httpx.Client, clip: bytes) -> None:
    """A session follows the marked target; meanwhile the upload cannot be deleted.

    A mark or a start outside the recording is refused by its field.
    """
    upload = accepted(client, ("ball.mp4", clip))
    session = begin(client, upload=upload["id"], box=[10, 20, 10, 10], start=2)
    assert (session["frames"], session["width"], session["upload"]) == (22, SIZE[0], upload["id"])
    assert abs(columns_of(client, session, 15)["estimate"][15][0] - (17 + 15 - 2)) < 12
    error_of(client.delete(f"/api/v1/uploads/{upload['id']}"), 409)
    client.delete(f"/api/v1/sessions/{session['id']}")
    for wish, field in (
        ({"box": [60, 20, 10, 10]}, "mark"),
        ({"box": [0, 0, 10]}, "mark.height"),
        ({"box": [0, 0, 10, 10], "start": 24}, "start"),
        ({"box": [0, 0, 10, 10], "frames": 25}, "frames"),
    ):
        body = session_request({"experiment": "ball", "upload": upload["id"], **wish})
        assert error_of(client.post("/api/v1/sessions", json=body), 422)["field"] == field
    assert client.delete(f"/api/v1/uploads/{upload['id']}").status_code == 204


def test_a_refused_body_leaves_nothing(server: Server, client: httpx.Client) -> None:
    """A file without a sequence of pictures is refused, and so is a body without a form and a file."""
    files = server.app.state.services.store.files
    before = len(list(files.uploads.iterdir()))
    answers = [send(client, ("video.mp4", content)) for content in (b"", b"hello", png(40), b"%PDF-1.4")]
    form = "multipart/form-data; boundary=XX"
    other_field = b'--XX\r\nContent-Disposition: form-data; name="x"\r\n\r\nabc\r\n--XX--\r\n'
    parts = (b"nonsense", b"", PART % (b"a", b"abc"), other_field, b"--XX\r\n" + b"A" * 100_000)
    for kind, body in [("text/plain", b"x"), ("multipart/form-data", b"x"), *((form, part) for part in parts)]:
        answers.append(client.post("/api/v1/uploads", content=body, headers={"content-type": kind}))
    for answer in answers:
        error_of(answer, 422 if answer.status_code == 422 else 400)
    assert (len(list(files.uploads.iterdir())), list(files.incoming.iterdir())) == (before, [])


def test_what_cannot_be_written(
    server: Server, client: httpx.Client, clip: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If the database fails, nothing of an upload is kept."""
    store = server.app.state.services.store
    before = list(store.files.uploads.iterdir())
    monkeypatch.setattr(store, "add", Mock(side_effect=OSError("on purpose")))
    assert send(client, ("ball.mp4", clip)).status_code >= 500
    assert (list(store.files.uploads.iterdir()), list(store.files.incoming.iterdir())) == (before, [])


def test_names(server: Server, client: httpx.Client, clip: bytes) -> None:
    """A name is only ever a title: what cannot be shown is removed, and no part of it becomes a path."""
    headers = {"content-type": "multipart/form-data; boundary=XX"}
    for name in ("../../../etc/passwd", "..\\..\\boot.ini", "a\0b.mp4", "y" * 500, "", "../../etc/only\u202ehere.mp4"):
        body = PART % (name.encode(), clip) + b"\r\n--XX--\r\n"
        upload = granted(client.post("/api/v1/uploads", content=body, headers=headers))
        shown = upload["name"]
        assert not {"/", "\\"} & set(shown)
        assert (shown.isprintable(), 0 < len(shown) <= 200) == (True, True)
        folder = server.app.state.services.store.files.uploads / upload["id"]
        assert sorted(path.name for path in folder.iterdir()) == ["content", "index.json"]
    assert shown == "onlyhere.mp4"
    assert "too long" in error_of(send(client, ("x" * 5000 + ".mp4", clip)), 400)["message"]


def test_bytes_files_pixels_and_frames(start_server: Any, clip: bytes) -> None:
    """Too many bytes are refused before any is read; so are too many files and too large or long recordings."""
    limits = {"max_upload_bytes": 1_000_000, "max_upload_files": 3, "max_pixels": SIZE[0] * SIZE[1]}
    with start_server(**limits, max_frames=24) as (server, client):
        with socket.create_connection(("127.0.0.1", server.port)) as raw:
            raw.sendall(HEAD % (BASE.encode(), 99_999_999_999))
            assert b" 413 " in raw.recv(4096)
        answer = send(client, *[(f"{number}.png", png(number)) for number in range(4)])
        assert "at most 3 files" in error_of(answer, 413)["message"]
        assert send(client, ("ball.mp4", clip)).status_code == 201
        error_of(send(client, ("long.mp4", video(25))), 422)
        error_of(send(client, *[(f"Picture {number}.png", png(number, (64, 49))) for number in range(2)]), 422)


def test_a_browser_that_vanishes(server: Server, client: httpx.Client, endless: Path) -> None:
    """If the browser disconnects during decoding, the process ends and nothing of the upload is left."""
    incoming, before = server.app.state.services.store.files.incoming, set(children())
    with pytest.raises(httpx.ReadTimeout):
        client.post("/api/v1/uploads", files={"file": ("a.gif", endless.read_bytes())}, timeout=(60, 0.5, 60, 60))
    wait_for(lambda: set(children()) <= before and not list(incoming.iterdir()))


def test_pictures_have_the_names_that_people_know(client: httpx.Client) -> None:
    """What is wrong with a picture is told by the name that it was sent with."""
    answer = send(client, ("Left eye 10.png", png(1)), ("Left eye 9.png", png(1)[:60]))
    message = error_of(answer, 422)["message"]
    assert "Left eye 9.png is broken or cut short" in message
    assert "000000" not in message
    answer = send(client, ("One.png", png(1)), ("Two.png", png(1, (32, 32))))
    assert "Two.png is 32 x 32 px and One.png is 64 x 48 px" in error_of(answer, 422)["message"]


BOUNDARY = b"----a boundary"


def body_of(files: Sequence[tuple[str, bytes]]) -> bytes:
    head = b'--%s\r\nContent-Disposition: form-data; name="file"; filename="%s"\r\nContent-Type: video/mp4\r\n\r\n'
    parts = [head % (BOUNDARY, name.encode()) + content + b"\r\n" for name, content in files]
    return b"".join(parts) + b"--" + BOUNDARY + b"--\r\n"


def taken(chunks: Sequence[bytes], *, most_bytes: int = 100_000, vanish: bool = False) -> tuple[Received, list[bytes]]:
    """Receive chunks into a folder that lives for as long as the call, and return what came."""
    waiting = list(chunks)

    async def next_chunk() -> Any:
        if waiting:
            return {"type": "http.request", "body": waiting.pop(0), "more_body": bool(waiting) or vanish}
        return {"type": "http.disconnect"}

    kind = b'multipart/form-data; boundary="' + BOUNDARY + b'"'
    request = Request({"type": "http", "method": "POST", "headers": [(b"content-type", kind)]}, next_chunk)
    with tempfile.TemporaryDirectory() as root:
        folder = Path(root) / "incoming"
        disk = DiskBudget(Path(root), 0)
        try:
            received = run(receive(request, folder, disk, most_bytes=most_bytes, most_files=10))
        except ApiError:
            assert not folder.exists(), "a refused upload leaves nothing"
            raise
        return received, [path.read_bytes() for path in received.paths]


names = st.text(st.characters(codec="ascii", categories=["L", "N"]), min_size=1, max_size=20)
files = st.lists(st.tuples(names, st.binary(max_size=300)), min_size=1, max_size=4)


@settings(max_examples=60, deadline=None)
@example(files=[("a", b"\r\n--" + BOUNDARY[:-1] + b"\r\n--\r\n" * 20)], cuts=[])
@given(files, st.lists(st.floats(0, 1), max_size=8))
def test_any_chunks(files: list[tuple[str, bytes]], cuts: list[float]) -> None:
    """However a body is cut, the same files come out, in order and to the byte, also what is nearly the boundary."""
    body = body_of(files)
    places = [0, *sorted(int(cut * len(body)) for cut in cuts), len(body)]
    received, contents = taken([body[a:b] for a, b in pairwise(places)])
    assert contents == [content for _, content in files]
    assert received.names == [name for name, _ in files]
    assert received.size_bytes == sum(len(content) for _, content in files)


FILLER = b"--" + BOUNDARY + b'\r\nContent-Disposition: form-data; name="x"\r\n\r\n' + b"y" * 200_000 + b"\r\n"


@pytest.mark.parametrize(
    ("body", "vanish", "words"),
    [
        (body_of([("a", b"x" * 5000)])[:4000], True, "at most"),
        (FILLER + body_of([("a", b"x")]), False, "at most"),
        (body_of([("a", b"x" * 100)])[:150], True, "broke"),
        (body_of([("a", b"x" * 100)])[:-30], False, "middle of a file"),
    ],
    ids=["too many", "in another field", "vanished", "cut off"],
)
def test_what_is_not_taken(body: bytes, vanish: bool, words: str) -> None:
    """The first byte too many ends it, though the rest never came, and so does a sender that stops."""
    with pytest.raises(ApiError, match=words):
        taken([body], most_bytes=3000, vanish=vanish)


def test_exactly_as_many() -> None:
    """The limit itself is allowed; a form without a file is refused by the name of the field."""
    assert taken([body_of([("a", b"x" * 3000)])], most_bytes=3000)[0].size_bytes == 3000
    with pytest.raises(RefusedError) as refusal:
        taken([b"--" + BOUNDARY + b"--\r\n"])
    assert refusal.value.field == "file"


def test_a_disk_that_fills_while_a_body_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Free space is checked repeatedly while a body arrives; on a full disk the upload is refused."""
    check = Mock(side_effect=[None, None, disk_full("no room")])
    monkeypatch.setattr(DiskBudget, "check", check)
    monkeypatch.setattr("pftrack_server.uploads.multipart.LOOK_BYTES", 1000)
    body = body_of([("a", b"x" * 5000)])
    with pytest.raises(ApiError, match="no room"):
        taken([body[at : at + 500] for at in range(0, len(body), 500)])
    assert check.call_count == 3
