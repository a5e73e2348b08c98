"""Uploading: a multipart body written to disk while it arrives, and cut off as soon as it is too large.

FastAPI's own form parser keeps a whole upload before anybody can say no, so the parts are taken from the wire here. A
part's file name is only ever a title and an order; what a file is called on disk is made up by the server. A file is
open only while a piece of it is written: those who send slowly would have one each, and a process has only so many.
"""

import asyncio
import re
import shutil
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from fastapi import Request
from python_multipart.exceptions import MultipartParseError
from python_multipart.multipart import MultipartParser, parse_options_header
from starlette.requests import ClientDisconnect

from pftrack.core.refusal import RefusedError
from pftrack_server.core.bodies import printable
from pftrack_server.core.errors import ApiError, too_large
from pftrack_server.core.resource_limits import mebibytes
from pftrack_server.store.disk_budget import DiskBudget

LONGEST_NAME = 200
# So often the room on the disk is looked at while a body comes, which others may use up meanwhile.
LOOK_BYTES = 4 * 1024 * 1024
LONGEST_HEADER = 4096
LONGEST_BOUNDARY = 70
"""By RFC 2046, section 5.1.1."""
# Boundaries and headers of the parts are not part of what somebody wants to keep.
OVERHEAD_BYTES = 64 * 1024
OVERHEAD_BYTES_A_FILE = 1024


@dataclass
class Received:
    """The files received, in the order of arrival, with the names that the client gave them."""

    paths: list[Path] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    size_bytes: int = 0


async def receive(request: Request, folder: Path, room: DiskBudget, *, most_bytes: int, most_files: int) -> Received:
    """Write the files of a multipart request's field `file` into a folder, made for them; on failure it is removed.

    Raises:
        ApiError: More bytes or files than allowed came, or are announced (413); there is not as much room on the disk
            (507).
        RefusedError: It has no file.
    """
    kind, options = parse_options_header(request.headers.get("content-type"))
    boundary = options.get(b"boundary")
    if kind != b"multipart/form-data" or not boundary:
        raise ApiError("Send the file as multipart/form-data in a field named file")
    if len(boundary) > LONGEST_BOUNDARY:
        raise ApiError(f"The boundary of multipart/form-data may have at most {LONGEST_BOUNDARY} characters")
    announced = request.headers.get("content-length", "")
    overhead = OVERHEAD_BYTES + OVERHEAD_BYTES_A_FILE * most_files
    if announced.isdecimal() and int(announced) > most_bytes + overhead:
        raise too_large(_too_large(most_bytes))
    await asyncio.to_thread(room.check, int(announced) if announced.isdecimal() else 0)
    await asyncio.to_thread(folder.mkdir, mode=0o700)
    parts = _Parts(folder, most_bytes, most_files)
    try:
        parser = MultipartParser(boundary, parts.callbacks(), max_header_size=LONGEST_HEADER)  # type: ignore[arg-type]  # its own table
        await _read(request, parser, parts, room, most_bytes + overhead)
    except BaseException:
        parts.close()
        await asyncio.to_thread(shutil.rmtree, folder, ignore_errors=True)
        raise
    return parts.received


async def _read(request: Request, parser: MultipartParser, parts: "_Parts", room: DiskBudget, most_bytes: int) -> None:
    total = looked = 0
    try:
        async for chunk in request.stream():
            total += len(chunk)
            if total > most_bytes:
                raise too_large(_too_large(parts.most_bytes))
            if total - looked > LOOK_BYTES:
                looked = total
                await asyncio.to_thread(room.check)
            if chunk:
                await asyncio.to_thread(_write, parser, parts, chunk)
        parser.finalize()
    except ClientDisconnect:
        raise ApiError("The connection broke during the upload") from None
    except MultipartParseError:
        raise ApiError("The request is not valid multipart/form-data, or a file's name is too long") from None
    if parts.open:
        raise ApiError("The request ended in the middle of a file")
    if not parts.received.paths:
        raise RefusedError("The request has no file; send it in a field named file", field="file")


def _write(parser: MultipartParser, parts: "_Parts", chunk: bytes) -> None:
    parser.write(chunk)
    parts.close()


def _too_large(most_bytes: int) -> str:
    return f"An upload may have at most {mebibytes(most_bytes)}"


class _Parts:
    """Takes the parser's callbacks and writes the files."""

    def __init__(self, folder: Path, most_bytes: int, most_files: int) -> None:
        self.received = Received()
        self.most_bytes = most_bytes
        self._most_files = most_files
        self._folder = folder
        self._path: Path | None = None
        self._file: IO[bytes] | None = None
        self._name, self._value = b"", b""
        self._disposition = b""

    @property
    def open(self) -> bool:
        """Whether a file has begun and not ended."""
        return self._path is not None

    def callbacks(self) -> dict[str, Any]:
        """Return what the parser calls, each by its name there."""
        return {name: getattr(self, name) for name in dir(self) if name.startswith("on_")}

    def close(self) -> None:
        """Let go of the current file until more of it comes."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def on_part_end(self) -> None:
        """Let go of a part."""
        self.close()
        self._path = None

    def on_part_begin(self) -> None:
        """Forget the headers of the part before."""
        self._name = self._value = self._disposition = b""

    def on_header_field(self, data: bytes, start: int, end: int) -> None:
        """Take a piece of the name of a header."""
        self._name += data[start:end]

    def on_header_value(self, data: bytes, start: int, end: int) -> None:
        """Take a piece of the value of a header."""
        self._value += data[start:end]

    def on_header_end(self) -> None:
        """Keep a header that names the file."""
        if self._name.lower() == b"content-disposition":
            self._disposition = self._value
        self._name = self._value = b""

    def on_headers_finished(self) -> None:
        """Begin a file, if the part is one."""
        _, options = parse_options_header(self._disposition)
        # Other fields are read over; they count towards the size all the same.
        if options.get(b"name") != b"file" or b"filename" not in options:
            return
        number = len(self.received.paths)
        if number >= self._most_files:
            raise too_large(f"An upload may have at most {self._most_files} files")
        self._path = self._folder / f"{number:06d}"
        self._path.touch()
        self.received.paths.append(self._path)
        self.received.names.append(_title(options[b"filename"]))

    def on_part_data(self, data: bytes, start: int, end: int) -> None:
        """Write a piece of a file."""
        if self._path is None:
            return
        self.received.size_bytes += end - start
        if self.received.size_bytes > self.most_bytes:
            raise too_large(_too_large(self.most_bytes))
        if self._file is None:
            self._file = self._path.open("ab")
        self._file.write(memoryview(data)[start:end])


def _title(raw: bytes) -> str:
    """Return what may be shown of a file's name: its last part, without what does not print."""
    text = re.split(r"[/\\]", raw.decode("utf-8", "replace"))[-1]
    return printable(text)[:LONGEST_NAME] or "unnamed"
