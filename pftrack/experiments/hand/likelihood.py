"""The fit of parts of a hand to a silhouette and its protrusions (Shimada 1997, section 2.6).

A palm, and a finger that is hidden before it, must lie within the silhouette. The measure x_p is the area outside,
divided by the length along which it touches the silhouette: a sliver along an edge comes from the step between
candidates, a lump does not, although both may have the same area. A visible finger must have its tip, or its last
joint, where a protrusion ends, and then run along the protrusion's axis. All is in px of the silhouette's mask, which
is smaller than the picture if that is large.
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.geometry import convex_hull, distance_to_polygon, fill, row_sums, spans, sum_within
from pftrack.core.numerics.compiled import compiled, read_only
from pftrack.core.numerics.elementary import sines_cosines
from pftrack.experiments.hand import model
from pftrack.experiments.hand.candidates import HIGHEST, LOWEST, MOST_PROTRUSIONS, half_steps
from pftrack.experiments.hand.fingers import HandFeatures
from pftrack.experiments.hand.shape import ANGLES, joints, palm_axes, palm_points, parts
from pftrack.filters.particles import normalise

# Possible values of a measure for a right hand whose candidate lies on a grid (Shimada 1997, section 2.6.4): a
# candidate represents a cell of poses, half a step of every angle to either side. If the true pose lies anywhere in the
# cell and the model is right, a measure x_n of the candidate is not 0 but some x_n*, which depends on the pose's place
# in the cell. The likelihood is the mean over the cell of a Gaussian around that (eqs. 2.8 and 2.9), relative to its
# peak:
#
#     p(x_n) = mean over the cell of exp(-(x_n - x_n*)^2 / (2 sigma_n^2)).
#
# The width of an observation (eq. 2.10) is the same for all hands, and drops out. The mean is a sum over a lattice of
# points in the five angles that move a finger: a, b and c of the palm, its spread and its flexion. The model gives the
# displacements of tip and joints for half a step of one angle; in between, they are linear.

CELL_ANGLES = 5
"""Angles of a cell: the palm's a, b and c, a finger's spread and flexion."""

SHORTEST = 1e-9
"""Segment that has a direction, px."""

_COUNT, _GENERATOR = 47, (1, 10, 6, 13, 36)
NODES = read_only(2.0 * np.remainder(np.outer(np.arange(_COUNT) + 0.5, _GENERATOR) / _COUNT, 1.0) - 1.0)
"""(n, 5) points of a cell, in half steps: a lattice of rank one."""


@compiled
def cell_log_fit(square: float, ideals: Floats, sd: float) -> float:
    """Return the log of the mean Gaussian of a measure over a cell, relative to its peak; never above 0 (eq. 2.9).

    Args:
        square: Square of the measure x_n, which is not negative.
        ideals: (n,) its possible values for a right hand, x_n*; empty if the hand represents only itself.
        sd: sigma_n.
    """
    if ideals.shape[0] == 0:
        return -0.5 * square / (sd * sd)
    measure = np.sqrt(square)
    logs = np.empty(ideals.shape[0])
    for n in range(ideals.shape[0]):
        off = (measure - ideals[n]) / sd
        logs[n] = -0.5 * off * off
    return float(min(normalise(logs)[1] - np.log(float(ideals.shape[0])), 0.0))


@compiled
def displacements(
    pose: Floats,
    places: Floats,
    spread: Floats,
    flexed: Floats,
    halves: Floats,
    scale: float,
    side: float,
) -> Floats:
    """Return the displacements (5, 5, 4, 2) of fingers' joints and tips for half a step of each angle of a cell, px.

    The first index is the finger, the second the angle.

    Args:
        pose: (25,) of the palm.
        places: (5, 4, 3) joints and tips, px.
        spread: (5, 4, 3) the same with every finger spread by half a step.
        flexed: (5, 4, 3) the same with every finger bent by half a step.
        halves: (3,) half steps of the palm's a, b and c, rad.
        scale: Length of the palm axis, px.
        side: Side of the hand.
    """
    found = np.empty((5, CELL_ANGLES, 4, 2))
    for i in range(3):
        turn = _turn(pose, i, halves[i], scale, side)
        for finger in range(5):
            for j in range(4):
                x, y = places[finger, j, 0] - pose[0], places[finger, j, 1] - pose[1]
                for k in range(2):
                    found[finger, i, j, k] = turn[k, 0] * x + turn[k, 1] * y + turn[k, 2] * places[finger, j, 2]
    for finger in range(5):
        for j in range(4):
            for k in range(2):
                found[finger, 3, j, k] = spread[finger, j, k] - places[finger, j, k]
                found[finger, 4, j, k] = flexed[finger, j, k] - places[finger, j, k]
    return found


@compiled
def _turn(pose: Floats, angle: int, half: float, scale: float, side: float) -> Floats:
    """Return the map (2, 3) from places relative to the wrist to displacements by a palm's (25,) half step."""
    turned = pose.copy()
    turned[2 + angle] += half
    axes = palm_axes(pose, scale, side)
    change, turn = palm_axes(turned, scale, side) - axes, np.zeros((2, 3))
    for k in range(2):
        for m in range(3):
            for n in range(3):  # the axes are those of a turn, scaled: their transpose undoes it
                turn[k, m] += change[k, n] * axes[m, n] / (scale * scale)
    return turn


