"""What a recording of beliefs says, at hand by frame and target, its particles read when they are asked for.

With it are the selection of a target and of components, what a recorder has gathered and not yet written, true targets,
and the clip that belongs to a recording.
"""

import hashlib
import io
import json
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePath
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.source import Belief, FrameIndex, FrameSequence
from pftrack.sources.beliefs.archive import ARRAYS, COLUMNS, VERSION, Entry, Stored, entries_of, read_array, shape_of
from pftrack.sources.formats import RECORDING_ENTRY, sniff
from pftrack.sources.limits import HEAD_BYTES, Limits, SourceError, check_bytes

LARGEST_ABOUT_BYTES = 1024 * 1024
LARGEST_FRAME = 10_000_000
LATEST_S, LEAST_STEP_S = 1e20, 1e-18
MOST_COMPONENTS = 400
MOST_ROWS = 500_000
"""Times that something is said of a target in a frame."""
MOST_PARTICLES = 1_000_000
"""Of a target in a frame."""
NAMES = tuple(ARRAYS)
FIRST_COUNT = len(COLUMNS) - len(NAMES)
INNER = {"particles": 1, "log_weights": 0, "ancestors": 0, "mean": 1, "covariance": 2, "box": 1}


@dataclass(frozen=True, slots=True)
class About:
    """What a recording says of itself.

    Attributes:
        components: Names of the states' components.
        units: Of the components, as far as they were given.
        frame_rate_hz: Of frames that have no times.
        clip: Name of the clip's file; empty without one.
        clip_sha256: Digest of its content where the clip is a file of its own; empty otherwise.
        remarks: What a person should know, a sentence each.
    """

    components: tuple[str, ...]
    units: tuple[str, ...]
    frame_rate_hz: float
    clip: str
    clip_sha256: str
    remarks: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Row:
    """Where what was said of a target in a frame is: for each array its place, first row and number of rows."""

    places: tuple[tuple[Stored, int, int] | None, ...]


