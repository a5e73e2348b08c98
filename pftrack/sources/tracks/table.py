"""Tables of tracks, text with a header as spreadsheets and other programs write it.

The long form has a line for each point in each frame, with the columns

    frame, point, x_px, y_px, var_x, var_y

`frame` counts from any whole number, `point` is a name or a number. Instead of the variances, px^2, there may be
standard deviations, `sd_x, sd_y` or one `sd`, px; without either all are taken as 1. The wide form has a line for each
frame and columns `NAME_x, NAME_y, NAME_var_x, NAME_var_y` (or `NAME_sd_x`, ...) for each point. Further columns are
ignored. A path of one point may leave out `point`, and `frame`, too: then each line is the next frame.

A point that has no line in a frame, or whose position or variance is empty, NaN or infinite, was not seen there.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.files import csv_text
from pftrack.sources.cells import COLUMN_NAMES, Table, decode, find_columns, frame_in, number_in, places_of, read_table
from pftrack.sources.formats import TRACKS_COLUMNS
from pftrack.sources.limits import SourceError

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
    """What a table says.

    Attributes:
        names: (n,) of the points, in the order in which they come first.
        positions: (T, n, 2) px, NaN where a point was not seen.
        variances: (T, n, 2) px^2, infinite there.
        first: Number of the first frame.
        warnings: What was passed over, one sentence each.
    """

    names: tuple[str, ...]
    positions: Floats
    variances: Floats
    first: int
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Places:
    """In which columns the numbers of a point are; None where there are none."""

    x: int
    y: int
    spread: tuple[int, int] | None
    squared: bool


def read_tracks(data: bytes, most_frames: int) -> TrackTable:
    """Read a table.

    Args:
        data: Content of the file.
        most_frames: How many frames it may have.

    Raises:
        SourceError: It is no such table, a line of it is wrong, or it has too much or too little.
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
            raise SourceError(f"the table has more than the {MOST_POINTS} points that are allowed")
        track = seen.setdefault(name, {})
        if frame in track:
            raise SourceError(_duplicate_message(line, None if form is _long and point is None else name, frame))
        track[frame] = values
        if len(track) > most_frames:
            raise SourceError(f"the table has more than {most_frames:,} frames of point {name}; so many are allowed")
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
        raise SourceError(
            f"expected at least {FEWEST_FRAMES} frames in which points are seen, got {len(frames)} in the table"
        )
    length = frames[-1] - frames[0] + 1
    if length > most_frames:
        raise SourceError(f"the table reaches over {length:,} frames; at most {most_frames:,} are allowed")
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
    """Say what is wrong with a line that lists the point of this name, None where no column names it, once more."""
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
        raise SourceError(f"the table has the columns {', '.join(table.header)[:120]}; expected {WORDS}")
    for number, (line, cells) in enumerate(_fill(table)):
        name = ONLY if point is None else cells[point].strip()[:40]
        if not name:
            raise SourceError(f"line {line} names no point")
        index = number if frame is None else frame_in(line, cells[frame])
        yield line, index, name, _values(line, cells, places, table.delimiter)


def _wide(table: Table, columns: Mapping[str, int]) -> Iterator[Row]:
    header = table.header
    frame = find_columns(columns, SYNONYMS).get("frame")
    prefixes = dict.fromkeys(name[:-1].removesuffix("_") for name in header if name.endswith("_x"))
    kept = [name for name in prefixes if not name.endswith(("var", "sd"))]
    points = [
        (name, places) for name in kept if (places := _places(find_columns(columns, SYNONYMS, f"{name}_"))) is not None
    ]
    if frame is None or not points:
        raise SourceError(
            f"the table has the columns {', '.join(header)[:120]}; expected {WORDS}, or frame and NAME_x, NAME_y, "
            "NAME_var_x, NAME_var_y for each point"
        )
    for line, cells in _fill(table):
        number = frame_in(line, cells[frame])
        for name, places in points:
            yield line, number, name[:40], _values(line, cells, places, table.delimiter)


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
            raise SourceError(f"line {line}: expected {len(table.header)} values, got {len(cells)}")
        yield line, cells


def _values(line: int, cells: Sequence[str], places: _Places, delimiter: str) -> tuple[float, float, float, float]:
    x = number_in(line, "x", cells[places.x], delimiter=delimiter)
    y = number_in(line, "y", cells[places.y], delimiter=delimiter)
    if max(abs(x), abs(y)) > FURTHEST_PX and math.isfinite(x) and math.isfinite(y):
        raise SourceError(f"line {line}: a position must lie within {FURTHEST_PX:,.0f} px, got {x:g}, {y:g}")
    if places.spread is None:
        return x, y, 1.0, 1.0
    first, second = (number_in(line, "variance", cells[place], delimiter=delimiter) for place in places.spread)
    variances = (first, second) if places.squared else (first * first, second * second)
    # The square of a deviation that is above 0 may be too small for a number.
    if min(first, second, *variances) <= 0.0:
        raise SourceError(f"line {line}: variances and standard deviations must be above 0, got {min(first, second):g}")
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