@compiled
def farthest(moves: Floats, end: int) -> float:
    """Return the largest distance of a joint or tip from its place in the cell, px; `moves` (m, 4, 2) of a finger."""
    most = 0.0
    for i in range(moves.shape[0]):
        most += np.sqrt(moves[i, end, 0] * moves[i, end, 0] + moves[i, end, 1] * moves[i, end, 1])
    return most


@compiled
def tip_distances(moves: Floats, end: int) -> Floats:
    """Return x_ft* (n,) px, the displacement of a joint or tip in points of the cell; empty without a cell.

    Args:
        moves: (5, 4, 2) of one finger by `displacements`; (0, 4, 2) for a hand that does not represent a cell.
        end: Number of the joint or tip.
    """
    found = np.empty(NODES.shape[0] if moves.shape[0] else 0)
    for n in range(found.shape[0]):
        x, y = 0.0, 0.0
        for i in range(moves.shape[0]):
            x += NODES[n, i] * moves[i, end, 0]
            y += NODES[n, i] * moves[i, end, 1]
        found[n] = np.sqrt(x * x + y * y)
    return found


@compiled
def axis_distances(moves: Floats, places: Floats, end: int, length: float) -> Floats:
    """Return x_fa* (n,) px, the mean distance of a finger's axis in points of the cell once the ends coincide.

    Args:
        moves: (5, 4, 2) of one finger by `displacements`; (0, 4, 2) for a hand that does not represent a cell.
        places: (4, 2) or wider, its joints and tip, px.
        end: Number of the joint or tip at which the axis begins.
        length: Compared length of the axis, px; it may end before the root.
    """
    found = np.zeros(NODES.shape[0] if moves.shape[0] else 0)
    for n in range(found.shape[0]):
        total, x, y, longer, left, joint = 0.0, 0.0, 0.0, 0.0, length, end
        while joint > 0 and left > 0.0:
            over, under = places[joint - 1, 0] - places[joint, 0], places[joint - 1, 1] - places[joint, 1]
            whole = max(np.sqrt(over * over + under * under), SHORTEST)
            over, under = over / whole, under / whole
            # Points at equal arc length are compared, so a point slides by as much as the axis before it is longer.
            first = np.sqrt((x - longer * over) ** 2 + (y - longer * under) ** 2)
            right, down = 0.0, 0.0
            for i in range(moves.shape[0]):
                right += NODES[n, i] * (moves[i, joint - 1, 0] - moves[i, joint, 0])
                down += NODES[n, i] * (moves[i, joint - 1, 1] - moves[i, joint, 1])
            x, y, longer = x + right, y + down, longer + right * over + down * under
            last = np.sqrt((x - longer * over) ** 2 + (y - longer * under) ** 2)
            part = min(whole, left)
            total += (first + 0.5 * (last - first) * part / whole) * part
            left, joint = left - part, joint - 1
        found[n] = total / length if length > 0.0 else 0.0
    return found


TIP = 3
"""The four places along a finger, from its root on."""

