"""Reliable files and tables: written completely, safe in a spreadsheet; keys of pictures; warnings given once.

A file is written under a hidden temporary name in its folder, flushed to the disk, and only then renamed. So a reader
sees the old content or the new one, even after a crash.
"""

import csv
import io
import logging
import os
import re
import secrets
import shutil
import threading
from collections.abc import Iterable
from importlib.util import decode_source
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pftrack.core.refusal import RefusedError


def free_bytes(folder: Path) -> int:
    """Return the bytes that this user can still write to the disk of a folder.

    Raises:
        OSError: The folder does not exist.
    """
    return shutil.disk_usage(folder).free


def part_of(path: Path) -> Path:
    """Return a new hidden name next to a path for writing its content.

    It is absolute: FFmpeg and Arrow take a relative name with a colon for an address.
    """
    return path.absolute().with_name(f".{path.name}.{secrets.token_hex(4)}.part")


def settle(part: Path, path: Path) -> None:
    """Bring a file that is written completely to the disk and to its place, where it replaces what was there.

    Raises:
        OSError: That cannot be done; what was at its place is still there.
    """
    with part.open("rb") as file:
        os.fsync(file.fileno())
    part.replace(path)


def write_whole(path: Path, data: bytes) -> None:
    """Write a file atomically.

    Raises:
        OSError: It cannot be written; what was there before is still there, and nothing beside it.
    """
    part = part_of(path)
    try:
        part.write_bytes(data)
        settle(part, path)
    finally:
        part.unlink(missing_ok=True)


def read_text(path: Path, most_bytes: int) -> str:
    """Return the text of a file, UTF-8 with or without a mark of byte order.

    Raises:
        ValueError: It is not there, too large, not to be read, or not UTF-8 text; a sentence says which.
    """
    try:
        if path.stat().st_size > most_bytes:
            raise ValueError(f"{path.name} is larger than the {most_bytes // 1024:,} KiB allowed")
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise ValueError(f"the file {path} does not exist") from None
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ValueError(f"{path.name} is not a UTF-8 text file") from None


# Names in tables come from files of anybody. A spreadsheet treats a cell that begins with one of a few characters as a
# formula, which may contact other machines and read other cells. So such a text gets an apostrophe in front: a
# spreadsheet hides it, other programs show it. Numbers stay as they are, whatever their sign.

BEGINNING: Final = re.compile(r"(^\s*|[;\t\r\n])(?=[=+\-@＝＋－＠])")  # noqa: RUF001 - wide forms stand for the others
"""Start of a formula: at the start of a cell, or where a spreadsheet of another language splits it."""
FIGURE: Final = r"[-+]?[\d.,]+(?:e[-+]?\d+)?"
NUMBERS: Final = re.compile(rf"(?:{FIGURE}|[-+]?(?:inf|nan))(?: \({FIGURE} to {FIGURE}\))?")
"""A number, and one with its interval."""


def read_source(path: Path) -> str:
    """Return the text of a file of Python as Python reads it: by its byte order mark or its coding comment.

    Raises:
        OSError: It cannot be read.
        RefusedError: It is not text in the stated encoding.
    """
    try:
        return decode_source(path.read_bytes())
    except (SyntaxError, UnicodeDecodeError) as error:
        raise RefusedError(f"{path.name} cannot be read as Python: {error}") from None


def literal(text: str) -> str:
    """Return the text of a cell that every spreadsheet shows unchanged."""
    return text if NUMBERS.fullmatch(text) else BEGINNING.sub(r"\1'", text)


def csv_text(rows: Iterable[Iterable[str]]) -> str:
    """Return rows of cells as CSV, quoted where needed."""
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows([literal(cell) for cell in row] for row in rows)
    return file.getvalue()


# A frame is first tracked and then drawn, and both need the same values computed from its picture, so pictures are keys
# of caches.


class PictureKey:
    """A picture as a key, equal only to itself. While it is kept, no other object has its identity.

    A picture that may be written should not be kept so: it may become another.
    """

    def __init__(self, image_rgb: NDArray[np.uint8]) -> None:
        self.image_rgb = image_rgb

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PictureKey) and other.image_rgb is self.image_rgb

    def __hash__(self) -> int:
        return id(self.image_rgb)


# An error in one frame usually repeats in all later frames.

logger = logging.getLogger(__name__)

_warned: set[str] = set()
_lock = threading.Lock()


def warn_once(about: str, message: str, error: Exception | None = None) -> None:
    """Log a warning, unless there was one about the same in this process.

    Args:
        about: Its subject; further warnings on the same subject are suppressed.
        message: The warning, a sentence.
        error: The exception; the log then shows its place.
    """
    with _lock:
        if about in _warned:
            return
        _warned.add(about)
    logger.warning(message, exc_info=error)
