"""The file of a recording of beliefs: a zip archive, `.pft`, whose first entry says what it is.

| entry | what it holds |
|---|---|
| `recording.json` | version, components, rate, the clip's name, its digest where it is elsewhere; the first |
| `times.npy` | (T,) time of each frame, s, where they were given |
| `clip` | the file of the clip as it is, where the beliefs are of one |
| `pictures/000012.jpg` | the picture of a frame, where they were given one by one |
| `chunks/000000/rows.npy` | (R, 9) int64: frame, target, whether it is a truth, and how many rows of each array |
| `chunks/000000/NAME.npy` | those rows of the arrays `particles`, `log_weights`, ..., one below the other |

Nothing is compressed, since particles are noise. Entries are written as they come, each whole before the next, and are
found by their own heads, not by the list at the archive's end: so a file can be read while it is written, and what a
loop has said before it broke off is there.
"""

import io
import math
import struct
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from tokenize import TokenError
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from pftrack.sources.formats import RECORDING_ENTRY
from pftrack.sources.limits import SourceError

VERSION = 1
ARRAYS: Mapping[str, str] = {
    "particles": "f4 or f8, (., d)",
    "log_weights": "f4 or f8, (.,)",
    "ancestors": "i4, (.,)",
    "mean": "f8, (., d)",
    "covariance": "f8, (., d, d)",
    "box": "f8, (., 5): x, y, w, h, score",
}
"""Of a chunk, in the order of the counts in its rows."""

COLUMNS = ("frame", "target", "truth", *ARRAYS)

HEAD = struct.Struct("<4sHHHHHIIIHH")
LOCAL = b"PK\x03\x04"
LONG = 0xFFFFFFFF
MOST_ENTRIES = 200_000
LONGEST_NAME = 200
DTYPES = {np.dtype(name) for name in ("<f4", "<f8", "<i4", "<i8")}


@dataclass(frozen=True, slots=True)
class Entry:
    """Where the content of an entry is in the file, bytes."""

    start: int
    size: int


def entries_of(file: BinaryIO) -> dict[str, Entry]:
    """Return all entries that are whole, by name.

    Raises:
        SourceError: It is no recording of beliefs, or has too many entries.
    """
    end = file.seek(0, io.SEEK_END)
    found: dict[str, Entry] = {}
    place = 0
    while place + HEAD.size <= end:
        file.seek(place)
        signature, _, flags, method, _, _, _, packed, size, name_length, extra_length = HEAD.unpack(
            file.read(HEAD.size)
        )
        if signature != LOCAL:
            break
        if method != zipfile.ZIP_STORED or name_length > LONGEST_NAME or flags & 0x9:
            raise SourceError("the recording was packed anew by another program; expected the file as it was written")
        name = file.read(name_length).decode("utf-8", "replace")
        extra = file.read(extra_length)
        if LONG in {packed, size}:
            packed = _long_size(extra)
        start = place + HEAD.size + name_length + extra_length
        if start + packed > end or packed == 0:
            break  # cut short, or being written
        found[name] = Entry(start, packed)
        if len(found) > MOST_ENTRIES:
            raise SourceError(f"the recording has more than {MOST_ENTRIES:,} entries")
        place = start + packed
    if next(iter(found), None) != RECORDING_ENTRY:
        raise SourceError("the file is no recording of beliefs, or was cut short at its beginning")
    return found


def _long_size(extra: bytes) -> int:
    """Return the size that a head of 32 bits has no room for."""
    place = 0
    while place + 4 <= len(extra):
        kind, length = struct.unpack_from("<HH", extra, place)
        if kind == 1 and length >= 16 and place + 20 <= len(extra):
            return int(struct.unpack_from("<Q", extra, place + 12)[0])
        place += 4 + length
    raise SourceError("the recording is damaged: an entry has no size")


def header_of(dtype: "np.dtype[np.generic]", shape: tuple[int, ...]) -> bytes:
    """Return what NumPy writes before the numbers of an array."""
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        buffer, {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
    )
    return buffer.getvalue()


@dataclass(frozen=True, slots=True)
class Stored:
    """Where the numbers of an array are in the file, and what they are."""

    start: int
    shape: tuple[int, ...]
    dtype: "np.dtype[np.generic]"


def shape_of(file: BinaryIO, entry: Entry) -> Stored:
    """Return what an entry that is an array says of itself.

    Raises:
        SourceError: It is none, or has not as many numbers as it says.
    """
    file.seek(entry.start)
    try:
        version = np.lib.format.read_magic(file)
        shape, fortran, dtype = np.lib.format.read_array_header_1_0(file)
    except (ValueError, SyntaxError, TypeError, EOFError, TokenError):
        raise SourceError("the recording is damaged: an entry is no array") from None
    start = file.tell()
    is_ours = version == (1, 0) and not fortran and dtype in DTYPES and len(shape) > 0 and min(shape) >= 0
    if not is_ours or dtype.itemsize * math.prod(shape) != entry.start + entry.size - start:
        raise SourceError("the recording is damaged: an array has not as many numbers as it says")
    return Stored(start, shape, dtype)


def read_array(file: BinaryIO, stored: Stored, first: int, count: int) -> NDArray[np.generic]:
    """Return some rows of an array."""
    inner = stored.shape[1:]
    row_bytes = int(stored.dtype.itemsize * np.prod(inner, dtype=np.int64))
    file.seek(stored.start + first * row_bytes)
    data = file.read(count * row_bytes)
    if len(data) != count * row_bytes:
        raise SourceError("the file has changed since it was opened")
    return np.frombuffer(data, stored.dtype).reshape(count, *inner)