BOX_SHARE = 0.8
"""Half the width of the boxes for a hidden finger, as a share of its radius."""

EXPLAINED_SHARE, EXPLAINED_COST = 0.6, 0.1
"""Share of a protrusion that a finger should explain, and the cost of each px less."""


class PictureTables(NamedTuple):
    """Look-up tables of a picture.

    Attributes:
        silhouette: (height, width).
        area: Its area, px, at least 1.
        outside: (height, width + 1) sums along rows of the pixels that are not in the silhouette.
        contour: (height, width + 1) the same for its pixels that touch one outside.
        axes: (P, K, 2) points of the protrusions' axes, from the tip on, 1 px apart.
        lengths: (P,) number of points of each.
    """

    silhouette: Bools
    area: int
    outside: NDArray[np.int32]
    contour: NDArray[np.int32]
    axes: Floats
    lengths: Ints


@compiled
def x_p(polygon: Floats, seen: PictureTables, scale: float) -> float:
    """Return how far a convex polygon sticks out of the silhouette, in fiftieths of the palm axis (eq. 2.5).

    Args:
        polygon: (m, 2) px.
        seen: The picture.
        scale: Length of the palm axis, px.
    """
    top, firsts, lasts = spans(polygon, seen.outside.shape[0], seen.outside.shape[1] - 1)
    outside, touching = sum_within(seen.outside, top, firsts, lasts), sum_within(seen.contour, top, firsts, lasts)
    return 50.0 * outside / (scale * max(touching, 1))


@compiled
def finger_fits(
    places: Floats,
    moves: Floats,
    ideals: Floats,
    log_priors: Floats,
    count: int,
    radii: Floats,
    seen: PictureTables,
    task: model.Task,
) -> tuple[Floats, Ints]:
    """Return the best candidate of a finger for each protrusion, and for none.

    No term is above 0, so the search ends at a candidate whose prior is already below the best score.

    Args:
        places: (C, 4, 3) or longer, joints and tip of every candidate, px.
        moves: (C, m, 4, 2) or longer, displacements of each by half a step of m angles, px.
        ideals: (n,) x_p* of a hidden finger in points of the cell.
        log_priors: (C,) or longer, log priors of the candidates, not increasing.
        count: C.
        radii: (4,) at these places, palm axes.
        seen: The picture, with P protrusions.
        task: The hand, and standard deviations and costs.

    Returns:
        (P + 1,) log scores, and the number of the candidate (P + 1,) that has each; the last of hiding.
    """
    protrusions = seen.lengths.shape[0]
    scores, chosen = np.full(protrusions + 1, -np.inf), np.zeros(protrusions + 1, np.int64)
    for p in range(protrusions + 1):
        for k in range(count):
            least = scores[p] - log_priors[k]
            if least >= 0.0:
                break
            score = log_priors[k] + finger_fit(places[k], moves[k], ideals, radii, p, seen, task, least)
            if score > scores[p]:
                scores[p], chosen[p] = score, k
    return scores, chosen


@compiled
def finger_fit(
    places: Floats,
    moves: Floats,
    ideals: Floats,
    radii: Floats,
    protrusion: int,
    seen: PictureTables,
    task: model.Task,
    least: float,
) -> float:
    """Return the log likelihood of a finger that a protrusion shows, or none.

    Args:
        places: (4, 3) joints and tip, px.
        moves: (m, 4, 2) displacements of these by half a step of m angles, px; empty for a hand that does not represent
            a cell.
        ideals: (n,) x_p* of a hidden finger in points of the cell; none for no cell.
        radii: (4,) at these places, palm axes.
        protrusion: Its index; the number of protrusions, or a negative number, for a hidden finger.
        seen: The picture.
        task: The hand, and standard deviations and costs.
        least: Scores up to this are irrelevant: the function may then return -inf.
    """
    if not 0 <= protrusion < seen.lengths.shape[0]:
        if least >= -model.HIDDEN_COST:
            return -np.inf
        misfit = hidden_x_p(places, radii, seen, task.scale)
        return -model.HIDDEN_COST + cell_log_fit(misfit * misfit, ideals, model.HIDDEN_FIT_SD)
    axis = seen.axes[protrusion, : seen.lengths[protrusion]]
    best = -np.inf
    lowest = model.LAST_JOINT if task.settings.reference else model.MIDDLE_JOINT
    for end in range(TIP, lowest - 1, -1):
        price = model.JOINT_COST if end < TIP else 0.0
        across, down = axis[0, 0] - places[end, 0], axis[0, 1] - places[end, 1]
        square = across * across + down * down
        beyond = max(np.sqrt(square) - farthest(moves, end), 0.0) / task.settings.tip_sd
        if -0.5 * beyond * beyond - price <= max(best, least):
            continue
        score = cell_log_fit(square, tip_distances(moves, end), task.settings.tip_sd) - price
        if score > max(best, least):
            apart, explained = _along(places, end, axis)
            lacking = EXPLAINED_SHARE * axis.shape[0] - explained
            score += cell_log_fit(apart * apart, axis_distances(moves, places, end, explained), task.settings.axis_sd)
            best = max(best, score - EXPLAINED_COST * max(lacking, 0.0) / task.settings.unit)
    return best


