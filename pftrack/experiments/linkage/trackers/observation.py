"""What is seen of a chain in a frame: numbers that are each a component of a point's image, along a direction.

A measured point is two of them, along the axes of the image. A link that is seen as a line is two as well: the places
of its beginning and of its end along the line's unit normal n, both of which are the line's offset from the origin,

    n . L X_{i-1} = rho + error,  n . L X_i = rho + error.

So the filter's innovation is the distance of either end from the line that was seen. Shimada 1997, eqs. 4.9 to 4.11,
observes (m, rho) with m = L X_i - L X_{i-1} instead, of which the length is not seen, and the direction turns about
where a link points at the camera; the distances are linear in the image, know no such pose, and have the errors of the
ends for their noise.

Of a line's two numbers, direction and offset, the density is that of the distances times the length that the link has
in the image, by which the distances of its ends depend on the direction. Without this factor a short link would fit
every line the better, since its ends are always near it (`log_image_lengths`).

An observation is an array (m, 3): the number, NaN where it was not seen, and the direction of which it is a component.
m is 3 in the plane, 8 in space, and 14 in space with lines: then six rows follow, two for each link.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.linkage.scene.lines import LinkMeasurements
from pftrack.experiments.linkage.shape import LINKS
from pftrack.experiments.linkage.trackers.chain import observe, slopes

__all__ = [
    "POINT_ROWS",
    "log_image_lengths",
    "observed_rows",
    "project",
    "project_all",
    "project_slopes",
    "read_observation",
]

POINT_ROWS = 2 * (LINKS + 1)
"""Coordinates of points in space; rows beyond them are of lines."""


def read_observation(frame: Frame, origin_px: NDArray[np.float64], *, in_space: bool) -> NDArray[np.float64]:
    """Return what was seen, (3, 3) in the plane, (8, 3) or (14, 3) in space, px from the origin.

    Raises:
        ValueError: The frame has no measured points, or another number of them.
    """
    measured = frame.measurements
    points = None if measured is None else measured.points_px
    expected = LINKS + 1 if in_space else LINKS
    if points is None or points.shape != (expected, 2):
        got = "none" if points is None else f"{len(points)}"
        raise ValueError(f"a tracker of a chain needs {expected} measured points, got {got}")
    placed = points - origin_px
    values = placed.ravel() if in_space else placed[:, 0]
    axes = np.tile(np.eye(2), (LINKS + 1, 1)) if in_space else np.tile([1.0, 0.0], (LINKS, 1))
    if in_space and isinstance(measured, LinkMeasurements):
        offsets = measured.offsets_px - (measured.normals * origin_px).sum(axis=1)
        values, axes = np.append(values, offsets.repeat(2)), np.vstack([axes, measured.normals.repeat(2, axis=0)])
    return np.column_stack([np.where(np.isfinite(values), values, np.nan), axes])


@compiled
def observed_rows(seen: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the rows (k,) of an observation (m, 3) that were seen."""
    return np.flatnonzero(~np.isnan(seen[:, 0]))


@compiled
def project(
    state: NDArray[np.float64], attitude: NDArray[np.float64], seen: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return what a state (n,) shows of what was seen (m, 3), (m,) px."""
    image = observe(state, attitude)
    if seen.shape[0] <= POINT_ROWS:
        return image
    shown = np.empty(seen.shape[0])
    shown[:POINT_ROWS] = image
    for row in range(POINT_ROWS, seen.shape[0]):
        at = 2 * _point(row)
        shown[row] = seen[row, 1] * image[at] + seen[row, 2] * image[at + 1]
    return shown


@compiled
def project_slopes(
    state: NDArray[np.float64], attitude: NDArray[np.float64], seen: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the derivatives of `project` by the state, (m, n)."""
    image = slopes(state, attitude)
    if seen.shape[0] <= POINT_ROWS:
        return image
    found = np.empty((seen.shape[0], state.shape[0]))
    found[:POINT_ROWS] = image
    for row in range(POINT_ROWS, seen.shape[0]):
        at = 2 * _point(row)
        for j in range(state.shape[0]):
            found[row, j] = seen[row, 1] * image[at, j] + seen[row, 2] * image[at + 1, j]
    return found


@compiled
def project_all(
    states: NDArray[np.float64], attitude: NDArray[np.float64], seen: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return what each of several states (N, n) shows of what was seen (m, 3), (N, m) px."""
    shown = np.empty((states.shape[0], seen.shape[0]))
    for n in range(states.shape[0]):
        shown[n] = project(states[n], attitude, seen)
    return shown


@compiled
def log_image_lengths(state: NDArray[np.float64], attitude: NDArray[np.float64], seen: NDArray[np.float64]) -> float:
    """Return the sum of the logarithms of the lengths, px, that links have in the image that are seen as lines."""
    total = 0.0
    if seen.shape[0] > POINT_ROWS:
        image = observe(state, attitude)
        for link in range(LINKS):
            if not np.isnan(seen[POINT_ROWS + 2 * link, 0]):
                across, down = image[2 * link + 2] - image[2 * link], image[2 * link + 3] - image[2 * link + 1]
                # A link that points at the camera shows no line.
                total += 0.5 * np.log(max(across * across + down * down, 1.0))
    return total


@compiled
def _point(row: int) -> int:
    """Return the point of a row of a line: of either end of its link."""
    return (row - POINT_ROWS) // 2 + (row - POINT_ROWS) % 2
