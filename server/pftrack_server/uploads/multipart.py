"""Uploading: a multipart body is written to disk while it arrives, and refused as soon as it is too large.

FastAPI's own form parser stores a whole upload before it can be refused, so this module reads the parts from the wire.
A part's file name serves only as a title and for the order; the server makes the name on disk. A file is open only
while a piece of it is written: otherwise many slow clients would use up the open files of the process.
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
# How often the free disk space is checked while a body arrives; others may use it up meanwhile.
LOOK_BYTES = 4 * 1024 * 1024
LONGEST_HEADER = 4096
LONGEST_BOUNDARY = 70
"""Longest boundary (RFC 2046, section 5.1.1)."""
# Boundaries and headers of the parts do not count as content.
OVERHEAD_BYTES = 64 * 1024
OVERHEAD_BYTES_A_FILE = 1024


@dataclass
class Received:
    """The received files in order of arrival, with the names given by the client."""

    paths: list[Path] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    size_bytes: int = 0


async def receive(request: Request, folder: Path, room: DiskBudget, *, most_bytes: int, most_files: int) -> Received:
    """Write the files of a multipart request's field `file` into a new folder; on failure, remove it.

    Raises:
        ApiError: More bytes or files than allowed arrived or were announced (413); the disk has too little room (507).
        RefusedError: The request has no file.
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
    """Receives the parser's callbacks and writes the files."""

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
        """Whether a file has begun and has not ended."""
        return self._path is not None

    def callbacks(self) -> dict[str, Any]:
        """Return the callbacks by the parser's names."""
        return {name: getattr(self, name) for name in dir(self) if name.startswith("on_")}

    def close(self) -> None:
        """Close the current file until its next piece arrives."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def on_part_end(self) -> None:
        """End a part."""
        self.close()
        self._path = None

    def on_part_begin(self) -> None:
        """Forget the headers of the previous part."""
        self._name = self._value = self._disposition = b""

    def on_header_field(self, data: bytes, start: int, end: int) -> None:
        """Take a piece of a header's name."""
        self._name += data[start:end]

    def on_header_value(self, data: bytes, start: int, end: int) -> None:
        """Take a piece of a header's value."""
        self._value += data[start:end]

    def on_header_end(self) -> None:
        """Keep a header that names the file."""
        if self._name.lower() == b"content-disposition":
            self._disposition = self._value
        self._name = self._value = b""

    def on_headers_finished(self) -> None:
        """Begin a file, if the part is one."""
        _, options = parse_options_header(self._disposition)
        # Other fields are skipped, but count towards the size.
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
    """Return the printable last part of a file's name."""
    text = re.split(r"[/\\]", raw.decode("utf-8", "replace"))[-1]
    return printable(text)[:LONGEST_NAME] or "unnamed"