class Content:
    """All that a file says.

    Attributes:
        about: What it says of itself.
        entries: Its entries by name.
        first: Number of the first frame of which something is said.
        last: Of the last.
        targets: (frames, ...) of each target of which something is believed, in the order in which they come.
        dimension: Components of a state; 0 where nothing but boxes is said.
    """

    def __init__(self, file: BinaryIO) -> None:
        """Read the index of a file, which stays open.

        Raises:
            SourceError: It is none, is damaged, or says nothing.
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
            raise SourceError("the recording says nothing of any frame yet")
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
            raise SourceError("the recording is damaged: its rows are none")
        self._rows += len(rows)
        if self._rows > MOST_ROWS:
            raise SourceError(f"the recording speaks of targets more than the {MOST_ROWS:,} times that are allowed")
        reached = dict.fromkeys(NAMES, 0)
        for row in rows.tolist():
            frame, target, is_truth, *counts = row
            if not 0 <= frame <= LARGEST_FRAME:
                raise SourceError(f"the recording has a frame {frame}")
            if max(counts) > MOST_PARTICLES:
                raise SourceError(f"frame {frame} has more than the {MOST_PARTICLES:,} particles that are allowed")
            places: list[tuple[Stored, int, int] | None] = []
            for name, count in zip(NAMES, counts, strict=True):
                places.append((stored[name], reached[name], count) if count and name in stored else None)
                reached[name] += count
            known = self._truths if is_truth else self._beliefs
            known.setdefault(frame, {})[target] = _Row(tuple(places))
            if not is_truth:
                self.targets.setdefault(target, []).append(frame)
        if any(reached[name] != (stored[name].shape[0] if name in stored else 0) for name in NAMES):
            raise SourceError("the recording is damaged: an array has not as many rows as its chunk says")

    def _stored_in(self, chunk: str) -> dict[str, Stored]:
        """Return where the arrays of a chunk are."""
        stored: dict[str, Stored] = {}
        for name in NAMES:
            if (entry := self.entries.get(f"{chunk}{name}.npy")) is None:
                continue
            stored[name] = found = shape_of(self._file, entry)
            inner = found.shape[1:]
            if len(inner) != INNER[name] or (name == "box" and inner != (5,)):
                raise SourceError(f"the recording is damaged: {name} have a shape of {found.shape}")
            if name in {"particles", "mean", "covariance"}:
                self.dimension = self.dimension or inner[0]
                if set(inner) != {self.dimension} or not 1 <= self.dimension <= MOST_COMPONENTS:
                    raise SourceError(
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
            raise SourceError("the recording is damaged: its times do not rise")
        return times

    def targets_in(self, frame: int) -> tuple[int, ...]:
        """Return the numbers of the targets of which something is believed in a frame, in rising order."""
        return tuple(sorted(self._beliefs.get(frame, ())))

    def true_targets_in(self, frame: int) -> tuple[int, ...]:
        """Return those of which something is true."""
        return tuple(sorted(self._truths.get(frame, ())))

    def belief(self, frame: int, target: int) -> Belief:
        """Return what is believed of a target in a frame."""
        return self._read(target, self._beliefs[frame][target])

    def truth(self, frame: int, target: int) -> Belief:
        """Return what is true of a target in a frame."""
        return self._read(target, self._truths[frame][target])

    def true_boxes(self) -> Iterator[tuple[int, tuple[float, ...]]]:
        """Yield (frame, (x, y, w, h)) of every box that is true, px."""
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
        """Whether anything but boxes is believed."""
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
        )


def _doubles(array: NDArray[Any] | None) -> Floats | None:
    return None if array is None else array.astype(np.float64)


def _about(file: BinaryIO, entry: Entry) -> About:
    if entry.size > LARGEST_ABOUT_BYTES:
        raise SourceError("the recording's description is larger than 1 MiB")
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
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
        raise SourceError("the recording is damaged: its description cannot be read") from None
    if version != VERSION:
        remedy = "update pftrack" if version > VERSION else "it is older than any release"
        raise SourceError(f"the recording is of version {version}, this pftrack reads version {VERSION}; {remedy}")
    if not 0.001 <= rate <= 100_000.0:
        raise SourceError(f"the recording has a rate of {rate:g} Hz; expected 0.001 to 100,000 Hz")
    return About(names, units, rate, clip, digest, remarks)


def _fits(counts: NDArray[Any]) -> bool:
    """Return whether rows have a weight and an ancestor for each particle or for none, and all else at most once."""
    particles, each, once = counts[:, :1], counts[:, 1:3], counts[:, 3:]
    return bool((counts >= 0).all() and ((each == 0) | (each == particles)).all() and (once <= 1).all())


GROUP = "Selection"


class SelectionParameters(Parameters):
    """What the run's estimate and error are of."""

    # fmt: off
    selected_target: int = parameter(
        -1, "Selected target", "Number of the target that is looked at, as the file has it; -1 for the one that is "
        "followed longest.",
        ge=-1, le=1_000_000, step=1, live=False, group=GROUP)
    component_across: int = parameter(
        0, "Component across", "Which component of the state is drawn across, from 0; the first of the estimate.",
        ge=0, le=399, step=1, live=False, group=GROUP)
    component_down: int = parameter(
        1, "Component down", "Which component of the state is drawn downwards, or upwards where there is no picture; "
        "the second of the estimate.",
        ge=0, le=399, step=1, live=False, group=GROUP)
    # fmt: on


# To ask the system for fresh memory costs several times what copying into it costs, so a few chunks go round: the loop
# fills one while others are written.

NOTHING = dict.fromkeys(ARRAYS, 0)
LEAST = 8 * 1024
"""Numbers for which a column has room at first."""


