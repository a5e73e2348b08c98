"""Charts: the meaning of the numbers of a recorded state, and its motion in the body's own frame.

A tracker records a state (a place, a heading, a bend) in the picture's coordinates. Whether a body accelerates along or
across itself does not depend on where it is and which way it faces, so a model learned from one track holds for another
only in the body's own frame. A `Chart` names the numbers of a state that are the place, the heading that turns the
frame, further angles, and plain numbers. Two functions use it:

- `changes`: changes of motion and shape from frame to frame in a recorded track, in the body's frame;
- `advance`: the inverse: it moves particles by drawn changes.

Eqs 10-14, 16 and 17 of Mitsugami, Kakusho and Minoh 2009. Their eq. 14 turns an acceleration of the picture into the
body's frame, and eqs 16 and 17 add it to a velocity that turns with the body, so a turn counts twice: an even circular
swim has an acceleration across of speed times turn. There are three readings of these equations:

- "document": as it is written;
- "increments": the changes of the velocity in the body's frame are learned, and added to it;
- "world": learned as written, but the velocity keeps its direction in the picture when the body turns.

A body without a heading, such as a ball, has two others: its frame is that of the picture ("fixed"), or turns with the
direction in which it moved last ("motion").
"""

import math
from typing import Annotated, Literal, Self, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field, model_validator

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.numerics.compiled import compiled

Reading: TypeAlias = Literal["document", "increments", "world", "fixed", "motion"]
"""The frame in which the changes of a place are learned and added."""

FIXED, HEADING, WORLD, MOTION = range(4)
WAYS: dict[Reading, int] = {
    "document": HEADING,
    "increments": HEADING,
    "world": WORLD,
    "fixed": FIXED,
    "motion": MOTION,
}
"""How `advance` moves a place; "document" and "increments" differ only in learning."""

Name: TypeAlias = Annotated[str, Field(min_length=1, max_length=32)]


class Chart(BaseModel):
    """Names of the d numbers of a recorded state, in this order: place, heading, angles, numbers.

    Attributes:
        place: Names of the coordinates of the place; two, three, or none.
        heading: Name of the angle by which the body is turned in the plane of the first two coordinates, from the first
            towards the second, rad; empty without one.
        angles: Names of further angles, rad.
        numbers: Names of pure numbers.
        unit: Unit of the place.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    place: tuple[Name, ...] = ()
    heading: Annotated[str, Field(max_length=32)] = ""
    angles: Annotated[tuple[Name, ...], Field(max_length=32)] = ()
    numbers: Annotated[tuple[Name, ...], Field(max_length=32)] = ()
    unit: Annotated[str, Field(max_length=16)] = "px"

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if len(self.place) not in {0, 2, 3}:
            raise ValueError(f"expected a place of 0, 2 or 3 coordinates, got {', '.join(self.place)}")
        if self.heading and not self.place:
            raise ValueError(f"expected a place along with the heading {self.heading}; without one it is an angle")
        if not self.names or len(set(self.names)) < len(self.names):
            raise ValueError(f"expected names that differ, got {', '.join(self.names) or 'none'}")
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers of a recorded state, (d,)."""
        return (*self.place, *((self.heading,) if self.heading else ()), *self.angles, *self.numbers)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the numbers of a recorded state, (d,)."""
        return (*(self.unit for _ in self.place), *("rad" for _ in range(self.turning)), *("" for _ in self.numbers))

    @property
    def turning(self) -> int:
        """Number of angles, including the heading."""
        return bool(self.heading) + len(self.angles)

    @property
    def change_names(self) -> tuple[str, ...]:
        """Names of the k = d changes: accelerations of the place, and first differences of all else."""
        return tuple(f"{name}''" if name in self.place else f"{name}'" for name in self.names)

    @property
    def change_units(self) -> tuple[str, ...]:
        """Units of the changes."""
        places = len(self.place)
        return tuple(f"{unit}/frame²" if i < places else f"{unit}/frame" for i, unit in enumerate(self.units))

    @property
    def readings(self) -> tuple[Reading, ...]:
        """The readings that make sense for it, the usual one first."""
        if self.heading:
            return "document", "increments", "world"
        return ("fixed", "motion") if self.place else ("fixed",)

    def check_reading(self, reading: Reading) -> None:
        """Refuse a reading that makes no sense for it.

        Raises:
            ValueError: See above.
        """
        if reading not in self.readings:
            raise ValueError(
                f"expected a reading {' or '.join(self.readings)} of {', '.join(self.names)}, got {reading}"
            )


def changes(states: ArrayLike, chart: Chart, reading: Reading) -> Floats:
    """Return how motion and shape change from frame to frame, (n, k).

    Args:
        states: (T, d) recorded states; a row with a number that is not finite is a gap, and no change across it is
            learned. Angles may jump by full turns.
        chart: Meaning of the numbers.
        reading: Frame in which a place changes.

    Returns:
        The changes of all frames with two known frames before them, or with one if the chart has no place.

    Raises:
        ValueError: The states have another number of columns, or the reading makes no sense for the chart.
    """
    chart.check_reading(reading)
    rows, known = _rows(states, chart)
    places, turn = len(chart.place), _differences(rows, chart)[:, len(chart.place) :]
    if not places:
        return turn[known[1:] & known[:-1]]
    kept = np.flatnonzero(known[2:] & known[1:-1] & known[:-2]) + 2
    velocity = np.diff(rows[:, :places], axis=0)
    now, before = velocity[kept - 1], velocity[kept - 2]
    accelerations = now - before
    if reading == "motion":
        cosine, sine = _direction(before)
        accelerations = _turn(accelerations, cosine, -sine)
    elif reading == "increments":
        accelerations = _turn_by(now, -rows[kept, places]) - _turn_by(before, -rows[kept - 1, places])
    elif reading != "fixed":
        accelerations = _turn_by(accelerations, -rows[kept, places])
    return np.hstack([accelerations, turn[kept - 1]])


def steps(states: ArrayLike, chart: Chart) -> Floats:
    """Return the first differences of recorded states (T, d), in the picture's frame, (n, d); see `changes`."""
    rows, known = _rows(states, chart)
    return _differences(rows, chart)[known[1:] & known[:-1]]


