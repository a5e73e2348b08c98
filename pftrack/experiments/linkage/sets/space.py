"""Possible places in space of a link with a given image length: a rigorous cover by cells of attitude and direction.

A link of length r in the direction theta of a plane that a rotation turns shows r a_k, k = 1, 2, where a is the image
of its unit vector: a_k = R_k1 cos theta + R_k2 sin theta. The cells are those of a grid over the rotation vector and
theta. Over a cell a_k stays within its slopes times the half widths, plus 3/2 of their squares for the curvature (no
second derivative along a straight way is above 3); so no fitting pose is outside the cells. Shimada's points of a grid
can miss poses between them.

A strip for each image coordinate, across the gradient of the image at the middle of the cells, holds all of them.

Source: Shimada 1997, section 5.2, eqs. 5.22 to 5.25, and section 5.5, with cells in the place of points.
"""

from typing import NamedTuple, TypeAlias

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.geometry import matrix, right_jacobian
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import factorise, multiply, substitute
from pftrack.experiments.linkage.model import LINKS, POINT_ROWS
from pftrack.experiments.linkage.sets.cells import MARGIN, Grid, below, find_extents, find_runs, shrink_to_cells
from pftrack.experiments.linkage.sets.ellipsoids import SLACK
from pftrack.experiments.linkage.sets.regions import CENTRE, HIGH, LOW, SHAPE, Ways, apply_strip, settle

# Hard bounds of errors bound the image of each link in space for every kind of observation. A measured point lies in a
# square, and a link that is seen as a line has both ends in the strip along it. So each point of the chain lies in a
# polygon: a joint, where the strips of its two links cross. The difference of a link's ends lies within the difference
# of the extents of their polygons, along the line and across it. Across the line the width is twice the bound of the
# errors; along it the image is bounded if another line or a point bounds both ends.

FAR_PX = 1e6
"""Half the side of the square that represents the plane."""

SLACK_PX = 1e-6
"""Widening of strips against rounding."""

Strip: TypeAlias = tuple[Floats, float, float]
"""(n, low, high) of low <= n . p <= high, with n (2,) a unit vector."""


def intersect(strips: list[Strip]) -> Floats:
    """Return the corners (k, 2) of all that is in every strip and in the square; none if nothing is."""
    corners = FAR_PX * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    for normal, low, high in strips:
        corners = _clip(corners, normal, high + SLACK_PX)
        corners = _clip(corners, -normal, SLACK_PX - low)
    return corners


def extent(corners: Floats, direction: Floats) -> tuple[float, float]:
    """Return the least and the greatest of direction . p over a polygon; infinite both where it has no end on a side.

    Args:
        corners: (k, 2), at least one.
        direction: (2,) unit vector.
    """
    along = (corners * direction).sum(axis=1)
    low, high = float(along.min()), float(along.max())
    return (low, high) if max(-low, high) < 0.5 * FAR_PX else (-np.inf, np.inf)


def _clip(corners: Floats, normal: Floats, limit: float) -> Floats:
    """Return the corners of the part of a convex polygon in which n . p <= limit (Sutherland and Hodgman 1974)."""
    beyond = (corners * normal).sum(axis=1) - limit
    kept: list[Floats] = []
    for k in range(len(corners)):
        one, other = beyond[k - 1], beyond[k]
        if (one > 0.0) != (other > 0.0):
            kept.append(corners[k - 1] + one / (one - other) * (corners[k] - corners[k - 1]))
        if other <= 0.0:
            kept.append(corners[k])
    return np.array(kept).reshape(-1, 2)


AXES = np.eye(2)

Extents: TypeAlias = tuple[Floats, Floats]
"""Middles (4, 2) and half extents (4, 2) of where points are, along the axes of the image; infinite halves are none."""


