"""Worlds: spaces of their own beside the picture, declared as data.

A drawing lives in the picture's space. What has a shape of its own, such as the model of a head, is better seen in
another one as well: in its own coordinates and unit, at rest while the picture moves, from all sides. An experiment
declares its worlds, as it declares its layers; each drawing then says what there is in them.

A world is right-handed. It is seen without perspective, so that equal lengths look equal and a ruler holds everywhere:
what lies within `radius` of its middle is seen from each side and at one scale.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["FRONT_SIDE_TOP", "Viewpoint", "World"]

Vector: TypeAlias = tuple[float, float, float]

RULERS = (5.0, 2.0, 1.0)
"""A ruler's length is one of these times a power of ten."""
RULER_SHARE = 0.5
"""The longest ruler, as a share of the world's radius."""
SQUARE = 1e-6
"""How far from a right angle `front` and `up` may be, as a cosine."""


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """A side from which to look at a world.

    Attributes:
        name: Name in commands and addresses.
        title: On its button.
        azimuth_deg: How far to the right of the front the viewer stands, going round the upright axis.
        elevation_deg: How far above the middle, -90 to 90.

    Raises:
        ValueError: An angle is not finite, or the elevation is beyond the poles.
    """

    name: str
    title: str
    azimuth_deg: float
    elevation_deg: float

    def __post_init__(self) -> None:
        """Refuse a viewpoint that is nowhere."""
        if not (np.isfinite(self.azimuth_deg) and -90.0 <= self.elevation_deg <= 90.0):
            raise ValueError(
                f"expected a finite azimuth and an elevation of -90 to 90 degrees, got {self.azimuth_deg} and "
                f"{self.elevation_deg}"
            )


FRONT_SIDE_TOP = (
    Viewpoint("front", "Front", 0.0, 0.0),
    Viewpoint("side", "Side", 60.0, 15.0),
    Viewpoint("top", "Top", 0.0, 90.0),
)
"""Three viewpoints that suit most objects."""


@dataclass(frozen=True)
class World:
    """A space with a unit, an extent, an upright axis and sides from which to look at it.

    Attributes:
        name: Name in drawings.
        title: What it is called on the screen.
        unit: Of its coordinates, such as "mm".
        middle: (x, y, z) around which it turns.
        radius: How far from there it extends.
        up: Direction that is shown upwards.
        front: Direction from the middle towards somebody who looks from the front, at right angles to `up`.
        viewpoints: Where to look from; the first is the one to begin with.

    Raises:
        ValueError: A number is not finite, the radius is not positive, `up` and `front` are not at right angles, or
            there is no viewpoint or two of one name.
    """

    name: str
    title: str
    unit: str
    radius: float
    middle: Vector = (0.0, 0.0, 0.0)
    up: Vector = (0.0, 1.0, 0.0)
    front: Vector = (0.0, 0.0, 1.0)
    viewpoints: tuple[Viewpoint, ...] = FRONT_SIDE_TOP

    def __post_init__(self) -> None:
        """Refuse a world that cannot be shown."""
        if not (np.isfinite([*self.middle, *self.up, *self.front]).all() and 0.0 < self.radius < np.inf):
            raise ValueError(f"the world {self.name!r} must have a finite place and a radius above 0")
        lengths = float(np.linalg.norm(self.up) * np.linalg.norm(self.front))
        if lengths <= 0.0 or abs(float(np.dot(self.up, self.front))) > SQUARE * lengths:
            raise ValueError(f"up and front must be at right angles, got {self.up} and {self.front}")
        names = [viewpoint.name for viewpoint in self.viewpoints]
        if not names or len(set(names)) < len(names):
            raise ValueError(f"expected viewpoints with different names, got {', '.join(names) or 'none'}")

    @property
    def ruler(self) -> float:
        """Length of the ruler that is drawn beside it, a round number in its unit."""
        longest = RULER_SHARE * self.radius
        power = 10.0 ** np.floor(np.log10(longest))
        return float(next(length for length in RULERS if length * power <= longest * (1.0 + 1e-9)) * power)

    def turn(self, azimuth_deg: float, elevation_deg: float) -> NDArray[np.float64]:
        """Return the directions (3, 3) that a viewer sees to the right, downwards and towards himself, as rows."""
        front, up, right = self._axes
        azimuth, elevation = np.deg2rad((azimuth_deg, elevation_deg))
        level = np.cos(azimuth) * front + np.sin(azimuth) * right
        towards = np.cos(elevation) * level + np.sin(elevation) * up
        across = np.cos(azimuth) * right - np.sin(azimuth) * front
        return np.stack((across, np.cross(across, towards), towards))

    @cached_property
    def _axes(self) -> NDArray[np.float64]:
        front, up = (np.array(axis) / np.linalg.norm(axis) for axis in (self.front, self.up))
        return np.stack((front, up, np.cross(up, front)))