@compiled
def unexplained_cost(length: int, unit: float) -> float:
    """Return what a protrusion of a length, px, costs that no finger explains."""
    nominal = length / unit
    return float(min(0.05 * nominal * np.sqrt(nominal), 30.0))


@compiled
def _along(places: Floats, end: int, axis: Floats) -> tuple[float, float]:
    """Return the mean distance of a finger's axis from a protrusion's once their ends coincide, and over which length.

    Points at equal length from the end are compared, up to the end of the shorter axis (eq. 2.7).
    """
    across, down = axis[0, 0] - places[end, 0], axis[0, 1] - places[end, 1]
    total, count, joint, begun = 0.0, 0, end, 0.0
    while joint > 0 and count < axis.shape[0]:
        x, y = places[joint, 0] + across, places[joint, 1] + down
        over, under = places[joint - 1, 0] - places[joint, 0], places[joint - 1, 1] - places[joint, 1]
        length = np.sqrt(over * over + under * under)
        while count < axis.shape[0] and count <= begun + length:
            share = (count - begun) / length if length > 0.0 else 0.0
            right, below = x + share * over - axis[count, 0], y + share * under - axis[count, 1]
            total += np.sqrt(right * right + below * below)
            count += 1
        begun += length
        joint -= 1
    return total / max(count, 1), float(max(count - 1, 0))


@compiled
def hidden_x_p(places: Floats, radii: Floats, seen: PictureTables, scale: float) -> float:
    """Return x_p of the boxes of a finger's three phalanges together, in fiftieths of the palm axis.

    Args:
        places: (4, 3) or narrower, joints and tip, px.
        radii: (4,) at these places, palm axes.
        seen: The picture.
        scale: Length of the palm axis, px.
    """
    outside, touching = 0, 0
    box = np.empty((4, 2))
    for j in range(3):
        x, y = places[j + 1, 0] - places[j, 0], places[j + 1, 1] - places[j, 1]
        length = np.sqrt(x * x + y * y)
        across, down = (-y / length, x / length) if length > 0.0 else (1.0, 0.0)
        for corner in range(4):
            end = j if corner in (0, 3) else j + 1
            half = BOX_SHARE * radii[end] * scale
            half = half if corner < 2 else -half
            box[corner, 0], box[corner, 1] = places[end, 0] + half * across, places[end, 1] + half * down
        top, firsts, lasts = spans(box, seen.outside.shape[0], seen.outside.shape[1] - 1)
        outside += sum_within(seen.outside, top, firsts, lasts)
        touching += sum_within(seen.contour, top, firsts, lasts)
    return 50.0 * outside / (scale * max(touching, 1))


def contour_of(silhouette: Bools) -> Bools:
    """Return the pixels (height, width) of a silhouette that have a neighbour outside it; the border has none there."""
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    inner = cv2.erode(silhouette.view(np.uint8), cross).view(np.bool_)
    return np.asarray(silhouette & ~inner, np.bool_)