class LinkImage(NamedTuple):
    """The end of a link less its beginning, in the image.

    Attributes:
        turn: (3, 3) rotation about the line of sight that makes the two directions along which it is bounded the axes.
        middle: (2,) along these, px.
        bound: (2,) of the distance from that, px; infinite where nothing is known, -infinite where nothing is possible.
    """

    turn: Floats
    middle: Floats
    bound: Floats


def link_images(seen: Floats, bound: float) -> list[LinkImage | None]:
    """Return what is known of each link's image, None where it is nothing.

    Args:
        seen: (8, 3) or (14, 3) observation, see `observation`.
        bound: Bound of the error of a measured coordinate, and of an end's distance from its line, px.
    """
    if len(seen) == POINT_ROWS:
        points = seen[:, 0].reshape(-1, 2)
        shown, both = points[1:] - points[:-1], np.full(2, 2.0 * bound)
        return [None if np.isnan(one).any() else LinkImage(np.eye(3), one, both) for one in shown]
    polygons = places_of(seen, bound)
    return [_link_image(polygons[link], polygons[link + 1], seen, link) for link in range(LINKS)]


def places_of(seen: Floats, bound: float) -> list[Floats]:
    """Return the corners (k, 2) of where each of the four points can be, px from the origin."""
    strips: list[list[Strip]] = [[] for _ in range(LINKS + 1)]
    for row, (value, *direction) in enumerate(seen):
        if not np.isnan(value):
            past = row - POINT_ROWS
            point = row // 2 if past < 0 else past // 2 + past % 2
            strips[point].append((np.array(direction), float(value) - bound, float(value) + bound))
    return [intersect(one) for one in strips]


def _link_image(beginning: Floats, end: Floats, seen: Floats, link: int) -> LinkImage | None:
    turn, row = np.eye(3), POINT_ROWS + 2 * link
    if not np.isnan(seen[row, 0]):
        across, down = seen[row, 1:]
        turn[:2, :2] = [[across, down], [-down, across]]
    if not (len(beginning) and len(end)):
        # Strips that do not meet contradict each other: no link is between what is nowhere.
        return LinkImage(turn, np.zeros(2), np.full(2, -np.inf))
    middle, half = np.zeros(2), np.full(2, np.inf)
    for axis in range(2):
        (first, last), (low, high) = extent(beginning, turn[axis, :2]), extent(end, turn[axis, :2])
        if np.isfinite([first, last, low, high]).all():
            middle[axis], half[axis] = 0.5 * (low - last + high - first), 0.5 * (high - first - low + last)
    return LinkImage(turn, middle, half) if np.isfinite(half).any() else None


def bound_places(seen: Floats, bound: float) -> Extents:
    """Return the bounds of each point of the chain, given its observation."""
    if len(seen) == POINT_ROWS:
        points = seen[:, 0].reshape(-1, 2)
        return points, np.where(np.isnan(points), np.inf, bound)
    middles, halves = np.zeros((LINKS + 1, 2)), np.full((LINKS + 1, 2), np.inf)
    for point, corners in enumerate(places_of(seen, bound)):
        for axis in range(2 if len(corners) else 0):
            low, high = extent(corners, AXES[axis])
            if np.isfinite(high):
                middles[point, axis], halves[point, axis] = 0.5 * (low + high), 0.5 * (high - low)
    return middles, halves


# Cells of the link's attitude and direction.

BEND = 1.5
"""Bound of a_k's deviation from its slopes, relative to the squared half widths of a cell."""

ATTITUDE_CELLS = 7
"""Number of cells in the range of each angle."""

TURNS = 3
"""Numbers of the rotation vector, the first coordinates of a region."""


class Link(NamedTuple):
    """The observed link.

    Attributes:
        angle: Coordinate of its direction (S theta*), or -1 for the first link, whose direction is 0.
        length: Coordinate of its length (r).
        scale: S, px/rad.
        reference: (3, 3) attitude that the rotation vector is relative to.
    """

    angle: int
    length: int
    scale: float
    reference: Floats


