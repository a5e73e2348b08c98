"""Named points as JSON, with unit and standard deviations: what a model is, and what can be read back as one.

    {"format": "pftrack points", "version": 1, "unit": "mm", "points": {"nose": [0.0, 38.1, -26.2], ...}, ...}

What is read comes from strangers. It must be small, of the present format, in mm, and have the names that are asked
for, each with three finite numbers of a size that a body can have; anything beyond that is passed over.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["LONGEST_CHARACTERS", "as_json", "read_points"]

FORMAT, VERSION, UNIT = "pftrack points", 1, "mm"
LONGEST_CHARACTERS = 100_000
LARGEST_MM = 10_000.0
DECIMALS = 4


def as_json(names: Sequence[str], points_mm: NDArray[np.float64], **said: Any) -> bytes:  # noqa: ANN401 - JSON
    """Return points (n, 3) by name, and what else is said of them, as a JSON object.

    Args:
        names: (n,).
        points_mm: (n, 3).
        said: Further entries, JSON values.
    """
    head = {"format": FORMAT, "version": VERSION, "unit": UNIT}
    points = dict(zip(names, np.round(points_mm, DECIMALS).tolist(), strict=True))
    return (json.dumps({**head, "points": points, **said}, indent=1, ensure_ascii=False) + "\n").encode()


def read_points(text: str | bytes, names: Sequence[str]) -> NDArray[np.float64]:
    """Return the points (n, 3) of these names, mm.

    Raises:
        ValueError: It is too large, no such file, has other points than these, or a number is not finite or too large.
    """
    if len(text) > LONGEST_CHARACTERS:
        raise ValueError(f"expected a file of at most {LONGEST_CHARACTERS} characters, got {len(text)}")
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise ValueError("expected a JSON file of points, got something else") from None
    if not isinstance(found, Mapping) or found.get("format") != FORMAT or not isinstance(found.get("points"), Mapping):
        raise ValueError(f"expected a JSON object of the format {FORMAT!r} with points, got another one")
    if found.get("version") != VERSION or found.get("unit") != UNIT:
        raise ValueError(f"expected version {VERSION} in {UNIT}, got another version or unit")
    points = found["points"]
    if len(points) != len(names):
        raise ValueError(f"expected a model of {len(names)} points, got {len(points)}")
    missing = [name for name in names if name not in points]
    if missing:
        raise ValueError(f"expected the points {', '.join(names)}, got none for {', '.join(missing)}")
    return np.array([_point(name, points[name]) for name in names])


def _point(name: str, raw: object) -> tuple[float, ...]:
    numbers = raw if isinstance(raw, list) else []
    if len(numbers) != 3 or not all(isinstance(one, int | float) and not isinstance(one, bool) for one in numbers):
        raise ValueError(f"expected three numbers (x, y, z) for {name}")
    # A whole number of JSON may be too large to be a float; comparisons with NaN are false.
    if not all(-LARGEST_MM <= one <= LARGEST_MM for one in numbers):
        raise ValueError(f"expected numbers of -{LARGEST_MM:g} to {LARGEST_MM:g} mm for {name}")
    return tuple(float(one) for one in numbers)
