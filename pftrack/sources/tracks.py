"""Tracks as a source: positions of a body's points in each frame, with the variances of their noise; no picture."""

import math
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Floats
from pftrack.core.files import csv_text
from pftrack.core.geometry import paint_disc
from pftrack.core.model.parameters import Parameters
from pftrack.core.model.source import Frame, FrameIndex, FrameSequence, History, Measurements, Target
from pftrack.core.refusal import RefusedError
from pftrack.sources.cells import COLUMN_NAMES, Table, decode, find_columns, frame_in, number_in, places_of, read_table
from pftrack.sources.formats import TRACKS_COLUMNS
from pftrack.sources.limits import Limits

# Tables of tracks, text with a header as spreadsheets and other programs write it.
#
# The long form has a line for each point in each frame, with the columns
#
#     frame, point, x_px, y_px, var_x, var_y
#
# `frame` counts from any whole number, `point` is a name or a number. Instead of the variances, px^2, there may be
# standard deviations, `sd_x, sd_y` or one `sd`, px; without either all are taken as 1. The wide form has a line for
# each frame and columns `NAME_x, NAME_y, NAME_var_x, NAME_var_y` (or `NAME_sd_x`, ...) for each point. Further columns
# are ignored. A path of one point may leave out `point`, and `frame`, too: then each line is the next frame.
#
# A point that has no line in a frame, or whose position or variance is empty, NaN or infinite, was not seen there.

LARGEST_FILE_BYTES = 12 * 1024 * 1024
MOST_POINTS = 400
FEWEST_FRAMES = 2
ONLY = "1"
"""Name of the point of a table that names none."""
FURTHEST_PX = 1e6
WORDS = ", ".join(TRACKS_COLUMNS)

SYNONYMS = COLUMN_NAMES.tracks
SPREADS = (SYNONYMS["var_x"] + SYNONYMS["sd_x"], SYNONYMS["var_y"] + SYNONYMS["sd_y"])
COVARIANCE = ("cov_xy", "var_xy")


@dataclass(frozen=True, eq=False)
class TrackTable:
    """The content of a table.

    Attributes:
        names: (n,) names of the points, in order of appearance.
        positions: (T, n, 2) px, NaN where a point was not seen.
        variances: (T, n, 2) px^2, infinite there.
        first: Number of the first frame.
        warnings: What was skipped, one sentence each.
    """

    names: tuple[str, ...]
    positions: Floats
    variances: Floats
    first: int
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Places:
    """The columns of a point's numbers; None where they are missing."""

    x: int
    y: int
    spread: tuple[int, int] | None
    squared: bool


def read_tracks(data: bytes, most_frames: int) -> TrackTable:
    """Read a table.

    Args:
        data: Content of the file.
        most_frames: Largest number of frames.

    Raises:
        RefusedError: It is not such a table, has a wrong line, or has too many or too few frames or points.
    """
    table = read_table(decode(data))
    header = table.header
    columns = places_of(header)
    found = find_columns(columns, SYNONYMS)
    point = found.get("point")
    form = _long if _places(found) is not None or point is not None else _wide
    seen: dict[str, dict[int, tuple[float, float, float, float]]] = {}
    for line, frame, name, values in form(table, columns):
        if name not in seen and len(seen) == MOST_POINTS:
            raise RefusedError(f"the table has more than the {MOST_POINTS} points that are allowed")
        track = seen.setdefault(name, {})
        if frame in track:
            raise RefusedError(_duplicate_message(line, None if form is _long and point is None else name, frame))
        track[frame] = values
        if len(track) > most_frames:
            raise RefusedError(f"the table has more than {most_frames:,} frames of point {name}; so many are allowed")
    warnings = []
    if any(name in header for name in COVARIANCE):
        warnings.append("The covariances of x and y are not used, only the variances.")
    if not all(any(name.endswith(words) for name in header) for words in SPREADS):
        warnings.append("There are no variances in the table; all positions count alike.")
    return _table(seen, most_frames, warnings)


