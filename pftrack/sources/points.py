"""Points of a target that a person has marked on the first picture of a recording, read from a file.

Either JSON, `{"nose": [203.5, 148], ...}` or a list of `{"name": "nose", "x": 203.5, "y": 148}`, or comma-separated
text with the columns `name, x, y`; positions are in px of the picture.
"""

import csv
import io
import json
import math
from collections.abc import Mapping
from pathlib import Path

__all__ = ["Marks", "PointsError", "read_points"]

Marks = Mapping[str, tuple[float, float]]
"""Position (x, y) in px by name."""

LARGEST_FILE_BYTES = 1024 * 1024


class PointsError(ValueError):
    """A file of points that cannot be read; the message says what is wrong and what is allowed."""


def read_points(path: Path) -> Marks:
    """Read marked points.

    Raises:
        PointsError: The file is missing, is neither JSON nor such a table, or a point of it is wrong.
    """
    name = path.name
    try:
        if path.stat().st_size > LARGEST_FILE_BYTES:
            raise PointsError(f"{name} is larger than the {LARGEST_FILE_BYTES // 1024} KiB allowed")
        text = path.read_text(encoding="utf-8-sig")
        rows = _from_json(text) if path.suffix.lower() == ".json" else _from_table(text)
    except FileNotFoundError:
        raise PointsError(f"there is no file {path}") from None
    except OSError as error:
        raise PointsError(f"{path} cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error, ValueError, TypeError, KeyError, AttributeError) as error:
        if isinstance(error, PointsError):
            raise
        raise PointsError(
            f"{name} does not list points: expected JSON as {{name: [x, y]}} or a table with the columns name, x, y"
        ) from None
    points: dict[str, tuple[float, float]] = {}
    for label, x, y in rows:
        if label in points:
            raise PointsError(f"{name}: {label} is listed twice")
        if not (math.isfinite(x) and math.isfinite(y)):
            raise PointsError(f"{name}: {label} must be at two finite numbers of px, got {x} and {y}")
        points[label] = (x, y)
    if not points:
        raise PointsError(f"{name} lists no points")
    return points


def _from_json(text: str) -> list[tuple[str, float, float]]:
    content = json.loads(text)
    if isinstance(content, list):
        return [(str(item["name"]), float(item["x"]), float(item["y"])) for item in content]
    return [(str(name), float(place[0]), float(place[1])) for name, place in content.items()]


def _from_table(text: str) -> list[tuple[str, float, float]]:
    rows = csv.DictReader(io.StringIO(text), skipinitialspace=True)
    return [(row["name"].strip(), float(row["x"]), float(row["y"])) for row in rows]
