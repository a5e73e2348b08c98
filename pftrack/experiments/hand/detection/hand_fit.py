"""Fitting a flat hand to a silhouette: by how many pixels the model's silhouette is another one.

What is fitted is where the hand is and how large, and how this person's hand differs from the model: the palm's
breadth, and direction, length and width of each finger. The number of pixels that are of one silhouette and not of the
other is made less by steps in one quantity after the other, which become smaller where none helps (pattern search;
R. Hooke and T. Jeeves 1961). A rough edge has as many pixels too many as too few, so that it shifts nothing. A weak
prior keeps what the pixels do not decide near the model.

The arm is left out: sleeves have any width.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.polygons import fill
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponential, logarithm
from pftrack.core.numerics.trigonometry import sines_cosines
from pftrack.experiments.hand.shape import MODEL, HandShape, joints, parts

__all__ = ["Fit", "FlatHand", "apply_changes", "disagreement", "fit_hand", "misfit_of"]

TURN, SIZE, BREADTH, FINGERS = 2, 3, 4, 5
"""Where the quantities are among the twenty, after the place in palm axes of the start: turn in rad, logarithms of size
and breadth; then of each finger the spread in rad and the logarithms of length and width."""
QUANTITIES = 20

STEPS = np.array([0.04, 0.04, 0.04, 0.04, 0.05] + 5 * [0.06, 0.06, 0.08])
PRIOR = np.array([np.inf, np.inf, np.inf, np.inf, 0.04] + 5 * [0.12, 0.12, 0.12])
"""First steps, and standard deviations over people."""
HALVINGS = 4
LEAST_GAIN = 0.5
"""In pixels; a step that gains less is none."""
PRIOR_SHARE = 6e-3
"""What one standard deviation costs, as a share of the hand's pixels."""
ARM_BELOW = 0.1
"""Height above the wrist, in palm axes, below which pixels do not count."""


class FlatHand(NamedTuple):
    """A hand that faces the camera.

    Attributes:
        pose: (25,).
        scale: Length of the palm axis, px.
        shape: Of this person's hand.
    """

    pose: NDArray[np.float64]
    scale: float
    shape: HandShape


def apply_changes(start: FlatHand, changes: NDArray[np.float64]) -> FlatHand:
    """Return a hand changed by twenty quantities.

    Place is that of the knuckles' middle. Turn and size are the palm's alone: the fingers keep directions, lengths and
    widths in the picture, so that each quantity can be looked for by itself.
    """
    factors = exponential(changes)
    shape, size, breadth = start.shape, float(factors[SIZE]), float(factors[BREADTH])
    scale, narrow = start.scale * size, np.array([breadth, 1.0])
    fingers, of_fingers = changes[FINGERS:].reshape(5, 3), factors[FINGERS:].reshape(5, 3) / size
    person = shape.with_changes(
        roots=shape.roots * np.append(narrow, 1.0),
        outline=shape.outline * narrow,
        phalanges=shape.phalanges * of_fingers[:, 1:2],
        radii=shape.radii * of_fingers[:, 2:3],
    )
    pose = start.pose.copy()
    pose[2] += changes[TURN]
    pose[5::4] += fingers[:, 0] - shape.side * changes[TURN]
    before, after = _knuckles(start), _knuckles(FlatHand(pose, scale, person))
    pose[:2] += before - after + start.scale * changes[:2]
    return FlatHand(pose, scale, person)


def _knuckles(hand: FlatHand) -> NDArray[np.float64]:
    """Return the middle (2,) of the knuckles of the four fingers, px."""
    return np.asarray(joints(hand.pose, hand.scale, hand.shape)[1:, 0, :2].mean(axis=0))


class Fit(NamedTuple):
    """What a fit came to.

    Attributes:
        hand: That was fitted.
        misfit: Share of the silhouette's pixels that differ.
        cost: The same with how unlike the model the hand is: by this, fits are compared.
    """

    hand: FlatHand
    misfit: float
    cost: float


