"""Taking a multipart body from the wire, however it is cut into chunks."""

import tempfile
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from starlette.requests import Request

from pftrack.core.refusal import RefusedError
from pftrack_server.core.errors import ApiError, disk_full
from pftrack_server.store.disk_budget import DiskBudget
from pftrack_server.uploads.multipart import Received, receive
from tests.apart import run

BOUNDARY = b"----a boundary"


def body_of(files: Sequence[tuple[str, bytes]]) -> bytes:
    head = (
        b'--%s\r\nContent-Disposition: form-data; name="file"; filename="%s"\r\nContent-Type: application/octet-stream'
    )
    parts = [head % (BOUNDARY, name.encode()) + b"\r\n\r\n" + content + b"\r\n" for name, content in files]
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
        try:
            disk = DiskBudget(Path(root), 0)
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
    chunks = [body[a:b] for a, b in pairwise(places)]
    received, contents = taken(chunks)
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
    """As many bytes as are allowed are allowed; a form without a file is refused by the name of the field."""
    assert taken([body_of([("a", b"x" * 3000)])], most_bytes=3000)[0].size_bytes == 3000
    with pytest.raises(RefusedError) as refusal:
        taken([b"--" + BOUNDARY + b"--\r\n"])
    assert refusal.value.field == "file"


def test_a_disk_that_fills_while_a_body_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Room on the disk is checked again and again while a body comes; an upload that meets a full disk is refused."""
    checks: list[int] = []

    def check(_: DiskBudget, wanted_bytes: int = 0) -> None:
        checks.append(wanted_bytes)
        if len(checks) == 3:
            raise disk_full("no room")

    monkeypatch.setattr(DiskBudget, "check", check)
    monkeypatch.setattr("pftrack_server.uploads.multipart.LOOK_BYTES", 1000)
    body = body_of([("a", b"x" * 5000)])
    with pytest.raises(ApiError, match="no room"):
        taken([body[at : at + 500] for at in range(0, len(body), 500)])
    assert len(checks) == 3