def _table(
    found: Mapping[str, Mapping[int, tuple[float, float, float, float]]], most_frames: int, warnings: list[str]
) -> TrackTable:
    seen = {
        name: {frame: values for frame, values in track.items() if all(map(math.isfinite, values))}
        for name, track in found.items()
    }
    names = tuple(name for name, track in seen.items() if track)
    never = [name for name in found if name not in names]
    if never:
        warnings.append(f"Never seen and left out: {', '.join(never[:8])}{', ...' if len(never) > 8 else ''}.")
    frames = sorted({frame for track in seen.values() for frame in track})
    if len(frames) < FEWEST_FRAMES:
        raise RefusedError(
            f"expected at least {FEWEST_FRAMES} frames in which points are seen, got {len(frames)} in the table"
        )
    length = frames[-1] - frames[0] + 1
    if length > most_frames:
        raise RefusedError(f"the table reaches over {length:,} frames; at most {most_frames:,} are allowed")
    positions = np.full((length, len(names), 2), np.nan)
    variances = np.full((length, len(names), 2), np.inf)
    for place, name in enumerate(names):
        for frame, (x, y, var_x, var_y) in seen[name].items():
            positions[frame - frames[0], place] = x, y
            variances[frame - frames[0], place] = var_x, var_y
    if len(frames) < length:
        warnings.append(f"In {length - len(frames)} of {length} frames no point is seen.")
    return TrackTable(names, positions, variances, frames[0], tuple(warnings))


def _duplicate_message(line: int, name: str | None, frame: int) -> str:
    """Return the error for a line that repeats the point of this name; None if no column names points."""
    if name is not None:
        return f"line {line} lists point {name} in frame {frame} for the second time"
    return (
        f"line {line} lists frame {frame} for the second time; a table of several points needs a column "
        f"that says which, named {' or '.join(SYNONYMS['point'])}"
    )


Row = tuple[int, int, str, tuple[float, float, float, float]]


def _long(table: Table, columns: Mapping[str, int]) -> Iterator[Row]:
    found = find_columns(columns, SYNONYMS)
    places, frame, point = _places(found), found.get("frame"), found.get("point")
    if places is None or (frame is None and point is not None):
        raise RefusedError(f"the table has the columns {', '.join(table.header)[:120]}; expected {WORDS}")
    for number, (line, cells) in enumerate(_fill(table)):
        name = ONLY if point is None else cells[point].strip()[:40]
        if not name:
            raise RefusedError(f"line {line} names no point")
        index = number if frame is None else frame_in(line, cells[frame])
        yield line, index, name, _values(line, cells, places)


def _wide(table: Table, columns: Mapping[str, int]) -> Iterator[Row]:
    header = table.header
    frame = find_columns(columns, SYNONYMS).get("frame")
    prefixes = dict.fromkeys(name[:-1].removesuffix("_") for name in header if name.endswith("_x"))
    kept = [name for name in prefixes if not name.endswith(("var", "sd"))]
    points = [
        (name, places) for name in kept if (places := _places(find_columns(columns, SYNONYMS, f"{name}_"))) is not None
    ]
    if frame is None or not points:
        raise RefusedError(
            f"the table has the columns {', '.join(header)[:120]}; expected {WORDS}, or frame and NAME_x, NAME_y, "
            "NAME_var_x, NAME_var_y for each point"
        )
    for line, cells in _fill(table):
        number = frame_in(line, cells[frame])
        for name, places in points:
            yield line, number, name[:40], _values(line, cells, places)


def _places(found: Mapping[str, int]) -> _Places | None:
    """Return where the numbers of a point are, given the columns that were found; None without a position."""
    if not {"x", "y"} <= found.keys():
        return None
    for pair, squared in ((("var_x", "var_y"), True), (("sd_x", "sd_y"), False)):
        if set(pair) <= found.keys():
            return _Places(found["x"], found["y"], (found[pair[0]], found[pair[1]]), squared)
    return _Places(found["x"], found["y"], None, squared=True)


