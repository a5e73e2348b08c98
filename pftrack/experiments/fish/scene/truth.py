"""The truth of a frame in which a fish is seen."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Target
from pftrack.experiments.fish.shape import GOLDFISH, FishShape, inside

__all__ = ["FishTarget"]


@dataclass(frozen=True, slots=True)
class FishTarget(Target):
    """Where a fish truly is: `position` is the centre of its body's ellipse, px.

    Attributes:
        theta: Direction to the head, rad.
        phi: Bend of the tail, rad.
        velocity: (2,) of the centre, px/frame; zero where it is not known, as on a recording that is marked.
        shape: Of the fish.
    """

    theta: float = 0.0
    phi: float = 0.0
    velocity: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    shape: FishShape = GOLDFISH

    @classmethod
    def of(
        cls, pose: NDArray[np.float64], shape: FishShape, velocity: NDArray[np.float64], *, hidden: bool | None = False
    ) -> Self:
        """Return the truth of a pose (4,), with the box around the body without its tail, in whose middle it is."""
        cosine, sine = float(np.cos(pose[2])), float(np.sin(pose[2]))
        width = 2.0 * float(np.hypot(shape.half_length * cosine, shape.half_width * sine))
        height = 2.0 * float(np.hypot(shape.half_length * sine, shape.half_width * cosine))
        return cls(
            position=pose[:2],
            size=max(width, height),
            hidden=hidden,
            extent=(width, height),
            theta=float(pose[2]),
            phi=float(pose[3]),
            velocity=velocity,
            shape=shape,
        )

    @property
    def pose(self) -> NDArray[np.float64]:
        """(4,) (a, b, theta, phi) in px and rad."""
        return np.append(self.position, (self.theta, self.phi))

    def holds(self, point: NDArray[np.float64]) -> bool:
        """Return whether a point (2,) lies within the silhouette."""
        return inside(point, self.pose, self.shape)
