"""The content of a recording of beliefs, by frame and target; particles are read on demand.

It is a zip archive, `.pft`, whose first entry describes it.

| entry | what it holds |
|---|---|
| `recording.json` | version, components, rate, the clip's name, its digest where it is elsewhere; the first |
| `times.npy` | (T,) time of each frame, s, where they were given |
| `clip` | the unchanged file of the clip, where the beliefs belong to one |
| `pictures/000012.jpg` | the picture of a frame, where they were given one by one |
| `chunks/000000/rows.npy` | (R, 9) int64: frame, target, whether it is a truth, and how many rows of each array |
| `chunks/000000/NAME.npy` | those rows of the arrays `particles`, `log_weights`, ..., one below the other |

Nothing is compressed, since particles are noise. Entries are written in order, each complete before the next, and are
found by their own headers, not by the list at the archive's end. So a file can be read while it is written, and keeps
the records of a loop that broke off.
"""

import io
import json
import math
import struct
import threading
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from tokenize import TokenError
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.source import Belief
from pftrack.core.refusal import RefusedError
from pftrack.sources.formats import RECORDING_ENTRY

VERSION = 1
ARRAYS: Mapping[str, str] = {
    "particles": "f4 or f8, (., d)",
    "log_weights": "f4 or f8, (.,)",
    "ancestors": "i4, (.,)",
    "mean": "f8, (., d)",
    "covariance": "f8, (., d, d)",
    "box": "f8, (., 5): x, y, w, h, score",
}
"""Arrays of a chunk, in the order of the counts in its rows."""

COLUMNS = ("frame", "target", "truth", *ARRAYS)

HEAD = struct.Struct("<4sHHHHHIIIHH")
LOCAL = b"PK\x03\x04"
LONG = 0xFFFFFFFF
MOST_ENTRIES = 200_000
LONGEST_NAME = 200
DTYPES = {np.dtype(name) for name in ("<f4", "<f8", "<i4", "<i8")}


@dataclass(frozen=True, slots=True)
class Entry:
    """Location of an entry's content in the file, bytes."""

    start: int
    size: int


def entries_of(file: BinaryIO) -> dict[str, Entry]:
    """Return all entries that are whole, by name.

    Raises:
        RefusedError: It is not a recording of beliefs, or has too many entries.
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
            raise RefusedError("the recording was packed anew by another program; expected the file as it was written")
        name = file.read(name_length).decode("utf-8", "replace")
        extra = file.read(extra_length)
        if LONG in {packed, size}:
            packed = _long_size(extra)
        start = place + HEAD.size + name_length + extra_length
        if start + packed > end or packed == 0:
            break  # cut short, or being written
        found[name] = Entry(start, packed)
        if len(found) > MOST_ENTRIES:
            raise RefusedError(f"the recording has more than {MOST_ENTRIES:,} entries")
        place = start + packed
    if next(iter(found), None) != RECORDING_ENTRY:
        raise RefusedError("the file is not a recording of beliefs, or was cut short at its beginning")
    return found


def _long_size(extra: bytes) -> int:
    """Return a size that does not fit into a header of 32 bits."""
    place = 0
    while place + 4 <= len(extra):
        kind, length = struct.unpack_from("<HH", extra, place)
        if kind == 1 and length >= 16 and place + 20 <= len(extra):
            return int(struct.unpack_from("<Q", extra, place + 12)[0])
        place += 4 + length
    raise RefusedError("the recording is damaged: an entry has no size")


def header_of(dtype: "np.dtype[np.generic]", shape: tuple[int, ...]) -> bytes:
    """Return what NumPy writes before the numbers of an array."""
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        buffer, {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
    )
    return buffer.getvalue()


@dataclass(frozen=True, slots=True)
class Stored:
    """Location and type of an array's numbers in the file."""

    start: int
    shape: tuple[int, ...]
    dtype: "np.dtype[np.generic]"