@compiled
def space_cells(
    region: Floats,
    link: Link,
    seen: Floats,
    bound: Floats,
    cells: int,
    ways: Ways,
) -> Grid:
    """Return the cells of a link of a region, and what lengths fit in each.

    Args:
        region: (n + 3, n), coordinates (S omega, S theta*_2, S theta*_3, r_1, r_2, r_3).
        link: Observed link.
        seen: (2,) its end less its beginning, px.
        bound: (2,) of the error of each, px; infinite where it was not seen.
        cells: Along each axis.
        ways: Treatment of regions.
    """
    grid = _grid(region, link, cells, ways)
    _fill(grid, region, link, seen, bound, ways)
    return grid


@compiled
def _grid(region: Floats, link: Link, cells: int, ways: Ways) -> Grid:
    """Return a grid over the guides, as far as the ellipsoid reaches, with nothing in its cells."""
    dimension = TURNS + 1 if link.angle >= 0 else TURNS
    axes, half = np.empty(dimension, np.int64), np.empty(dimension)
    starts, ends = np.empty((dimension, cells)), np.empty((dimension, cells))
    for axis in range(dimension):
        j = axis if axis < TURNS else link.angle
        low, high = region[LOW, j], region[HIGH, j]
        if ways.ellipsoids:
            extent = np.sqrt(region[SHAPE + j, j]) + SLACK
            low, high = max(low, region[CENTRE, j] - extent), min(high, region[CENTRE, j] + extent)
        # An empty region has no width; the ellipsoid's cut finds it empty.
        axes[axis], half[axis] = j, 0.5 * max(high - low, 0.0) / (cells * link.scale)
        for m in range(cells):
            starts[axis, m] = low / link.scale + 2 * m * half[axis]
            ends[axis, m] = starts[axis, m] + 2 * half[axis]
    total = cells**dimension
    return Grid(axes, link.length, starts, ends, half, np.empty(total), np.empty(total))


@compiled
def image(turn: Floats, slopes: Floats, cosine: float, sine: float, k: int) -> tuple[float, float, float, float, float]:
    """Return a_k, and its derivatives by omega (three) and theta."""
    return (
        turn[k, 0] * cosine + turn[k, 1] * sine,
        slopes[k, 0] * cosine + slopes[k, 3] * sine,
        slopes[k, 1] * cosine + slopes[k, 4] * sine,
        slopes[k, 2] * cosine + slopes[k, 5] * sine,
        turn[k, 1] * cosine - turn[k, 0] * sine,
    )


@compiled
def rotate(reference: Floats, omega: Floats) -> tuple[Floats, Floats]:
    """Return the rotation (3, 3), and the derivatives (2, 6) of its first two columns' image by omega."""
    turn, jacobian = multiply(reference, matrix(omega)), right_jacobian(omega)
    slopes = np.empty((2, 6))
    for k in range(2):
        for m in range(TURNS):
            # R (du x e_1) and R (du x e_2), du = J_r dw.
            slopes[k, m] = turn[k, 1] * jacobian[2, m] - turn[k, 2] * jacobian[1, m]
            slopes[k, 3 + m] = turn[k, 2] * jacobian[0, m] - turn[k, 0] * jacobian[2, m]
    return turn, slopes


