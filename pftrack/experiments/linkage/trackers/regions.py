"""Regions of poses of a chain, and how its coordinates are those of an estimate.

Regions are in (S theta*_1..3, r_1..3), in space (S omega, S theta*_2, S theta*_3, r_1..3): directions rather than
angles of joints, since a link shows nothing but its own, and px throughout, since a trace adds squares of all
coordinates. The root in space is no coordinate: it is seen itself, and no link's observation depends on it.

Source: Shimada 1997, section 5.5, eqs. 5.38 to 5.46; the common unit is our own (docs/methods/linkages.md).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.matrices import product
from pftrack.experiments.linkage.sets.frame import Known
from pftrack.experiments.linkage.sets.regions import CENTRE, HIGH, LOW, SHAPE, region_of
from pftrack.experiments.linkage.sets.regions import contains as in_region
from pftrack.experiments.linkage.sets.strips import SLACK
from pftrack.experiments.linkage.shape import LINKS, Bounds
from pftrack.experiments.linkage.trackers.state import LinkageState
from pftrack.filters.particles import ParticleSet

__all__ = ["ROOT", "Region", "begin", "box_of", "contains", "known_bounds", "union"]

ROOT = slice(3, 5)
"""Where the root is in an estimate in space."""

TURNS = 3

SLACK_PX = 1e-6
"""Of the root's box, for rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """An ellipsoid and its guides.

    Attributes:
        array: (n + 3, n), n = 6 in the plane and 8 in space, see `pftrack.experiments.linkage.sets.regions`.
        scale: S, px/rad, of the angles among its coordinates.
        has_ellipsoid: Whether there is one; if not, its centre is the middle of the guides, and its shape 0.
    """

    array: NDArray[np.float64]
    scale: float
    has_ellipsoid: bool

    @property
    def pose(self) -> NDArray[np.float64]:
        """(6,) centre: the directions theta*_1..3, rad, and the lengths r_1..3, px."""
        return self._six(self.array[CENTRE])

    @property
    def low(self) -> NDArray[np.float64]:
        """(6,) low guides of the same, rad and px."""
        return self._six(self.array[LOW])

    @property
    def high(self) -> NDArray[np.float64]:
        """(6,) high guides of the same, rad and px."""
        return self._six(self.array[HIGH])

    @property
    def shape(self) -> NDArray[np.float64]:
        """(6, 6) shape matrix of the ellipsoid's extent in the same, rad and px; 0 without an ellipsoid."""
        whole = self.array[SHAPE:] / np.multiply.outer(self._units(), self._units())
        padded = np.zeros((2 * LINKS, 2 * LINKS))
        size = 2 * LINKS - self.in_space
        padded[-size:, -size:] = whole[-size:, -size:]
        return padded

    @property
    def in_space(self) -> bool:
        """Whether it is of a chain in space."""
        return bool(self.array.shape[1] != 2 * LINKS)

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        return 128 + self.array.nbytes

    def arrays(self) -> Mapping[str, NDArray[np.float64]]:
        """Return its array, and the scale of the angles in it."""
        return {"regions": self.array, "scale": np.array(self.scale)}

    def rescale(self, scale: float) -> "Region":
        """Return the same region with another scale of its angles."""
        if scale == self.scale:
            return self
        factor = _units(self.array.shape[1], scale) / self._units()
        array = self.array * factor
        array[SHAPE:] *= factor[:, None]
        return replace(self, array=array, scale=scale)

    def _units(self) -> NDArray[np.float64]:
        return _units(self.array.shape[1], self.scale)

    def _six(self, row: NDArray[np.float64]) -> NDArray[np.float64]:
        told = row / self._units()
        return np.concatenate([[0.0], told[TURNS:]]) if self.in_space else told


def begin(
    box: tuple[NDArray[np.float64], NDArray[np.float64]],
    scale: float,
    *,
    directions: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
    inscribed: bool = False,
) -> Region:
    """Return the region of a box of estimates.

    Args:
        box: Its least and greatest estimate, (6,) in the plane or (11,) in space.
        scale: S, px/rad.
        directions: (3,) least and greatest directions, rad, where more is known of them than the box says.
        inscribed: Whether the ellipsoid lies in the box, as Shimada may be read; it does not hold all.
    """
    low, high = (_coordinates(end) for end in box)
    turn = _cumulative(len(low))
    units = _units(len(low), scale)
    half = 0.5 * (high - low) * units + SLACK
    shape = np.diag(half * half if inscribed else half * half.sum())
    shape = product(product(turn, shape), turn.T)
    # All entries of the sum are 0 or 1, so that the least is the sum of the least.
    low, high = product(turn, low), product(turn, high)
    if directions is not None:
        here = slice(TURNS, TURNS + LINKS - 1) if len(low) > 2 * LINKS else slice(0, LINKS)
        least, most = (end[-(here.stop - here.start) :] for end in directions)
        low[here] = np.clip(least, low[here], high[here])
        high[here] = np.clip(most, low[here], high[here])
        return Region(region_of(low * units, high * units), scale, has_ellipsoid=True)
    return Region(region_of(low * units, high * units, shape), scale, has_ellipsoid=True)


