"""The recorder: writes the beliefs of a running loop to a file, at almost no cost to the loop.

A call checks shapes, copies the numbers, particles in single precision, and returns. A separate thread writes them,
since packing and writing hold no lock. The recorder never reads the arrays of a call again, so the loop may change them
in place.
"""

import hashlib
import json
import math
import queue
import shutil
import threading
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from os import PathLike
from pathlib import Path
from time import monotonic
from types import MappingProxyType, TracebackType
from typing import Any, BinaryIO, Literal, Self

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pftrack.core.arrays import Floats
from pftrack.core.numerics.elementary import logarithm
from pftrack.core.version import __version__
from pftrack.sources.beliefs.content import ARRAYS, LARGEST_FRAME, MOST_COMPONENTS, VERSION, header_of
from pftrack.sources.formats import RECORDING_ENTRY

CHUNK_NUMBERS = 128 * 1024
COPIED_BYTES = 1024 * 1024
CHUNK_S = 0.5
"""Size, and time, after which gathered values are written."""

CHUNKS = 8
"""Number of chunks in use: the loop waits for the disk only when all others wait to be written."""

JPEG_QUALITY = 95

Sources = str | PathLike[str] | Sequence[Any] | NDArray[Any] | None


# Allocating memory costs several times as much as copying into it, so a few chunks are reused: the loop fills one while
# others are written.

NOTHING = dict.fromkeys(ARRAYS, 0)
LEAST = 8 * 1024
"""First capacity of a column, in numbers."""


class Column:
    """The rows of one array, one below the other.

    Attributes:
        rows: Number of rows.
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
        number: Number of the chunk in its file.
        rows: Frame, target, whether it is a truth, and how many rows of each array.
        columns: The arrays by name.
        used: Number of stored values.
    """

    def __init__(self, precision: "np.dtype[Any]") -> None:
        """Make one that is empty.

        Args:
            precision: Precision of particles and their weights.
        """
        others = {"ancestors": np.dtype("<i4")}
        self.number = self.used = 0
        self.rows: list[tuple[int, ...]] = []
        self.columns = {
            name: Column(precision if name in {"particles", "log_weights"} else others.get(name, np.dtype("<f8")))
            for name in ARRAYS
        }

    def append(self, frame: int, target: int, said: Mapping[str, NDArray[Any]], *, is_truth: bool) -> None:
        """Copy the values of a target in a frame: arrays by name, each of one row or more."""
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