def body_velocity(velocity: ArrayLike, heading: float) -> Floats:
    """Return a velocity (2,) or (3,) of the picture's frame in that of a body turned by `heading`, rad."""
    turned: Floats = _turn_by(np.array([velocity], np.float64), np.array([-heading]))[0]
    return turned


def advance_states(
    states: Floats,
    ancestors: Ints,
    normals: Floats,
    root: Floats,
    mean: Floats,
    chart: Chart,
    reading: Reading,
) -> Floats:
    """Return the ancestors' states moved on by drawn changes; see `advance`, which this calls.

    Raises:
        ValueError: The states do not fit the chart, or the reading makes no sense for it.
    """
    chart.check_reading(reading)
    wanted = len(chart.names) + len(chart.place)
    if states.shape[1] != wanted or root.shape != (len(chart.names),) * 2 or len(normals) != len(root):
        raise ValueError(
            f"expected particles of {wanted} numbers and {len(chart.names)} changes, got {states.shape[1]}, a root of "
            f"{root.shape} and {len(normals)}"
        )
    return advance(np.asfortranarray(states), ancestors, normals, root, mean, len(chart.place), WAYS[reading])


@compiled
def advance(
    states: Floats,
    ancestors: Ints,
    normals: Floats,
    root: Floats,
    mean: Floats,
    places: int,
    way: int,
) -> Floats:
    """Return the ancestors' states, moved by drawn changes (eqs 16-18), (n, D), each coordinate contiguous in memory.

    A particle is the place (p), its velocity (p) in the frame of the reading, then heading, angles and numbers. With a
    heading the velocity is in the body's frame in all three readings: in "world" it is turned back by the body's turn,
    which keeps its direction in the picture. The new velocity moves the place, in the new frame.

    Args:
        states: (N, D), D = p + k.
        ancestors: (n,) their indices.
        normals: e, (k, n) independent N(0, 1) numbers.
        root: L, (k, k), lower triangular, of L L^T = the covariance of the changes.
        mean: (k,) of the changes.
        places: p, 0, 2 or 3.
        way: How a place is moved, one of `WAYS`.
    """
    count, dimension, size = ancestors.shape[0], states.shape[1], root.shape[0]
    moved = np.empty((dimension, count))
    drawn = np.empty((size, count))
    for i in range(size):
        drawn[i] = mean[i]
        for j in range(i + 1):
            drawn[i] += root[i, j] * normals[j]
    for i in range(places, size):
        for n in range(count):
            moved[places + i, n] = states[ancestors[n], places + i] + drawn[i, n]
    if places == 0:
        return moved.T
    for n in range(count):
        parent = ancestors[n]
        turn = drawn[places, n] if way == WORLD else 0.0
        x, y = _velocity(states[parent, places], states[parent, places + 1], drawn[0, n], drawn[1, n], turn, way)
        moved[places, n], moved[places + 1, n] = x, y
        if way in (HEADING, WORLD):
            cosine, sine = np.cos(moved[2 * places, n]), np.sin(moved[2 * places, n])
            x, y = cosine * x - sine * y, sine * x + cosine * y
        moved[0, n], moved[1, n] = states[parent, 0] + x, states[parent, 1] + y
        if places == 3:
            moved[5, n] = states[parent, 5] + drawn[2, n]
            moved[2, n] = states[parent, 2] + moved[5, n]
    return moved.T