def _fill(table: Table) -> Iterator[tuple[int, list[str]]]:
    for line, cells in table.rows:
        if len(cells) != len(table.header):
            raise RefusedError(f"line {line}: expected {len(table.header)} values, got {len(cells)}")
        yield line, cells


def _values(line: int, cells: Sequence[str], places: _Places) -> tuple[float, float, float, float]:
    x = number_in(line, "x", cells[places.x])
    y = number_in(line, "y", cells[places.y])
    if max(abs(x), abs(y)) > FURTHEST_PX and math.isfinite(x) and math.isfinite(y):
        raise RefusedError(f"line {line}: a position must lie within {FURTHEST_PX:,.0f} px, got {x:g}, {y:g}")
    if places.spread is None:
        return x, y, 1.0, 1.0
    first, second = (number_in(line, "variance", cells[place]) for place in places.spread)
    variances = (first, second) if places.squared else (first * first, second * second)
    # The square of a deviation that is above 0 may be too small for a number.
    if min(first, second, *variances) <= 0.0:
        raise RefusedError(
            f"line {line}: variances and standard deviations must be above 0, got {min(first, second):g}"
        )
    return x, y, *variances


def write(names: Sequence[str], positions: Floats, variances: Floats) -> str:
    """Return the table, in the long form, of positions (T, n, 2) px and variances (T, n, 2) px^2."""
    lines: list[tuple[str, ...]] = [TRACKS_COLUMNS]
    for frame in range(len(positions)):
        for place, name in enumerate(names):
            if np.isfinite(variances[frame, place]).all():
                numbers = (*positions[frame, place], *variances[frame, place])
                lines.append((str(frame), name, *(repr(float(number)) for number in numbers)))
    return csv_text(lines)


# A table of tracks as a sequence: its frames are shown as pictures of dots, and a tracker receives the tracks.
#
# So a table is handled like a video: it is surveyed once, kept with its index, and named by the hash of its content.
# The table does not give the size of its picture, so the extent of the visible points is used.

FRAME_RATE_HZ = 30.0
LONGEST_PX, SHORTEST_PX, USUAL_PX = 1280, 200, 640
"""Limits of the picture's longer side: tracks in units other than px are scaled to the usual one."""

MARGIN = 0.08
TRUSTED = 5.0
"""A position whose standard deviation exceeds the median by this factor is ignored for the extent."""

LEAST_EXTENT = 1e-9
"""Extent, in the table's unit, up to which all points are at one place; it cannot be scaled to a picture."""

LEAST_VARIANCE_PX2 = 1e-12
"""No tracker is more exact, and the inverse of much smaller values overflows."""

PAPER, DOT_RGB, DOT_PX = 255, (86, 180, 233), 4.0