def shape_of(file: BinaryIO, entry: Entry) -> Stored:
    """Return the header of an entry that is an array.

    Raises:
        RefusedError: It is not an array, or its length differs from its header.
    """
    file.seek(entry.start)
    try:
        version = np.lib.format.read_magic(file)
        shape, fortran, dtype = np.lib.format.read_array_header_1_0(file)
    except (ValueError, SyntaxError, TypeError, EOFError, TokenError):
        raise RefusedError("the recording is damaged: an entry is not an array") from None
    start = file.tell()
    is_ours = version == (1, 0) and not fortran and dtype in DTYPES and len(shape) > 0 and min(shape) >= 0
    if not is_ours or dtype.itemsize * math.prod(shape) != entry.start + entry.size - start:
        raise RefusedError("the recording is damaged: the length of an array differs from its header")
    return Stored(start, shape, dtype)


def read_array(file: BinaryIO, stored: Stored, first: int, count: int) -> NDArray[np.generic]:
    """Return some rows of an array."""
    inner = stored.shape[1:]
    row_bytes = int(stored.dtype.itemsize * np.prod(inner, dtype=np.int64))
    file.seek(stored.start + first * row_bytes)
    data = file.read(count * row_bytes)
    if len(data) != count * row_bytes:
        raise RefusedError("the file has changed since it was opened")
    return np.frombuffer(data, stored.dtype).reshape(count, *inner)


LARGEST_ABOUT_BYTES = 1024 * 1024
LARGEST_FRAME = 10_000_000
LATEST_S, LEAST_STEP_S = 1e20, 1e-18
MOST_COMPONENTS = 400
MOST_ROWS = 500_000
"""Largest number of rows, each for one target in one frame."""
MOST_PARTICLES = 1_000_000
"""Values of a target in a frame."""
NAMES = tuple(ARRAYS)
FIRST_COUNT = len(COLUMNS) - len(NAMES)
INNER = {"particles": 1, "log_weights": 0, "ancestors": 0, "mean": 1, "covariance": 2, "box": 1}


@dataclass(frozen=True, slots=True)
class About:
    """The description of a recording.

    Attributes:
        components: Names of the states' components.
        units: Units of the components, as far as they were given.
        frame_rate_hz: Frame rate of frames without times.
        clip: Name of the clip's file; empty without one.
        clip_sha256: Digest of its content where the clip is a separate file; empty otherwise.
        remarks: Remarks for users, a sentence each.
        frames: Number of frames, including frames without a belief; 0 if unknown.
        labels: Names of targets, by number.
    """

    components: tuple[str, ...]
    units: tuple[str, ...]
    frame_rate_hz: float
    clip: str
    clip_sha256: str
    remarks: tuple[str, ...]
    frames: int
    labels: Mapping[int, str]


@dataclass(frozen=True, slots=True)
class _Row:
    """Location of the values of a target in a frame: for each array its place, first row and number of rows."""

    places: tuple[tuple[Stored, int, int] | None, ...]


