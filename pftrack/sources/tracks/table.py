"""Tables of tracks, text with a header as spreadsheets and other programs write it; and bodies of points.

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
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.files import csv_text
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.sources.cells import Table, decode, frame_in, number_in, read_table
from pftrack.sources.formats import TRACKS_COLUMNS
from pftrack.sources.limits import SourceError
from pftrack.sources.prism import FACES, NAMES, NORMALS, OFFSETS, TOUCHING, VERTICES_MM
from pftrack.vision.geometry.face import FEATURES, LINKS, mean_model, person

LARGEST_FILE_BYTES = 12 * 1024 * 1024
MOST_POINTS = 400
FEWEST_FRAMES = 2
ONLY = "1"
"""Name of the point of a table that names none."""
FURTHEST_PX = 1e6
WORDS = ", ".join(TRACKS_COLUMNS)

SYNONYMS: Mapping[str, tuple[str, ...]] = {
    "frame": ("frame",),
    "point": ("point", "track", "track_id", "particle", "id"),
    "x": ("x_px", "x", "u"),
    "y": ("y_px", "y", "v"),
    "var_x": ("var_x", "var_x_px2"),
    "var_y": ("var_y", "var_y_px2"),
    "sd_x": ("sd_x", "sd_x_px", "sd", "sd_px"),
    "sd_y": ("sd_y", "sd_y_px", "sd", "sd_px"),
}
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
    # Looked up by name, and the first of several: in a list that takes minutes where there are many columns.
    columns = {name: place for place, name in reversed(tuple(enumerate(header)))}
    plain = _places(columns, "") is not None
    point = _column(columns, "point")
    form = _long if plain or point is not None else _wide
    found: dict[str, dict[int, tuple[float, float, float, float]]] = {}
    for line, frame, name, values in form(table, columns):
        if name not in found and len(found) == MOST_POINTS:
            raise SourceError(f"the table has more than the {MOST_POINTS} points that are allowed")
        track = found.setdefault(name, {})
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
    return _table(found, most_frames, warnings)


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
    places = _places(columns, "")
    frame, point = _column(columns, "frame"), _column(columns, "point")
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
    frame = _column(columns, "frame")
    prefixes = dict.fromkeys(name[:-1].removesuffix("_") for name in header if name.endswith("_x"))
    kept = [name for name in prefixes if not name.endswith(("var", "sd"))]
    points = [(name, places) for name in kept if (places := _places(columns, f"{name}_")) is not None]
    if frame is None or not points:
        raise SourceError(
            f"the table has the columns {', '.join(header)[:120]}; expected {WORDS}, or frame and NAME_x, NAME_y, "
            "NAME_var_x, NAME_var_y for each point"
        )
    for line, cells in _fill(table):
        number = frame_in(line, cells[frame])
        for name, places in points:
            yield line, number, name[:40], _values(line, cells, places, table.delimiter)


def _column(columns: Mapping[str, int], name: str, prefix: str = "") -> int | None:
    return next((columns[prefix + word] for word in SYNONYMS[name] if prefix + word in columns), None)


def _places(columns: Mapping[str, int], prefix: str) -> _Places | None:
    x, y, var_x, var_y, sd_x, sd_y = (
        _column(columns, name, prefix) for name in ("x", "y", "var_x", "var_y", "sd_x", "sd_y")
    )
    if x is None or y is None:
        return None
    if var_x is not None and var_y is not None:
        return _Places(x, y, (var_x, var_y), squared=True)
    if sd_x is not None and sd_y is not None:
        return _Places(x, y, (sd_x, sd_y), squared=False)
    return _Places(x, y, None, squared=True)


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


# A body says what is between its points, from where each is seen, and what others of the kind look like.

Kind: TypeAlias = Literal["prism", "face", "cloud", "plate"]

HEAD_CENTRE_MM = np.array([0.0, 0.0, 90.0])
"""From the face's origin, about the middle of the head: a feature looks away from there."""

GOLDEN_RAD = np.pi * (3.0 - 5.0**0.5)
CLOUD_AXES = np.array([1.0, 0.7, 0.8])
PRIOR_SD = 0.06
"""Of a face's coordinates about the mean face, relative to its size: 3 mm."""


@dataclass(frozen=True, eq=False)
class Shape:
    """What a body has between its points.

    Attributes:
        names: (n,) of the points.
        edges: (m, 2) numbers of points that belong together.
        triangles: (k, 3) numbers of points, clockwise seen from outside.
        mean: (n, 3) mean of other bodies of the kind, about its centre and of unit size; None where none are known.
        prior_sd: Standard deviation of a coordinate about the mean, of unit size.
    """

    names: tuple[str, ...]
    edges: Ints = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    triangles: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 3), np.int32))
    mean: Floats | None = None
    prior_sd: float = PRIOR_SD