class TrackSequence(FrameSequence):
    """Tracks of a file, in px of a picture that holds all visible points.

    Attributes:
        names: Names of the points.
        positions: (T, n, 2) px, NaN where a point was not seen.
        variances: (T, n, 2) px^2, infinite there.
        scale: px of the picture for a unit of the file.
        origin: (2,) where the picture's corner is, in the file's unit.
        first_frame: Number in the file of the first frame.
    """

    def __init__(self, file: BinaryIO, *, name: str, sha256: str, limits: Limits) -> None:
        """Read a file, which is closed.

        Raises:
            RefusedError: It is not a table of tracks, or exceeds the limits.
        """
        with file:
            file.seek(0)
            data = file.read(LARGEST_FILE_BYTES + 1)
        if len(data) > LARGEST_FILE_BYTES:
            raise RefusedError(f"a table of tracks may have at most {LARGEST_FILE_BYTES // 1024**2} MiB")
        table = read_tracks(data, limits.frames)
        self.name = name
        self.names: Sequence[str] = table.names
        size, scale, origin = _frame(table.positions, table.variances)
        self.scale, self.origin, self.first_frame = scale, origin, table.first
        self.positions: Floats = scale * (table.positions - origin)
        variances = scale * scale * table.variances
        self.variances: Floats = np.maximum(variances, LEAST_VARIANCE_PX2)
        scaled = [] if scale == 1.0 else [_scaling(size, scale, origin)]
        if (variances < LEAST_VARIANCE_PX2).any():
            scaled.append(f"Variances below {LEAST_VARIANCE_PX2:g} px² of the picture were raised to that.")
        for array in (self.positions, self.variances):
            array.flags.writeable = False
        self.index = FrameIndex(
            kind="tracks",
            sha256=sha256,
            width=size[0],
            height=size[1],
            frame_rate_hz=FRAME_RATE_HZ,
            times_s=tuple((np.arange(len(self.positions)) / FRAME_RATE_HZ).tolist()),
            checksums=tuple(zlib.crc32(np.nan_to_num(one).tobytes()) for one in self.positions),
            warnings=(*table.warnings, *scaled),
        )

    @override
    def _picture(self, index: int) -> NDArray[np.uint8]:
        """Return a frame as dots on white paper; unseen points have none."""
        image = np.full((self.size[1], self.size[0], 3), PAPER, dtype=np.uint8)
        for x, y in self.positions[index][np.isfinite(self.positions[index]).all(axis=1)]:
            paint_disc(image, float(x), float(y), DOT_PX, DOT_RGB)
        image.flags.writeable = False
        return image


def _scaling(size: tuple[int, int], scale: float, origin: Floats) -> str:
    """Return the remark that lets a user find a position of the file in the picture."""
    across, down = (0.0 - origin).tolist()
    return (
        f"The positions were scaled by {scale:.3g} to fit into a picture of {size[0]} x {size[1]} px: a point of the "
        f"file is at {scale:.6g} (x {across:+.4g}, y {down:+.4g}). Marks and lengths are in px of that picture."
    )


def _frame(positions: Floats, variances: Floats) -> tuple[tuple[int, int], float, Floats]:
    """Return width and height of a picture of the tracks, px, and their scale and origin in it."""
    sd = np.sqrt(variances.max(axis=2))
    known = np.isfinite(sd) & np.isfinite(positions).all(axis=2)
    trusted = known & (sd <= TRUSTED * np.median(sd[known]))
    seen = positions[trusted]
    low, high = seen.min(axis=0), seen.max(axis=0)
    longest = float((high - low).max())
    if not longest > LEAST_EXTENT:
        raise RefusedError("expected points at different places, got all at one")
    margin = MARGIN * longest
    # Positions that are px of a picture stay where they are in it.
    origin = np.where((low >= 0.0) & (low < longest), np.zeros(2), low - margin)
    extent = high + margin - origin
    scale = 1.0 if SHORTEST_PX <= extent.max() <= LONGEST_PX else USUAL_PX / float(extent.max())
    width, height = (max(int(np.ceil(scale * side)), 16) for side in extent)
    return (width, height), scale, origin


class RecordedTracks:
    """The frames of a table of tracks.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second.
        frame_count: Frames from the chosen one to the end.
        start: Prior knowledge.
        noisy: The frames do not depend on the seed.
    """

    noisy = False

    def __init__(self, sequence: TrackSequence, start: Target, first: int = 0) -> None:
        """Wire tracks up from the frame `first` of the sequence on, with prior knowledge of them."""
        self._sequence, self._first = sequence, first
        self.size, self.frame_rate_hz = sequence.size, sequence.frame_rate_hz
        self.frame_count: int | None = sequence.frame_count - first
        self.start = start

    def frame(self, index: int, history: History[Parameters]) -> Frame:
        """Return the tracks of a frame; the same arguments give the same frame, to the bit."""
        del history
        number = self._first + index
        sd = np.sqrt(self._sequence.variances[number])
        return Frame(index, index / self.frame_rate_hz, measurements=Measurements(self._sequence.positions[number], sd))