def tables_of(silhouette: Bools, axes: Sequence[Floats]) -> PictureTables:
    """Return what is looked up in a picture.

    Args:
        silhouette: (height, width).
        axes: Axes of the protrusions, (k, 2) points 1 px apart from the tip on; only the longest ones are kept.
    """
    longest = sorted(range(len(axes)), key=lambda p: -len(axes[p]))[:MOST_PROTRUSIONS]
    chosen = [axes[p] for p in sorted(longest)]
    lengths = np.array([len(axis) for axis in chosen], np.int64)
    points = np.zeros((len(chosen), max(lengths, default=1), 2))
    for p, axis in enumerate(chosen):
        points[p, : len(axis)] = axis
    mask = np.ascontiguousarray(silhouette)
    return PictureTables(mask, max(int(mask.sum()), 1), row_sums(~mask), row_sums(contour_of(mask)), points, lengths)


THICKEST = 0.25
"""Largest radius of a finger, palm axes: twice that of a thumb."""

UNSEEN = 3.0
"""Factor on the deviation of a hidden wrist from its prediction."""


class View:
    """A frame and the hand to find in it.

    Attributes:
        task: The hand, and the settings of the search.
        seen: Look-up tables of the picture.
    """

    def __init__(self, state: model.HandState, found: HandFeatures, parameters: model.HandTrackerParameters) -> None:
        """Return the look-up tables of a frame for the hand of a state."""
        self._found, self._state = found, state
        scale = state.scale / found.silhouette.reduction
        given = model.settings(parameters, scale)
        if found.wrist is None:
            given = given._replace(wrist_sd=UNSEEN * given.wrist_sd)
        self.task = model.Task(scale, state.shape, given)
        self.seen: PictureTables = tables_of(found.silhouette.mask, fingers(found, state.scale))

    def into(self, poses: Floats) -> Floats:
        """Return poses (K, 25) of the picture in px of the mask."""
        moved = poses.copy()
        moved[:, :2] = self._found.silhouette.in_mask(poses[:, :2])
        return moved

    def back(self, poses: Floats) -> Floats:
        """Return poses (K, 25) of the mask in px of the picture."""
        moved = poses.copy()
        moved[:, :2] = self._found.silhouette.in_picture(poses[:, :2])
        return moved

    def with_wrists(self, poses: Floats) -> Floats:
        """Return poses (K, 25) of the mask whose wrists are where one is seen, if one is."""
        if self._found.wrist is None:
            return poses
        moved = poses.copy()
        across, up = _forearm(poses[:, 2])
        offset = self._state.wrist_offset / self._found.silhouette.reduction
        moved[:, :2] = self._found.wrist - offset[0] * across - offset[1] * up
        return moved


