"""What is true of a chain of three links, and where its points are seen.

The camera is orthographic. In the plane it has one line of pixels: a point's image coordinate is its first one, and the
second is its depth, which is not seen. In space it sees the first two coordinates. An absolute angle of 0 lies parallel
to the image.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Target
from pftrack.core.numerics.matrices import product
from pftrack.core.numerics.trigonometry import sines_cosines

__all__ = ["NAMES", "REFERENCE_RAD", "LinkageTarget", "attitude", "in_degrees", "in_radians", "places"]

NAMES = ("root", "second joint", "third joint", "tip")
"""Of the points of a chain; its first joint is the root."""

REFERENCE_RAD = np.array([0.5, -0.4, 0.2])
"""The reference attitude of the simulated chain in space, as a rotation vector."""

RAD_IN_DEG = 180.0 / np.pi

SMALL = 1e-12
"""Angle, rad, below which a rotation is none."""


@dataclass(frozen=True, slots=True)
class LinkageTarget(Target):
    """A chain of three links; `position` is (theta, r), in space (omega, t, theta, r), angles in degrees.

    In the plane its root is fixed at the origin.

    Attributes:
        theta: (3,) angles of the joints, rad, each relative to the link before; in space the first is 0.
        r: (3,) lengths of the links, px.
        omega: (3,) attitude relative to the reference, a rotation vector in rad; None in the plane.
        t: (2,) where the root is, from the origin, px; None in the plane.
        reference: (3, 3) the reference attitude; None in the plane.
        origin_px: (2,) where the origin of image coordinates is in the picture.
    """

    theta: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    r: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    omega: NDArray[np.float64] | None = None
    t: NDArray[np.float64] | None = None
    reference: NDArray[np.float64] | None = None
    origin_px: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))

    @property
    def is_spatial(self) -> bool:
        """Whether it moves in space rather than in a plane."""
        return self.omega is not None


def in_degrees(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (theta, r), (6,), or (omega, t, theta, r), (11,), with the angles in degrees instead of rad."""
    return np.asarray(numbers * _degrees(len(numbers)))


def in_radians(told: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the reverse of `in_degrees`."""
    return np.asarray(told / _degrees(len(told)))


def _degrees(count: int) -> NDArray[np.float64]:
    """Return what turns the numbers of an estimate into degrees where they are angles."""
    factors = np.ones(count)
    factors[-6:-3] = RAD_IN_DEG
    if count > 6:
        factors[:3] = RAD_IN_DEG
    return factors


def attitude(omega: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation (3, 3) of a rotation vector (3,) in rad (Rodrigues)."""
    angle = float(np.sqrt(np.square(omega).sum()))
    if angle < SMALL:
        return np.eye(3)
    x, y, z = omega / angle
    sine, cosine = (float(one[0]) for one in sines_cosines(np.array([angle])))
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + sine * across + (1.0 - cosine) * product(across, across)


def places(target: LinkageTarget) -> NDArray[np.float64]:
    """Return where root, joints and tip are, (4, 3): column and row from the origin, and depth, px.

    In the plane the row is 0, so that the depth is the third coordinate in either case.
    """
    sines, cosines = sines_cosines(np.cumsum(target.theta))
    steps = target.r[:, None] * np.stack([cosines, sines, np.zeros(3)], axis=1)
    chain = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    if target.omega is None or target.t is None or target.reference is None:
        return np.asarray(chain[:, [0, 2, 1]])
    turn = product(target.reference, attitude(target.omega))
    return np.asarray(product(chain, turn.T) + np.append(target.t, 0.0))