@compiled
def _velocity(x: float, y: float, faster: float, aside: float, turn: float, way: int) -> tuple[float, float]:
    """Return a velocity (x, y) changed by (faster, aside), in the frame of a way; `turn` is how far the body turns."""
    if way == WORLD:
        cosine, sine = np.cos(turn), np.sin(turn)
        x, y = cosine * x + sine * y, cosine * y - sine * x
    elif way == MOTION:
        speed = np.sqrt(x * x + y * y)
        if speed > 0.0:
            faster, aside = (x * faster - y * aside) / speed, (y * faster + x * aside) / speed
    return x + faster, y + aside


def _rows(states: ArrayLike, chart: Chart) -> tuple[Floats, Bools]:
    """Return the states, NaN where they are not known, and which rows are known."""
    rows = np.array(states, np.float64)
    if rows.ndim != 2 or rows.shape[1] != len(chart.names):
        raise ValueError(
            f"expected states of {len(chart.names)} numbers ({', '.join(chart.names)}), got shape {rows.shape}"
        )
    known = np.asarray(np.isfinite(rows).all(axis=1), np.bool_)
    rows[~known] = np.nan
    return rows, known


def _differences(rows: Floats, chart: Chart) -> Floats:
    """Return first differences (T - 1, d), those of angles within half a turn."""
    differences = np.diff(rows, axis=0)
    angles = slice(len(chart.place), len(chart.place) + chart.turning)
    differences[:, angles] = (differences[:, angles] + np.pi) % (2 * np.pi) - np.pi
    return differences


def _direction(velocities: Floats) -> tuple[Floats, Floats]:
    """Return cosine and sine (n,) of the direction of velocities (n, p); that of the first axis for a body at rest."""
    x, y = velocities[:, 0], velocities[:, 1]
    speed = np.sqrt(x * x + y * y)
    moving = speed > 0.0
    divisor = np.where(moving, speed, 1.0)
    return np.where(moving, x / divisor, 1.0), np.where(moving, y / divisor, 0.0)


def _turn_by(vectors: Floats, angles: Floats) -> Floats:
    # The C library's, as in compiled loops: NumPy's differ by processor.
    cosine, sine = (np.array([function(angle) for angle in angles]) for function in (math.cos, math.sin))
    return _turn(vectors, cosine, sine)


def _turn(vectors: Floats, cosine: Floats, sine: Floats) -> Floats:
    """Return vectors (n, p) turned in the plane of their first two coordinates by angles of these (n,)."""
    x, y = vectors[:, 0], vectors[:, 1]
    turned = vectors.copy()
    turned[:, 0], turned[:, 1] = cosine * x - sine * y, sine * x + cosine * y
    return turned