def misfit_of(mask: NDArray[np.bool_], hand: FlatHand) -> float:
    """Return the share of a mask's pixels (height, width) above the wrist in which it differs from a hand's."""
    region = _above_wrist(mask.shape, hand)
    off = disagreement(mask, region, hand.pose, hand.scale, hand.shape)
    return off / max(int(np.count_nonzero(mask & region)), 1)


def fit_hand(mask: NDArray[np.bool_], start: FlatHand) -> Fit:
    """Return the hand near a start whose silhouette is most like a mask.

    Args:
        mask: (height, width) what is seen.
        start: In px of the mask.
    """
    region = _above_wrist(mask.shape, start)
    pixels = max(int(np.count_nonzero(mask & region)), 1)

    unlike = np.zeros(QUANTITIES)
    unlike[FINGERS + 1 :: 3] = logarithm(start.shape.phalanges[:, 0] / MODEL.phalanges[:, 0])
    unlike[FINGERS + 2 :: 3] = logarithm(start.shape.radii[:, 0] / MODEL.radii[:, 0])

    def cost(changes: NDArray[np.float64]) -> float:
        hand = apply_changes(start, changes)
        off = disagreement(mask, region, hand.pose, hand.scale, hand.shape)
        strange: NDArray[np.float64] = (unlike + changes) / PRIOR
        strange[FINGERS + 1 :: 3] -= changes[SIZE] / PRIOR[FINGERS + 1]
        strange[FINGERS + 2 :: 3] -= changes[SIZE] / PRIOR[FINGERS + 2]
        return float(off + PRIOR_SHARE * pixels * sum(np.square(strange).tolist()))

    changes, steps = np.zeros(QUANTITIES), STEPS.copy()
    least = cost(changes)
    for _ in range(HALVINGS):
        improved = True
        while improved:
            before = changes
            changes, least = _around(cost, changes, least, steps)
            # On along what the round has changed: quantities depend on one another.
            onwards = 2.0 * changes - before
            improved = bool((changes != before).any())
            if improved:
                tried, found = _around(cost, onwards, cost(onwards), steps)
                if found < least - LEAST_GAIN:
                    changes, least = tried, found
        steps /= 2.0
    hand = apply_changes(start, changes)
    return Fit(hand, disagreement(mask, region, hand.pose, hand.scale, hand.shape) / pixels, least / pixels)


def _around(
    cost: Callable[[NDArray[np.float64]], float], changes: NDArray[np.float64], least: float, steps: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """Return changes after a step in each quantity that makes the cost less, and that cost."""
    for quantity in range(QUANTITIES):
        for way in (1.0, -1.0):
            tried = changes.copy()
            tried[quantity] += way * steps[quantity]
            found = cost(tried)
            if found < least - LEAST_GAIN:
                changes, least = tried, found
                break
    return changes, least


@compiled
def disagreement(
    mask: NDArray[np.bool_], region: NDArray[np.bool_], pose: NDArray[np.float64], scale: float, shape: HandShape
) -> int:
    """Return how many pixels of a region are of a mask and not of a hand's silhouette, or the other way round.

    Args:
        mask: (height, width) what is seen.
        region: (height, width) where it counts.
        pose: (25,).
        scale: Length of the palm axis, px of the mask.
        shape: Of the hand.
    """
    corners, counts = parts(pose, scale, shape)
    height, width = mask.shape
    drawn = fill(corners, counts, height, width)
    off = 0
    for row in range(height):
        for column in range(width):
            off += region[row, column] and mask[row, column] != drawn[row, column]
    return off


def _above_wrist(size: tuple[int, ...], hand: FlatHand) -> NDArray[np.bool_]:
    """Return (height, width) which pixels are on the fingers' side of the wrist."""
    sines, cosines = sines_cosines(hand.pose[2:3])
    rows, columns = np.indices(size)
    along = -sines[0] * (columns - hand.pose[0]) - cosines[0] * (rows - hand.pose[1])
    return np.asarray(along > ARM_BELOW * hand.scale)