@dataclass(frozen=True, eq=False)
class Body:
    """A body that can be simulated.

    Attributes:
        shape: What is between its points.
        points: (n, 3) about the centre, of unit size: their root mean square distance from it is 1.
        normals: (n, m, 3) in which directions each point looks: it is seen if one of its planes is.
        offsets: (n, m) of these planes from the centre; infinite for a plane that there is not.
        graded: Whether a point is seen the worse the more it turns away, rather than well or not at all.
    """

    shape: Shape
    points: Floats
    normals: Floats
    offsets: Floats
    graded: bool = False


def unnamed_shape(count: int) -> Shape:
    """Return what is known of a body of so many points: nothing else."""
    return Shape(tuple(map(str, range(1, count + 1))))


def named_shape(points: Sequence[str]) -> Shape:
    """Return what is known of a body by the names of its points: other faces, if all are features of one."""
    if not set(points) <= set(FEATURES):
        return Shape(tuple(points))
    mean = mean_model().points_mm[[FEATURES.index(point) for point in points]]
    return Shape(tuple(points), _links(points), mean=normalise(mean))


def _links(points: Sequence[str]) -> Ints:
    both = [(points.index(one), points.index(other)) for one, other in LINKS if {one, other} <= set(points)]
    return np.array(both, np.int64).reshape(-1, 2)


def normalise(points: Floats) -> Floats:
    """Return points (n, 3) about their centre, their root mean square distance from it 1; all zero if they are one."""
    centred = points - points.mean(axis=0)
    size = float(np.sqrt(np.square(centred).sum() / len(centred)))
    return np.asarray(centred / size if size > 0.0 else centred)


@lru_cache(maxsize=16)
def body_of(kind: Kind, seed: int, count: int) -> Body:
    """Return a body.

    Args:
        kind: Which.
        seed: Of a face or a cloud, which one.
        count: Of a cloud or a plate, how many points.
    """
    match kind:
        case "prism":
            return _prism()
        case "face":
            return _face(seed)
        case "cloud":
            return _cloud(seed, count)
        case "plate":
            return _plate(seed, count)


def _prism() -> Body:
    corners = np.array(FACES)
    points = np.concatenate([VERTICES_MM, VERTICES_MM[corners].mean(axis=1)])
    names = (*NAMES, "front", "rear", "left", "right", "top", "bottom")
    edges = sorted({tuple(sorted(pair)) for face in FACES for pair in zip(face, (*face[1:], face[0]), strict=True)})
    fans = [
        (8 + place, *pair) for place, face in enumerate(FACES) for pair in zip(face, (*face[1:], face[0]), strict=True)
    ]
    middle = points.mean(axis=0)
    size = float(np.sqrt(np.square(points - middle).sum() / len(points)))
    faces = np.concatenate([TOUCHING, np.eye(len(FACES), dtype=np.bool_)])
    normals = np.broadcast_to(NORMALS, (len(points), *NORMALS.shape))
    offsets = np.where(faces, (OFFSETS - (NORMALS * middle).sum(axis=1)) / size, np.inf)
    triangles = _outwards(np.array(fans, np.int32), points)
    return Body(Shape(names, np.array(edges), triangles), normalise(points), normals, offsets)


def _outwards(triangles: NDArray[np.int32], points: Floats) -> NDArray[np.int32]:
    """Return triangles of a convex body, clockwise as they are seen from outside with y downwards and z away."""
    one, two, three = points[triangles].transpose(1, 0, 2)
    away = (np.cross(two - one, three - one) * (one - points.mean(axis=0))).sum(axis=1)
    return np.where((away > 0.0)[:, None], triangles, triangles[:, ::-1])


def _face(seed: int) -> Body:
    points = person(seed).points_mm
    outwards = points - HEAD_CENTRE_MM
    normals = outwards / np.sqrt(np.square(outwards).sum(axis=1))[:, None]
    return Body(named_shape(FEATURES), normalise(points), normals[:, None], np.zeros((len(points), 1)), graded=True)


def _cloud(seed: int, count: int) -> Body:
    """Points on an egg, spread evenly (Fibonacci's spiral) and shifted a little at random."""
    heights = 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    angles = GOLDEN_RAD * np.arange(count)
    radii = np.sqrt(1.0 - heights * heights)
    directions = np.stack([radii * np.cos(angles), heights, radii * np.sin(angles)], axis=1)
    bumps = 1.0 + 0.15 * Stream(seed, 0, Purpose.SCENE).standard_normal((count, 1))
    points = normalise(directions * CLOUD_AXES * bumps)
    return Body(unnamed_shape(count), points, directions[:, None], np.zeros((count, 1)))


def _plate(seed: int, count: int) -> Body:
    """Points in one plane, which is seen from both sides."""
    places = Stream(seed, 0, Purpose.SCENE).standard_normal((count, 2))
    points = normalise(np.column_stack([places, np.zeros(count)]))
    both = np.broadcast_to([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]], (count, 2, 3))
    return Body(unnamed_shape(count), points, both, np.zeros((count, 2)))