class Recorder:
    """Writes a recording of beliefs; `pftrack.record` makes one, and `pftrack.load` opens the file.

    Call it once for each frame and target, the frames of a target in rising order. Use it in a `with` statement, or
    `close` it.

    Attributes:
        path: Path of the file; None if it was given open.
        numbers: Numbers of targets that have names, by name.
    """

    def __init__(
        self,
        path: str | PathLike[str] | BinaryIO,
        source: Sources = None,
        *,
        components: Sequence[str] = (),
        units: Sequence[str] = (),
        frame_rate_hz: float = 30.0,
        precision: Literal["single", "double"] = "single",
        remarks: Sequence[str] = (),
        frames: int = 0,
        labels: Mapping[int, str] = MappingProxyType({}),
        embed: bool = True,
        on_written: Callable[[], None] = lambda: None,
        on_closed: Callable[[], None] = lambda: None,
    ) -> None:
        """Begin a file.

        Args:
            path: Output file, usually .pft; an existing file is replaced at once. Or a file that is open.
            source: Input of the loop: the file of a clip; pictures (height, width, 3) or (height, width), RGB, by
                number of the frame; the times of the frames (T,), s; or nothing.
            components: Names of the states' components.
            units: Units of the components.
            frame_rate_hz: Frame rate of frames without clip and times.
            precision: Precision of the particles and their weights in the file.
            remarks: Remarks for users of the file, a sentence each.
            frames: Number of frames, including frames without a belief; 0 if it is unknown.
            labels: Names of targets, by number.
            embed: Whether a clip goes along; else it is named, and known again by its content.
            on_written: Called after each write, by the writing thread.
            on_closed: Called after the last write.

        Raises:
            OSError: The file cannot be written, or the clip not be read.
            ValueError: The source is none of these.
        """
        self.path = Path(path) if isinstance(path, str | PathLike) else None
        self._names = tuple(str(name) for name in components)
        self._float = np.dtype("<f4" if precision == "single" else "<f8")
        self._dimension = len(self._names)
        self._last: dict[int, int] = {}
        self.numbers: dict[str, int] = {}
        self._on_written, self._on_closed = on_written, on_closed
        self._pictures = _pictures_of(source)
        self._shown: set[int] = set()
        clip = Path(source) if isinstance(source, str | PathLike) else None
        times = _times_of(source) if clip is None and self._pictures is None else None
        if clip is not None and not clip.is_file():
            raise FileNotFoundError(f"there is no clip {clip}")
        self._archive = zipfile.ZipFile(path if self.path is None else self.path, "w", zipfile.ZIP_STORED)
        about = {
            "format": "pftrack-recording",
            "version": VERSION,
            "pftrack": __version__,
            "components": self._names,
            "units": [str(unit) for unit in units],
            "frame_rate_hz": float(frame_rate_hz),
            "clip": clip.name if clip else None,
            "clip_sha256": None if clip is None or embed else _digest(clip),
            "remarks": list(remarks),
            "frames": frames,
            "labels": {str(target): label for target, label in labels.items()},
        }
        self._write_entry(RECORDING_ENTRY, json.dumps(about).encode())
        if times is not None:
            self._write_entry("times.npy", header_of(times.dtype, times.shape) + times.tobytes())
        if clip is not None and embed:
            with clip.open("rb") as file, self._archive.open("clip", "w", force_zip64=True) as entry:
                shutil.copyfileobj(file, entry, COPIED_BYTES)
        self._flush()
        self._chunks = 0
        self._free: queue.LifoQueue[Chunk] = queue.LifoQueue()  # the newest is in the processor's cache
        for _ in range(CHUNKS - 1):
            self._free.put(Chunk(self._float))
        self._chunk, self._since = Chunk(self._float), monotonic()
        self._failure: BaseException | None = None
        self._queue: queue.Queue[Chunk | tuple[int, NDArray[Any]] | None] = queue.Queue(CHUNKS)
        self._thread = threading.Thread(target=self._write_all, name="pftrack recorder", daemon=True)
        self._thread.start()
        self._is_open = True

    def __call__(
        self,
        t: int,
        *,
        particles: ArrayLike | None = None,
        log_weights: ArrayLike | None = None,
        ancestors: ArrayLike | None = None,
        mean: ArrayLike | None = None,
        covariance: ArrayLike | None = None,
        box: ArrayLike | None = None,
        score: float = float("nan"),
        target: int = 0,
        truth: ArrayLike | None = None,
        true_box: ArrayLike | None = None,
    ) -> None:
        """Record the belief in a target in a frame, as particles, as mean and covariance, or as a box.

        Args:
            t: Number of the frame, from 0, counted as in the clip, the pictures or the times.
            particles: (N, d) states, or (N,) for one component; the first two are the place in the picture, px, if any.
            log_weights: (N,) logarithms of the weights, up to a constant; equal ones if not given.
            ancestors: (N,) place of each particle's parent in the frame before.
            mean: (d,) mean of the state; by default that of the particles.
            covariance: (d, d) of the state.
            box: (4,) left and upper edge, width and height, px; the first pixel is 0.
            score: The tracker's confidence in the box.
            target: Number of the target, where there are several.
            truth: (up to d,) true state, as far as known.
            true_box: (4,) true box, px.

        Raises:
            ValueError: Nothing is said, a number is not finite, shapes do not fit together or not to the frames before,
                or a later frame of the target is there.
            OSError: What came before could not be written.
        """
        self._check(t)
        said: dict[str, NDArray[Any]] = {}
        if particles is not None:
            states = np.asarray(particles)
            said["particles"] = states = states[:, None] if states.ndim == 1 else states
            count = self._count(states)
            _check_finite("particles", states)
            if log_weights is not None:
                said["log_weights"] = _of_shape("log_weights", np.asarray(log_weights), (count,))
            if ancestors is not None:
                said["ancestors"] = _of_shape("ancestors", np.asarray(ancestors), (count,))
        elif log_weights is not None or ancestors is not None:
            raise ValueError("log_weights and ancestors belong to particles, but no particles were given")
        if mean is not None:
            said["mean"] = np.array(mean, "<f8", ndmin=1)[None]
            self._fit("mean", said["mean"], ("1", "d"))
            _check_finite("mean", said["mean"])
        if covariance is not None:
            said["covariance"] = np.array(covariance, "<f8", ndmin=2)[None]
            self._fit("covariance", said["covariance"], ("1", "d", "d"))
            _check_finite("covariance", said["covariance"])
        if box is not None:
            said["box"] = _box("box", box, score)
        if not said:
            raise ValueError(f"frame {t} has no belief: expected particles, a mean or a box")
        self._add(t, target, said, is_truth=False)
        if truth is not None or true_box is not None:
            self.truth(t, position=truth, box=true_box, target=target)

    def truth(
        self, t: int, *, position: ArrayLike | None = None, box: ArrayLike | None = None, target: int = 0
    ) -> None:
        """Record the truth of a target in a frame; its number may differ from the loop's number."""
        self._check(t)
        said: dict[str, NDArray[Any]] = {}
        if position is not None:
            known = np.array(position, "<f8", ndmin=1)
            self._dimension = self._dimension or len(known)
            if known.ndim != 1 or not 1 <= len(known) <= self._dimension:
                raise ValueError(f"truth must be up to {self._dimension} numbers, got an array of {known.shape}")
            said["mean"] = np.full((1, self._dimension), np.nan)
            said["mean"][0, : len(known)] = known
        if box is not None:
            said["box"] = _box("true_box", box, float("nan"))
        if not said:
            raise ValueError(f"frame {t} has no truth: expected a position or a box")
        self._add(t, target, said, is_truth=True)

    def close(self) -> None:
        """Write the rest.

        Raises:
            OSError: It cannot be written.
        """
        if not self._is_open:
            return
        self._is_open = False
        self._hand_on()
        self._queue.put(None)
        self._thread.join()
        with suppress(OSError):
            self._archive.close()
        self._on_closed()
        if self._failure is not None:
            raise self._failure

    def __enter__(self) -> Self:
        """Return the recorder."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file; it keeps all records before an error."""
        self.close()

    def _check(self, t: int) -> None:
        if self._is_open and self._failure is None and 0 <= t <= LARGEST_FRAME:
            return
        if not self._is_open:
            raise ValueError("the recording is closed")
        if self._failure is not None:
            raise self._failure
        raise ValueError(f"frames count from 0 to {LARGEST_FRAME:,}, got {t}")

    def _count(self, states: NDArray[Any]) -> int:
        """Return the number of particles; a quick test covers the usual case that it is the same as before."""
        if states.ndim == 2 and states.shape[1] == self._dimension and len(states) and states.dtype.kind == "f":
            return len(states)
        return self._fit("particles", states, ("N", "d"))

    def _fit(self, what: str, array: NDArray[Any], axes: tuple[str, ...]) -> int:
        """Refuse an array of other axes, or of other components than before; return its length."""
        _check_numbers(what, array)
        dimension = array.shape[-1] if array.ndim == len(axes) else 0
        self._dimension = self._dimension or dimension
        wanted = tuple(self._dimension if axis == "d" else None for axis in axes)
        fits = array.ndim == len(axes) and all(
            side == length for side, length in zip(wanted, array.shape, strict=True) if side is not None
        )
        if not fits or not 1 <= dimension <= MOST_COMPONENTS or not len(array):
            named = ", ".join(axes)
            raise ValueError(f"{what} must be ({named}) with d = {self._dimension or '1, 2, ...'}, got {array.shape}")
        return len(array)

    def _add(self, t: int, target: int, said: dict[str, NDArray[Any]], *, is_truth: bool) -> None:
        if not is_truth:
            if t < self._last.get(target, 0):
                raise ValueError(f"frames of a target must rise, got {t} of target {target} after {self._last[target]}")
            self._last[target] = t
        chunk = self._chunk
        chunk.append(int(t), int(target), said, is_truth=is_truth)
        if self._pictures is not None and int(t) not in self._shown:
            self._shown.add(int(t))
            self._queue.put((int(t), np.array(self._pictures[int(t)])))
        if chunk.used >= CHUNK_NUMBERS or monotonic() - self._since >= CHUNK_S:
            self._hand_on()

    def _hand_on(self) -> None:
        """Give what was gathered to the thread that writes."""
        if self._chunk.rows:
            self._chunk.number = self._chunks
            self._chunks += 1
            self._queue.put(self._chunk)
            self._chunk = self._free.get()
        self._since = monotonic()

    def _write_all(self) -> None:
        while (item := self._queue.get()) is not None:
            try:
                if self._failure is None:
                    self._write(item)
                    self._flush()
                    self._on_written()
            except Exception as error:  # noqa: BLE001 - raised again by the next call
                self._failure = error
            finally:
                if isinstance(item, Chunk):
                    item.clear()
                    self._free.put(item)

    def _write(self, item: Chunk | tuple[int, NDArray[Any]]) -> None:
        if not isinstance(item, Chunk):
            frame, picture = item
            self._write_entry(f"pictures/{frame:06d}.jpg", _jpeg(picture))
            return
        name = f"chunks/{item.number:06d}"
        for array, column in item.columns.items():
            if column.rows:
                self._write_array(f"{name}/{array}.npy", column.array)
        # The rows come last: a chunk is there when they are.
        self._write_array(f"{name}/rows.npy", np.array(item.rows, "<i8"))

    def _write_array(self, name: str, array: NDArray[Any]) -> None:
        header = header_of(array.dtype, array.shape)
        info = zipfile.ZipInfo(name)
        info.file_size = len(header) + array.nbytes
        with self._archive.open(info, "w") as entry:
            entry.write(header)
            entry.write(array.data)

    def _write_entry(self, name: str, data: bytes) -> None:
        self._archive.writestr(zipfile.ZipInfo(name), data)  # without the time of a clock that may be before 1980

    def _flush(self) -> None:
        if self._archive.fp is not None:
            self._archive.fp.flush()