class Column:
    """The rows of one array, one below the other.

    Attributes:
        rows: How many there are.
    """

    def __init__(self, dtype: "np.dtype[Any]") -> None:
        self.rows = 0
        self._numbers: NDArray[Any] = np.empty(0, dtype)

    def append(self, array: NDArray[Any]) -> None:
        """Copy an array of one row or more, in this column's precision; all have rows of one shape."""
        begin = self.rows
        end = begin + len(array)
        if end > len(self._numbers):
            least = -(-LEAST * len(array) // max(array.size, 1))
            larger = np.empty((max(2 * len(self._numbers), end, least), *array.shape[1:]), self._numbers.dtype)
            if begin:
                larger[:begin] = self._numbers[:begin]
            self._numbers = larger
        self._numbers[begin:end] = array
        self.rows = end

    @property
    def array(self) -> NDArray[Any]:
        """All rows, a view until the column is cleared."""
        return self._numbers[: self.rows]

    def clear(self) -> None:
        """Begin anew, in the same memory."""
        self.rows = 0


class Chunk:
    """Rows of frames and targets, and the arrays that belong to them.

    Attributes:
        number: Of the chunk in its file.
        rows: Frame, target, whether it is a truth, and how many rows of each array.
        columns: The arrays by name.
        used: How many numbers it holds.
    """

    def __init__(self, precision: "np.dtype[Any]") -> None:
        """Make one that is empty.

        Args:
            precision: Of particles and their weights.
        """
        others = {"ancestors": np.dtype("<i4")}
        self.number = self.used = 0
        self.rows: list[tuple[int, ...]] = []
        self.columns = {
            name: Column(precision if name in {"particles", "log_weights"} else others.get(name, np.dtype("<f8")))
            for name in ARRAYS
        }

    def append(self, frame: int, target: int, said: Mapping[str, NDArray[Any]], *, is_truth: bool) -> None:
        """Copy what is said of a target in a frame: arrays by name, each of one row or more."""
        counts = dict(NOTHING)
        columns = self.columns
        for name, array in said.items():
            columns[name].append(array)
            counts[name] = len(array)
            self.used += array.size
        self.rows.append((frame, target, int(is_truth), *counts.values()))

    def clear(self) -> None:
        """Begin anew, in the same memory."""
        self.rows, self.used = [], 0
        for column in self.columns.values():
            column.clear()


# Which true target each number of a tracker stands for is told as CLEAR MOT has it (Bernardin and Stiefelhagen 2008): a
# pair of the frame before stays together as long as its boxes overlap by half; what is left is paired, the greatest
# overlap first (they take the greatest sum, which differs only where three boxes overlap each other by half). A true
# target that gets another number than the last one it had is an identity switch. Where there are no boxes, the distance
# of positions stands for the overlap.

LEAST_OVERLAP = 0.5


def overlap(one: Floats, other: Floats) -> float:
    """Return the intersection over the union of two boxes (x, y, w, h)."""
    low, high = np.maximum(one[:2], other[:2]), np.minimum(one[:2] + one[2:], other[:2] + other[2:])
    shared = float(np.maximum(high - low, 0.0).prod())
    return shared / float(one[2:].prod() + other[2:].prod() - shared)


@dataclass(frozen=True, slots=True)
class Identities:
    """What became of the numbers.

    Attributes:
        pairs: For each frame of which both something is believed and true, the true target of each number.
        switches: How many true targets have another number than before, by frame.
        first: The true target that each number stood for first.
    """

    pairs: Mapping[int, Mapping[int, int]]
    switches: Mapping[int, int]
    first: Mapping[int, int]


def pair_up(frames: Sequence[tuple[int, Sequence[Belief], Sequence[Belief]]]) -> Identities:
    """Pair numbers with true targets through all frames.

    Args:
        frames: Number of the frame, what is believed of its targets, and what is true; by ascending number.
    """
    pairs: dict[int, dict[int, int]] = {}
    switches: dict[int, int] = {}
    first: dict[int, int] = {}
    before: dict[int, int] = {}  # of each true target, the number that it had last
    last: dict[int, int] = {}  # pairs of the frame before
    for frame, beliefs, truths in frames:
        gains = np.array([[_likeness(one, true) for true in truths] for one in beliefs])
        gains = gains.reshape(len(beliefs), len(truths))
        numbers, trues = [one.target for one in beliefs], [true.target for true in truths]
        found = {
            number: true
            for number, true in last.items()
            if number in numbers and true in trues and gains[numbers.index(number), trues.index(true)] >= LEAST_OVERLAP
        }
        rows = [place for place, number in enumerate(numbers) if number not in found]
        columns = [place for place, true in enumerate(trues) if true not in found.values()]
        ranked = sorted((-float(gains[row, column]), row, column) for row in rows for column in columns)
        for loss, row, column in ranked:
            if -loss >= LEAST_OVERLAP and numbers[row] not in found and trues[column] not in found.values():
                found[numbers[row]] = trues[column]
        changed = sum(before.get(true, number) != number for number, true in found.items())
        if changed:
            switches[frame] = changed
        for number, true in found.items():
            before[true] = number
            first.setdefault(number, true)
        pairs[frame] = last = found
    return Identities(pairs, switches, first)


def _likeness(one: Belief, true: Belief) -> float:
    """Return how well a belief covers a truth, 0 to 1; with positions alone there is nothing but the one target."""
    if one.box is not None and true.box is not None:
        return overlap(one.box, true.box)
    return float(one.target == true.target)


# A path to a clip in a file is never followed: who opens a stranger's recording opens nothing else. Where a recording
# names its clip only, it is looked for under that name beside the recording, and taken if it has the content that is
# named.


def open_clip(file: BinaryIO, name: str, sha256: str, limits: Limits, index: FrameIndex | None = None) -> FrameSequence:
    """Return the pictures of a clip.

    Args:
        file: Open for reading; closed with the sequence.
        name: What people call it.
        sha256: Digest by which it is known.
        limits: How large it may be.
        index: From an earlier survey of the same content.

    Raises:
        SourceError: It is no video and no GIF, or exceeds the limits.
    """
    from pftrack.sources.video import VideoSequence  # noqa: PLC0415 - it loads decoders

    found = sniff(file.read(HEAD_BYTES))
    if found.kind not in {"video", "gif"}:
        raise SourceError("the clip of the recording is no video and no GIF")
    check_bytes(file.seek(0, io.SEEK_END), limits, "the clip has")
    file.seek(0)
    return VideoSequence(file, found, name=name, sha256=sha256, limits=limits, index=index)


def find_clip(
    file: BinaryIO, content: Content, given: Path | None, beside: Path | None, limits: Limits
) -> tuple[BinaryIO | None, str]:
    """Return the clip of a recording, open for reading; or None, and why there is none if there should be one.

    Args:
        file: The recording's.
        content: What it says.
        given: The clip, where somebody says which it is.
        beside: The folder of the recording, where a clip that is named only may be.
        limits: How large it may be.

    Raises:
        SourceError: It has a clip already, or the one that is given is another.
    """
    about = content.about
    if (entry := content.entries.get("clip")) is not None:
        if given is not None:
            raise SourceError(f"the recording has its clip in it, {about.clip or 'without a name'}; open it alone")
        return io.BufferedReader(_Part(file, entry)), ""
    if given is not None:
        if about.clip_sha256 and _digest_of(given, limits) != about.clip_sha256:
            raise SourceError(f"the clip is another one than {about.clip}, of which the recording is")
        return given.open("rb"), ""
    if not about.clip_sha256:
        return None, ""
    named = None if beside is None or PurePath(about.clip).name != about.clip else beside / about.clip
    if named is None or not named.is_file():
        absent = f"Its clip, {about.clip}, is not here, so there are no pictures"
        return None, f"{absent}; put it beside the recording, or give both together."
    if _digest_of(named, limits) != about.clip_sha256:
        return None, f"The file {about.clip} beside it is another clip than its own, so there are no pictures."
    return named.open("rb"), ""


def _digest_of(path: Path, limits: Limits) -> str:
    about = path.stat()
    check_bytes(about.st_size, limits, "the clip has")
    return _digest(path.absolute(), about.st_size, about.st_mtime_ns)


@lru_cache(64)
def _digest(path: Path, size: int, changed_ns: int) -> str:  # noqa: ARG001 - by which a file is known to be the same
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


class _Part(io.RawIOBase):
    """A part of a file as a file of its own, read by another descriptor so that it has a place of its own."""

    def __init__(self, file: BinaryIO, entry: Entry) -> None:
        self._file = Path(file.name).open("rb")  # noqa: SIM115 - closed with this
        self._entry, self._place = entry, 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        base = {io.SEEK_SET: 0, io.SEEK_CUR: self._place, io.SEEK_END: self._entry.size}[whence]
        self._place = max(base + offset, 0)
        return self._place

    def tell(self) -> int:
        return self._place

    def readinto(self, buffer: "memoryview[int]") -> int:  # type: ignore[override]  # any writable buffer
        room = min(len(buffer), max(self._entry.size - self._place, 0))
        self._file.seek(self._entry.start + self._place)
        count = self._file.readinto(memoryview(buffer)[:room])
        self._place += count
        return count

    def close(self) -> None:
        self._file.close()
        super().close()