@compiled
def _fill(
    grid: Grid,
    region: Floats,
    link: Link,
    seen: Floats,
    bound: Floats,
    ways: Ways,
) -> None:
    """Bound the lengths in each cell by the guide, the ellipsoid and the observation, in place."""
    dimension, cells = grid.low.shape
    white, slope, rest, reach = _conditional(grid, region, link)
    lean, half = 0.0, np.zeros(TURNS + 1)
    for axis in range(dimension):
        half[axis] = grid.half[axis]
        lean += abs(slope[axis]) * half[axis]
    error = np.empty(2)
    for k in range(2):
        error[k] = bound[k] + SLACK + MARGIN * (abs(seen[0]) + abs(seen[1]) + bound[k] + region[HIGH, link.length])
    omega, off = np.empty(TURNS), np.empty(dimension)
    directions = _directions(grid)
    thetas = directions.shape[0]
    for n in range(grid.shortest.shape[0] // thetas):
        place = n
        for axis in range(TURNS - 1, -1, -1):
            omega[axis] = grid.low[axis, 0] + (2 * (place % cells) + 1) * half[axis]
            off[axis] = omega[axis] - region[CENTRE, axis] / link.scale
            place //= cells
        turn, slopes = rotate(link.reference, omega)
        for m in range(thetas):
            shortest, longest = region[LOW, link.length], region[HIGH, link.length]
            if dimension > TURNS:
                off[TURNS] = directions[m, 0] - region[CENTRE, link.angle] / link.scale
            if ways.ellipsoids:
                middle, extent = _section(white, slope, rest, reach, off)
                middle += region[CENTRE, link.length]
                shortest, longest = max(shortest, middle - lean - extent), min(longest, middle + lean + extent)
            for k in range(2):
                least, greatest = _range(turn, slopes, directions[m, 1], directions[m, 2], k, half)
                shortest, longest = below(shortest, longest, least, seen[k] + error[k])
                shortest, longest = below(shortest, longest, -greatest, error[k] - seen[k])
            grid.shortest[n * thetas + m], grid.longest[n * thetas + m] = shortest, longest


@compiled
def _directions(grid: Grid) -> Floats:
    """Return theta of each cell along its axis, with cosine and sine, (cells, 3); for the first link 0 alone."""
    dimension, cells = grid.low.shape
    thetas = cells if dimension > TURNS else 1
    directions = np.zeros((thetas, 3))
    for m in range(thetas):
        if dimension > TURNS:
            directions[m, 0] = grid.low[TURNS, 0] + (2 * m + 1) * grid.half[TURNS]
        directions[m, 1], directions[m, 2] = np.cos(directions[m, 0]), np.sin(directions[m, 0])
    return directions


@compiled
def _range(
    turn: Floats,
    slopes: Floats,
    cosine: float,
    sine: float,
    k: int,
    half: Floats,
) -> tuple[float, float]:
    """Return bounds of a_k over a cell about an attitude and a direction, given its half widths (4,)."""
    value, first, second, third, fourth = image(turn, slopes, cosine, sine, k)
    room = abs(first) * half[0] + abs(second) * half[1] + abs(third) * half[2] + abs(fourth) * half[3]
    room += BEND * (half[0] * half[0] + half[1] * half[1] + half[2] * half[2] + half[3] * half[3])
    return max(value - room, -1.0), min(value + room, 1.0)


@compiled
def _conditional(grid: Grid, region: Floats, link: Link) -> tuple[Floats, Floats, float, float]:
    """Return what bounds the length given the angles: W of W A W' = I, the slope, the variance left, a cell's reach."""
    dimension = grid.axes.shape[0]
    angles, both = np.empty((dimension, dimension)), np.empty((dimension, 1))
    for i in range(dimension):
        for j in range(dimension):
            angles[i, j] = region[SHAPE + grid.axes[i], grid.axes[j]] / (link.scale * link.scale)
        both[i, 0] = region[SHAPE + grid.axes[i], link.length] / link.scale
    root, positive = factorise(angles)
    slope, tall = np.zeros(dimension), region[SHAPE + link.length, link.length]
    if not positive:
        return np.zeros((dimension, dimension)), slope, tall, 0.0
    white = substitute(root, np.eye(dimension))
    across = multiply(white, both)
    rest, reach = tall, 0.0
    for i in range(dimension):
        rest -= across[i, 0] * across[i, 0]
        length = 0.0
        for j in range(dimension):
            slope[i] += white[j, i] * across[j, 0]
            length += white[j, i] * white[j, i]
        reach += grid.half[i] * np.sqrt(length)
    return white, slope, max(rest, 0.0), reach


@compiled
def _section(white: Floats, slope: Floats, rest: float, reach: float, off: Floats) -> tuple[float, float]:
    """Return the middle, from the centre, and half the extent of the lengths in a cell; the half is -inf if outside."""
    middle, square = 0.0, 0.0
    for i in range(off.shape[0]):
        middle += slope[i] * off[i]
        part = 0.0
        for j in range(i + 1):
            part += white[i, j] * off[j]
        square += part * part
    nearest = max(np.sqrt(square) - reach, 0.0)
    if nearest > 1.0 + SLACK:
        return middle, -np.inf
    return middle, np.sqrt(rest * max(1.0 - nearest * nearest, 0.0)) + SLACK


@compiled
def observe_in_space(
    region: Floats,
    link: Link,
    seen: Floats,
    bound: Floats,
    cells: int,
    most: int,
    ways: Ways,
) -> Floats:
    """Return what an observation leaves of a region: none, one or several (K, n + 3, n).

    Args:
        region: (n + 3, n), coordinates (S omega, S theta*_2, S theta*_3, r_1, r_2, r_3).
        link: Observed link.
        seen: (2,) its end less its beginning, px.
        bound: (2,) of the error of each, px; infinite where it was not seen.
        cells: Along each axis.
        most: Largest number of parts; more than these stay one.
        ways: Treatment of regions.
    """
    grid = space_cells(region, link, seen, bound, cells, ways)
    labels, runs, apart = find_runs(grid, most, ways)
    children = np.empty((runs, region.shape[0], region.shape[1]))
    left = 0
    for run in range(runs):
        child = children[left]
        child[:] = region
        first, last, middle = find_extents(grid, labels, run)
        if (ways.guided or apart) and not shrink_to_cells(child, grid, link.scale, first, last):
            continue
        if _apply_strips(child, link, grid, labels, run, middle, ways) and settle(child, ways):
            left += 1
    return children[:left]


@compiled
def _apply_strips(region: Floats, link: Link, grid: Grid, labels: Ints, run: int, middle: Floats, ways: Ways) -> bool:
    """Cut a region, in place, by what is shown along each axis about the mean (d + 1,) of a run."""
    dimension = grid.axes.shape[0]
    turn, slopes = rotate(link.reference, middle[:TURNS].copy())
    theta = middle[TURNS] if dimension > TURNS else 0.0
    for k in range(2):
        normal, tilt = np.zeros(region.shape[1]), np.empty(TURNS + 1)
        normal[link.length], tilt[0], tilt[1], tilt[2], tilt[3] = image(turn, slopes, np.cos(theta), np.sin(theta), k)
        for axis in range(dimension):
            tilt[axis] *= middle[dimension]
            normal[grid.axes[axis]] = tilt[axis] / link.scale
        least, most = _extremes(grid, labels, run, tilt, normal[link.length])
        if not apply_strip(region, normal, least, most, ways):
            return False
    return True


@compiled
def _extremes(grid: Grid, labels: Ints, run: int, tilt: Floats, slope: float) -> tuple[float, float]:
    """Return the least and the greatest of a linear function over the cells of a run."""
    dimension, cells = grid.low.shape
    room = 0.0
    for axis in range(dimension):
        room += abs(tilt[axis]) * grid.half[axis]
    least, most = np.inf, -np.inf
    for n in range(labels.shape[0]):
        if labels[n] != run:
            continue
        place, value = n, 0.0
        for axis in range(dimension - 1, -1, -1):
            value += tilt[axis] * (grid.low[axis, 0] + (2 * (place % cells) + 1) * grid.half[axis])
            place //= cells
        one, other = slope * grid.shortest[n], slope * grid.longest[n]
        least, most = min(least, value + min(one, other) - room), max(most, value + max(one, other) + room)
    return least, most