def _check_numbers(what: str, array: NDArray[Any]) -> None:
    """Refuse what cannot be copied, before anything of the frame is."""
    kinds = "iu" if what == "ancestors" else "fiu"
    if array.dtype.kind not in kinds:
        raise ValueError(f"{what} must be {'whole numbers' if kinds == 'iu' else 'numbers'}, got {array.dtype}")


def _check_finite(what: str, array: NDArray[Any]) -> None:
    """Refuse NaN and infinity by their sum, which is faster than testing each number."""
    if not math.isfinite(array.sum()):
        raise ValueError(f"{what} must be finite, got NaN or infinity")


def _of_shape(what: str, array: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """Refuse an array of another shape, or of other things than numbers; most are right, which is seen in no time."""
    if array.shape != shape or array.dtype.kind != "f":
        _check_numbers(what, array)
        if array.shape != shape:
            raise ValueError(f"{what} must be {shape}, as many as there are particles, got {array.shape}")
    return array


def _box(what: str, box: ArrayLike, score: float) -> NDArray[Any]:
    numbers = np.array(box, "<f8")
    if numbers.shape != (4,) or not np.isfinite(numbers).all() or not (numbers[2:] > 0).all():
        raise ValueError(f"{what} must be x, y, w, h with w and h above 0, px, got {numbers.tolist()}")
    return np.append(numbers, score)[None]


def _pictures_of(source: Sources) -> Any:  # noqa: ANN401 - whatever has a picture for a number
    """Return what has a picture for each number; None if the source is not a set of pictures."""
    if source is None or isinstance(source, str | PathLike) or not hasattr(source, "__getitem__") or not len(source):
        return None
    return source if np.ndim(source[0]) in {2, 3} else None


def _digest(clip: Path) -> str:
    with clip.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _times_of(source: Sources) -> Floats | None:
    if source is None:
        return None
    times = np.array(source, "<f8")
    rising = times.ndim == 1 and len(times) > 0 and np.isfinite(times).all() and (np.diff(times) > 0).all()
    if not rising:
        raise ValueError("source must be a clip's file, pictures, or times that rise, s")
    return times


def _jpeg(picture_rgb: NDArray[Any]) -> bytes:
    """Return a picture, RGB or grey, as a file."""
    image = np.asarray(picture_rgb, np.uint8)
    ready = image if image.ndim == 2 else np.ascontiguousarray(image[:, :, 2::-1])
    done, data = cv2.imencode(".jpg", ready, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    if not done:
        raise ValueError(f"a picture must be (height, width, 3) or (height, width), got {image.shape}")
    return bytes(data)


# Adapters record the beliefs of filters of other libraries. They do not import these libraries.
#
# | library | in its loop |
# |---|---|
# | particles | `SMC(..., collect=[ParticlesCollector(rec)])` |
# | FilterPy | `record_filterpy(rec, t, kalman_filter)` after `update` |
# | Stone Soup | `record_stone_soup(rec, t, state)`, or a track, or a set of tracks, after each update |
# | pfilter | `record_pfilter(rec, t, particle_filter)` after `update` |


class ParticlesCollector:
    """A collector for `particles.SMC`: it records particles, log-weights and ancestors of every step."""

    summary_name = "recorded"

    def __init__(self, recorder: Recorder) -> None:
        self.recorder = recorder
        self.summary: list[int] = []

    def __call__(self) -> "ParticlesCollector":
        """Return itself, because the library copies each collector, and there is only one file."""
        return self

    def collect(self, smc: Any) -> None:  # noqa: ANN401 - of a library that need not be there
        """Record the filter's state after a step."""
        # Its time is that of the next step, except in the first.
        t = len(self.summary)
        self.recorder(t, particles=smc.X, log_weights=smc.wgts.lw, ancestors=smc.A)
        self.summary.append(t)


def record_filterpy(recorder: Recorder, t: int, kalman: Any, *, target: int = 0) -> None:  # noqa: ANN401
    """Record the state of a FilterPy filter with a mean `x` and a covariance `P`: Kalman, extended, unscented, ..."""
    recorder(t, mean=np.ravel(kalman.x), covariance=kalman.P, target=target)


def record_pfilter(recorder: Recorder, t: int, tracker: Any, *, target: int = 0) -> None:  # noqa: ANN401
    """Record the particles of a `pfilter.ParticleFilter` before its resampling."""
    weights = logarithm(np.asarray(tracker.original_weights, float))
    recorder(t, particles=tracker.original_particles, log_weights=weights, target=target)


def record_stone_soup(recorder: Recorder, t: int, said: Any, *, target: int = 0) -> None:  # noqa: ANN401
    """Record a state of Stone Soup, with particles or a Gaussian; or the newest state of one or several tracks.

    Tracks have names instead of numbers; they are numbered in order of appearance.
    """
    if isinstance(said, Iterable) and not hasattr(said, "state_vector"):
        for track in said:
            numbers = recorder.numbers
            record_stone_soup(recorder, t, track, target=numbers.setdefault(str(track.id), len(numbers) + 1))
        return
    state = getattr(said, "state", said)
    if hasattr(state, "log_weight"):
        weights = np.asarray(state.log_weight, float).ravel()
        recorder(t, particles=np.asarray(state.state_vector, float).T, log_weights=weights, target=target)
    else:
        covariance = np.asarray(state.covar, float)
        recorder(t, mean=np.asarray(state.mean, float).ravel(), covariance=covariance, target=target)