class Content:
    """The content of a file.

    Attributes:
        about: Its description.
        entries: Its entries by name.
        first: Number of the first frame with a record.
        last: Number of the last one.
        targets: (frames, ...) of each target with a belief, in order of appearance.
        dimension: Components of a state; 0 if the file has only boxes.
    """

    def __init__(self, file: BinaryIO) -> None:
        """Read the index of a file, which stays open.

        Raises:
            RefusedError: It is not a recording, is damaged, or is empty.
        """
        self._file, self._lock = file, threading.Lock()
        self.entries = entries_of(file)
        self.about = _about(file, self.entries[RECORDING_ENTRY])
        self._beliefs: dict[int, dict[int, _Row]] = {}
        self._truths: dict[int, dict[int, _Row]] = {}
        self.targets: dict[int, list[int]] = {}
        self.dimension = self._rows = 0
        for number in range(len(self.entries)):
            if f"chunks/{number:06d}/rows.npy" not in self.entries:
                break
            self._take_in(f"chunks/{number:06d}/")
        frames = (self._beliefs or self._truths).keys()
        if not frames:
            raise RefusedError("the recording has no record of a frame yet")
        self.first, self.last = min(frames), max(frames)

    def _take_in(self, chunk: str) -> None:
        stored = self._stored_in(chunk)
        rows = self._whole(f"{chunk}rows.npy")
        if (
            rows.ndim != 2
            or rows.shape[1] != len(COLUMNS)
            or rows.dtype.kind != "i"
            or not _fits(rows[:, FIRST_COUNT:])
        ):
            raise RefusedError("the recording is damaged: its rows cannot be read")
        self._rows += len(rows)
        if self._rows > MOST_ROWS:
            raise RefusedError(f"the recording speaks of targets more than the {MOST_ROWS:,} times that are allowed")
        reached = dict.fromkeys(NAMES, 0)
        for row in rows.tolist():
            frame, target, is_truth, *counts = row
            if not 0 <= frame <= LARGEST_FRAME:
                raise RefusedError(f"the recording has a frame {frame}")
            if max(counts) > MOST_PARTICLES:
                raise RefusedError(f"frame {frame} has more than the {MOST_PARTICLES:,} particles that are allowed")
            places: list[tuple[Stored, int, int] | None] = []
            for name, count in zip(NAMES, counts, strict=True):
                places.append((stored[name], reached[name], count) if count and name in stored else None)
                reached[name] += count
            known = self._truths if is_truth else self._beliefs
            known.setdefault(frame, {})[target] = _Row(tuple(places))
            if not is_truth:
                self.targets.setdefault(target, []).append(frame)
        if any(reached[name] != (stored[name].shape[0] if name in stored else 0) for name in NAMES):
            raise RefusedError("the recording is damaged: the rows of an array differ from the count in its chunk")

    def _stored_in(self, chunk: str) -> dict[str, Stored]:
        """Return where the arrays of a chunk are."""
        stored: dict[str, Stored] = {}
        for name in NAMES:
            if (entry := self.entries.get(f"{chunk}{name}.npy")) is None:
                continue
            stored[name] = found = shape_of(self._file, entry)
            inner = found.shape[1:]
            if len(inner) != INNER[name] or (name == "box" and inner != (5,)):
                raise RefusedError(f"the recording is damaged: {name} have a shape of {found.shape}")
            if name in {"particles", "mean", "covariance"}:
                self.dimension = self.dimension or inner[0]
                if set(inner) != {self.dimension} or not 1 <= self.dimension <= MOST_COMPONENTS:
                    raise RefusedError(
                        f"the recording is damaged: all states must have the same 1 to {MOST_COMPONENTS} components, "
                        f"got {name} of shape {found.shape}"
                    )
        return stored

    def _whole(self, name: str) -> NDArray[Any]:
        stored = shape_of(self._file, self.entries[name])
        return read_array(self._file, stored, 0, stored.shape[0])

    def bytes_of(self, name: str) -> bytes:
        """Return the content of an entry."""
        entry = self.entries[name]
        with self._lock:
            self._file.seek(entry.start)
            return self._file.read(entry.size)

    @property
    def times_s(self) -> Floats | None:
        """Times of all frames, as they were given."""
        if "times.npy" not in self.entries:
            return None
        times = self._whole("times.npy").astype(np.float64)
        bounded = times.ndim == 1 and len(times) > 0 and (np.abs(times) <= LATEST_S).all()
        if not bounded or (np.diff(times) < LEAST_STEP_S).any():
            raise RefusedError("the recording is damaged: its times do not rise")
        return times

    def targets_in(self, frame: int) -> tuple[int, ...]:
        """Return the numbers of the targets with a belief in a frame, in rising order."""
        return tuple(sorted(self._beliefs.get(frame, ())))

    def true_targets_in(self, frame: int) -> tuple[int, ...]:
        """Return the numbers of the targets with a truth."""
        return tuple(sorted(self._truths.get(frame, ())))

    def belief(self, frame: int, target: int) -> Belief:
        """Return the belief in a target in a frame."""
        return self._read(target, self._beliefs[frame][target])

    def truth(self, frame: int, target: int) -> Belief:
        """Return what is true of a target in a frame."""
        return self._read(target, self._truths[frame][target])

    def true_boxes(self) -> Iterator[tuple[int, tuple[float, ...]]]:
        """Yield (frame, (x, y, w, h)) of every true box, px."""
        place_of_box, known = NAMES.index("box"), {}
        for frame, targets in self._truths.items():
            for row in targets.values():
                if (place := row.places[place_of_box]) is not None:
                    stored, start, _ = place
                    if id(stored) not in known:  # all boxes of a chunk at once
                        with self._lock:
                            known[id(stored)] = read_array(self._file, stored, 0, stored.shape[0])
                    yield frame, tuple(known[id(stored)][start, :4].tolist())

    @property
    def has_truth(self) -> bool:
        """Whether anything is true of any frame."""
        return bool(self._truths)

    @property
    def has_states(self) -> bool:
        """Whether there are beliefs other than boxes."""
        return self.dimension > 0

    def _read(self, target: int, row: _Row) -> Belief:
        arrays: dict[str, Any] = {}
        with self._lock:
            for name, place in zip(NAMES, row.places, strict=True):
                if place is not None:
                    arrays[name] = read_array(self._file, *place)
        box = arrays["box"][0] if "box" in arrays else None
        return Belief(
            target,
            particles=_doubles(arrays.get("particles")),
            log_weights=_doubles(arrays.get("log_weights")),
            ancestors=None if "ancestors" not in arrays else arrays["ancestors"].astype(np.int64),
            mean=None if "mean" not in arrays else arrays["mean"][0].copy(),
            covariance=None if "covariance" not in arrays else arrays["covariance"][0].copy(),
            box=None if box is None else box[:4].copy(),
            score=float("nan") if box is None else float(box[4]),
            label=self.about.labels.get(target, ""),
        )