def union(regions: Sequence[Region]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the least and greatest (6,) directions, rad, and lengths, px, of some regions."""
    return np.min([region.low for region in regions], axis=0), np.max([region.high for region in regions], axis=0)


def box_of(
    regions: Sequence[Region], bounds: Bounds, root: tuple[NDArray[np.float64], NDArray[np.float64]] | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the least and the greatest estimate, (6,) or (11,), that some regions hold.

    Args:
        regions: At least one.
        bounds: Of joints, which the differences of directions may exceed.
        root: (2,) least and greatest place of the root, in space.
    """
    low, high = union(regions)
    least, most = low.copy(), high.copy()
    least[1:LINKS] -= high[: LINKS - 1]
    most[1:LINKS] -= low[: LINKS - 1]
    first = 0 if root is None else 1
    within = slice(first, LINKS)
    least[within] = np.minimum(np.maximum(least, (*bounds.joint_low, 0, 0, 0))[within], most[within])
    most[within] = np.maximum(np.minimum(most, (*bounds.joint_high, 0, 0, 0))[within], least[within])
    if root is None:
        return least, most
    units = regions[0].scale
    turns_low = np.min([region.array[LOW, :TURNS] for region in regions], axis=0) / units
    turns_high = np.max([region.array[HIGH, :TURNS] for region in regions], axis=0) / units
    return np.concatenate([turns_low, root[0], least]), np.concatenate([turns_high, root[1], most])


def contains(state: LinkageState, position: NDArray[np.float64]) -> bool:
    """Return whether a state's regions hold (theta, r) or (omega, t, theta, r), (6,) or (11,), rad and px.

    One of them must hold the angles and lengths, and the root's box the root.
    """
    if isinstance(state.belief, ParticleSet):
        return False
    off = np.maximum(state.low - position, position - state.high)
    if state.in_space and np.any(off[ROOT] > SLACK_PX):
        return False
    point = _coordinates(position)
    point = product(_cumulative(len(point)), point)
    return any(
        isinstance(member, Region)
        and in_region(member.array, point * _units(len(point), member.scale), ellipsoids=member.has_ellipsoid)
        for member in state.belief.members
    )


@lru_cache(maxsize=64)
def known_bounds(bounds: Bounds, scale: float, motion_rad: float, *, in_space: bool) -> Known:
    """Return the bounds of joints and lengths as inequalities of a region's coordinates, and how far these may move."""
    size = 2 * LINKS + 2 if in_space else 2 * LINKS
    constraints = bounds.constraints(in_space=in_space)
    joints = np.zeros((len(constraints.rows), size))
    joints[:, -2 * LINKS + in_space :] = constraints.rows[:, int(in_space) :]
    # theta = D theta*: a row of joint angles, a_k theta_k, is (a_k - a_{k+1}) theta*_k.
    first = TURNS if in_space else 0
    rows = joints.copy()
    rows[:, first : size - LINKS - 1] -= joints[:, first + 1 : size - LINKS]
    angles = size - LINKS
    return Known(rows / _units(size, scale), constraints.low, constraints.high, angles, scale * motion_rad)


def _coordinates(position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (theta, r) of an estimate in the plane, (omega, theta_2, theta_3, r) of one in space."""
    return position if len(position) == 2 * LINKS else np.concatenate([position[:TURNS], position[TURNS + 3 :]])


def _cumulative(size: int) -> NDArray[np.float64]:
    """Return the matrix (n, n) that adds up the angles of joints, and leaves the rest."""
    turn = np.eye(size)
    first = TURNS if size > 2 * LINKS else 0
    for row in range(first, size - LINKS):
        turn[row, first : row + 1] = 1.0
    return turn


def _units(size: int, scale: float) -> NDArray[np.float64]:
    """Return by what coordinates in rad and px are multiplied, (n,)."""
    return np.array([scale] * (size - LINKS) + [1.0] * LINKS)