def fingers(found: HandFeatures, scale: float) -> list[Floats]:
    """Return the axes (k, 2) of the protrusions that are as thin as fingers, px of the mask; a fist on its arm is none.

    Args:
        found: In a frame.
        scale: Length of the palm axis, px of the picture.
    """
    thickest = THICKEST * scale / found.silhouette.reduction
    return [each.axis for each in found.protrusions if np.sort(each.radii)[len(each.radii) // 2] <= thickest]


def wrist_offset(pose: Floats, found: HandFeatures) -> Floats:
    """Return the distance of the measured wrist from that of a pose (25,), (2,) across the forearm and along it, px."""
    if found.wrist is None:
        return np.zeros(2)
    across, up = _forearm(pose[2:3])
    apart = found.silhouette.in_picture(found.wrist) - pose[:2]
    return np.array([(axis[0] * apart).sum() for axis in (across, up)])


def _forearm(turns: Floats) -> tuple[Floats, Floats]:
    """Return unit vectors (n, 2) across forearms that are turned by a (n,), and along them to the hand."""
    sines, cosines = sines_cosines(np.ascontiguousarray(turns))
    return np.column_stack([cosines, -sines]), np.column_stack([-sines, -cosines])


# The fingers of a palm can be within certain regions of the picture: all that they sweep within the limits of their
# joints. A protrusion outside all of them is not a finger of this palm, so the palm is refused before any finger is
# tried (Shimada 1997, section 2.6.1). Here the region of a finger is the convex hull of its joints and tips in some
# postures. Its joints bend alike in these, as they do in the candidates.

SPREADS, FLEXIONS = 3, 5
"""Postures from one limit to the other."""
MARGIN = 0.12
"""Tolerance of a region, palm axes, since hands and steps are not exact."""


@compiled
def postures(pose: Floats, task: model.Task) -> Floats:
    """Return joints and tips (5, n, 2) of the fingers of a palm (25,) in postures up to their limits, px."""
    moved, points = pose.copy(), np.empty((5, 4 * SPREADS * FLEXIONS, 2))
    for posture in range(SPREADS * FLEXIONS):
        spread, flexion = posture // FLEXIONS / (SPREADS - 1), posture % FLEXIONS / (FLEXIONS - 1)
        for j in range(5, ANGLES):
            share = spread if (j - 5) % 4 == 0 else flexion
            moved[j] = LOWEST[j] + share * (HIGHEST[j] - LOWEST[j])
        places = joints(moved, task.scale, task.shape)
        for finger in range(5):
            for j in range(4):
                for k in range(2):
                    points[finger, 4 * posture + j, k] = places[finger, j, k]
    return points


@compiled
def reaches(pose: Floats, seen: PictureTables, task: model.Task) -> bool:
    """Return whether each protrusion lies where a finger of a palm (25,) can be, from its tip to its other end."""
    points, margin = postures(pose, task), MARGIN * task.scale
    reached = np.zeros(seen.lengths.shape[0], np.bool_)
    for finger in range(5):
        region = convex_hull(points[finger])
        for p in range(reached.shape[0]):
            axis = seen.axes[p, : seen.lengths[p]]
            if not reached[p] and distance_to_polygon(axis[0], region) <= margin:
                reached[p] = distance_to_polygon(axis[-1], region) <= margin
    return bool(reached.all())


# The x_p* of a cell measures how far the palm and hidden fingers of a right hand stick out of its silhouette because
# they lie on a grid. The hand of a prediction is drawn, and palm and fingers that are half a step away are laid over
# it. As in the source, the values between are interpolated, here evenly from 0 at the prediction (Shimada 1997, 2.6.4).


@compiled
def ideal_x_p(predicted: Floats, drawn: PictureTables, task: model.Task) -> Floats:
    """Return x_p* (6, n) in points of the cell, for the palm, and for each finger if it is hidden.

    Args:
        predicted: (25,) pose.
        drawn: The silhouette of its hand.
        task: The hand, and the settings of the search.
    """
    halves = half_steps(predicted, task)
    ways = np.zeros((6, CELL_ANGLES, 2))
    for i in range(CELL_ANGLES):
        for way in range(2):
            sign = 1.0 if way else -1.0
            moved = predicted.copy()
            if i < 3:
                moved[2 + i] += sign * halves[0, i]
                palm = convex_hull(palm_points(moved, task.scale, task.shape))
                ways[0, i, way] = x_p(palm, drawn, task.scale)
            else:
                for finger in range(5):
                    at, last = (5, 6) if i == 3 else (6, 9)
                    for j in range(4 * finger + at, 4 * finger + last):
                        moved[j] = min(max(moved[j] + sign * halves[finger, i], LOWEST[j]), HIGHEST[j])
            places = joints(moved, task.scale, task.shape)
            for finger in range(5):
                ways[1 + finger, i, way] = hidden_x_p(places[finger], task.shape.radii[finger], drawn, task.scale)
    found = np.zeros((6, NODES.shape[0]))
    for part in range(6):
        for n in range(NODES.shape[0]):
            for i in range(CELL_ANGLES):
                found[part, n] += abs(NODES[n, i]) * ways[part, i, 1 if NODES[n, i] > 0.0 else 0]
    return found


def ideals_of(predictions: Floats, seen: PictureTables, task: model.Task) -> Floats:
    """Return x_p* (I, 6, n) around predictions (I, 25); (I, 6, 0) if hands do not represent cells."""
    if not task.settings.cells:
        return np.empty((len(predictions), 6, 0))
    height, width = seen.silhouette.shape
    drawn = [tables_of(fill(*parts(pose, task.scale, task.shape), height, width), []) for pose in predictions]
    return np.array([ideal_x_p(pose, tables, task) for pose, tables in zip(predictions, drawn, strict=True)])