def _doubles(array: NDArray[Any] | None) -> Floats | None:
    return None if array is None else array.astype(np.float64)


def _about(file: BinaryIO, entry: Entry) -> About:
    if entry.size > LARGEST_ABOUT_BYTES:
        raise RefusedError("the recording's description is larger than 1 MiB")
    file.seek(entry.start)
    try:
        raw: Mapping[str, Any] = json.loads(file.read(entry.size))
        version = int(raw["version"])
        rate = float(raw["frame_rate_hz"])
        names = tuple(str(name)[:40] for name in raw["components"][:MOST_COMPONENTS])
        units = tuple(str(unit)[:20] for unit in raw.get("units", ())[:MOST_COMPONENTS])
        clip = str(raw["clip"] or "")[:200]
        digest = str(raw.get("clip_sha256") or "")[:64]
        remarks = tuple(str(one)[:400] for one in raw["remarks"][:20])
        frames = int(raw.get("frames", 0))
        labels = {int(target): str(label)[:80] for target, label in dict(raw.get("labels", {})).items()}
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
        raise RefusedError("the recording is damaged: its description cannot be read") from None
    if version != VERSION:
        remedy = "update pftrack" if version > VERSION else "it is older than any release"
        raise RefusedError(f"the recording is of version {version}, this pftrack reads version {VERSION}; {remedy}")
    if not 0.001 <= rate <= 100_000.0:
        raise RefusedError(f"the recording has a rate of {rate:g} Hz; expected 0.001 to 100,000 Hz")
    return About(names, units, rate, clip, digest, remarks, frames, labels)


def _fits(counts: NDArray[Any]) -> bool:
    """Return whether rows have a weight and an ancestor for each particle or for none, and all else at most once."""
    particles, each, once = counts[:, :1], counts[:, 1:3], counts[:, 3:]
    return bool((counts >= 0).all() and ((each == 0) | (each == particles)).all() and (once <= 1).all())


GROUP = "Selection"


class SelectionParameters(Parameters, group=GROUP):
    """The target and components of the run's estimate and error."""

    selected_target: int = parameter(-1, "Selected target", within=(-1, 1_000_000, 1), useful=(-1, 60), live=False)
    """Number of the target to show, as in the file; -1 for the one that is followed longest."""
    component_across: int = parameter(0, "Component across", within=(0, 399, 1), useful=(0, 20), live=False)
    """Component of the state drawn across, from 0; the first one of the estimate."""
    component_down: int = parameter(1, "Component down", within=(0, 399, 1), useful=(0, 20), live=False)
    """Component of the state drawn downwards, or upwards without a picture; the second one of the estimate."""
