"""Files of models, for other programs: surfaces (OBJ) and named points (JSON).

Both state their unit, the millimetre.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats

# Named points as JSON describe a model, with unit and standard deviations, and can be read back:
#
#     {"format": "pftrack points", "version": 1, "unit": "mm", "points": {"nose": [0.0, 38.1, -26.2], ...}, ...}
#
# Files that are read may come from strangers. A file must be small, in the present format, in mm, and contain the
# requested names, each with three finite numbers of a plausible size for a body; everything else is ignored.

FORMAT, POINTS_VERSION, UNIT = "pftrack points", 1, "mm"
LONGEST_CHARACTERS = 100_000
LARGEST_MM = 10_000.0
DECIMALS = 4


def as_json(names: Sequence[str], points_mm: Floats, **said: Any) -> bytes:  # noqa: ANN401 - JSON
    """Return points (n, 3) by name, and further entries, as a JSON object.

    Args:
        names: (n,).
        points_mm: (n, 3).
        said: Further entries, JSON values.
    """
    head = {"format": FORMAT, "version": POINTS_VERSION, "unit": UNIT}
    points = dict(zip(names, np.round(points_mm, DECIMALS).tolist(), strict=True))
    return (json.dumps({**head, "points": points, **said}, indent=1, ensure_ascii=False) + "\n").encode()


def read_points(text: str | bytes, names: Sequence[str]) -> Floats:
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
    if found.get("version") != POINTS_VERSION or found.get("unit") != UNIT:
        raise ValueError(f"expected version {POINTS_VERSION} in {UNIT}, got another version or unit")
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


# A head's own frame has y down and z away from the camera, as pictures have it. Other programs have y up and look along
# -z, so a surface is turned by half a turn about x before it is written. Its triangles run
# counterclockwise as seen from outside, as the format has it. Numbers have four decimals, a ten-thousandth of a mm.

HALF_TURN: Floats = np.array([1.0, -1.0, -1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A triangle mesh with colours.

    Attributes:
        title: Title of the model, one line.
        vertices_mm: (n, 3).
        faces: (m, 3) numbers of vertices, counterclockwise as seen from outside.
        colours: (n, 3) RGB, 0..255.

    Raises:
        ValueError: There is not one colour for each vertex, a vertex is not finite, or a face has one that is not.
    """

    title: str
    vertices_mm: Floats
    faces: NDArray[np.int32]
    colours: NDArray[np.uint8]

    def __post_init__(self) -> None:
        """Refuse what no program could read back."""
        count = len(self.vertices_mm)
        if self.colours.shape != (count, 3):
            raise ValueError(f"expected colours of shape {(count, 3)}, got {self.colours.shape}")
        if not np.isfinite(self.vertices_mm).all():
            raise ValueError("expected finite vertices, got one that is not")
        if len(self.faces) and not 0 <= self.faces.min() <= self.faces.max() < count:
            raise ValueError(f"expected faces of vertices 0 to {count - 1}, got {self.faces.min()}, {self.faces.max()}")


def upright(points_mm: Floats) -> Floats:
    """Return points (n, 3) of a head's frame as other programs have them, x to the right, y up, z to the viewer."""
    turned: Floats = HALF_TURN * points_mm
    return turned


def as_obj(surface: Surface) -> bytes:
    """Return a surface as OBJ, in mm, with a colour after each vertex, which not all programs read."""
    lines = [f"# {surface.title}", "# unit: mm"]
    rows = zip(surface.vertices_mm.tolist(), (surface.colours / 255.0).tolist(), strict=True)
    lines += [f"v {x:.4f} {y:.4f} {z:.4f} {r:.4f} {g:.4f} {b:.4f}" for (x, y, z), (r, g, b) in rows]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in surface.faces.tolist()]
    return ("\n".join(lines) + "\n").encode()
