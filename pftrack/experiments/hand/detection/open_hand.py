"""The first pose: an open hand that faces the camera, found by itself (Shimada 1997, section 2.4).

Five protrusions are ordered around the hand, and the model is laid over them with the thumb at either end: the nearer
one says on which side it is. A left palm looks like the back of a right hand, and either is taken as it looks.
Where the four fingers begin, and the wrist, give place, turn and size; the thumb begins at the place that the similar
triangle of the model gives. Along each finger joints lie in the model's ratios, and the palm's thickness goes with the
fingers' mean width. Then the whole is fitted to the silhouette (`pftrack.experiments.hand.detection.hand_fit`), since a
wrist is seen to within some five per cent of the palm only.

What cannot be begun is said in words: a fist, two hands, a hand that is cut by the border or seen from its side.

A person may mark the five tips instead. Then fingers go to the nearest marks, and one that is not seen is bent so far
that its tip comes nearest to its own.
"""

import math
from itertools import pairwise
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.hand.detection.hand_fit import FlatHand, fit_hand
from pftrack.experiments.hand.detection.hand_guess import (
    ARM_LENGTH,
    ROOT_BEHIND,
    SeenFinger,
    fold,
    hand_of,
    measure_finger,
    similar,
    unit,
)
from pftrack.experiments.hand.detection.protrusions import HandFeatures, Protrusion
from pftrack.experiments.hand.shape import FINGERS, HIGH, LOW, MODEL, HandShape

__all__ = ["NoOpenHandError", "OpenHand", "around_hand", "find_open_hand"]

CLEARLY = 1.4
"""By which factor the model must be farther off with thumb and little finger exchanged."""
LEAST_SCALE_PX = 16.0
TOO_SMALL = f"the hand is too small: its palm is {{:.0f}} px long, and {LEAST_SCALE_PX:g} are needed"
LARGEST_MISFIT = 0.18
"""Share of the silhouette's pixels, without the arm, that may differ from the fitted hand's."""
LENGTHS = (0.72, 1.4)
"""Between which a finger's length is, in that of the model."""
LEAST_ROW = 0.55
"""Breadth of the knuckles' row, in that of the model: less is a palm that is seen from its side."""
ARM_AT = tuple(0.1 * step for step in range(2, 9))
"""Where the forearm's width is looked at, below the wrist, and a length that reaches any border, in palm axes."""
FROM_ABOVE = -0.5
"""Cosine of the turn on the screen."""
NEAR_MARK = 0.12
"""How far a mark may be from a finger's tip, as a share of the marks' extent."""
LONGER_THAN_THE_REST = 0.45
"""A protrusion shorter than this share of the fourth longest is none of five fingers, where there are more."""


class NoOpenHandError(ValueError):
    """There is no open hand in the picture; the message says why, in words."""


class OpenHand(NamedTuple):
    """An open hand that was found, in px of the picture.

    Attributes:
        pose: (25,).
        scale: Length of the palm axis, px.
        shape: Of this person's hand; its `side` is -1 if the thumb is on the left of the fingers.
        misfit: Share of the silhouette's pixels, without the arm, that differ from this hand's.
        remarks: What a person may want to check, in words.
    """

    pose: NDArray[np.float64]
    scale: float
    shape: HandShape
    misfit: float
    remarks: tuple[str, ...]


def find_open_hand(features: HandFeatures, tips: NDArray[np.float64] | None = None) -> OpenHand:
    """Return the open hand that a silhouette shows.

    Args:
        features: Of the silhouette.
        tips: (5, 2) where a person has marked the tips, thumb first, px of the picture; None if nobody has.

    Raises:
        NoOpenHandError: There is none, with the reason.
    """
    if not features.finding.ok:
        raise NoOpenHandError(features.finding.value)
    start = _initial_guess(features) if tips is None else _guess_from_tips(features, features.silhouette.in_mask(tips))
    hand, misfit, _ = fit_hand(features.silhouette.mask, start)
    remarks = _check(hand, misfit, marked=tips is not None)
    pose = np.clip(hand.pose, LOW, HIGH)
    shape = hand.shape.with_changes(
        # Where fingers stand apart further than they can be spread, they do so at rest.
        rest=hand.shape.rest + (hand.pose - pose)[5::4],
        arm=_arm(features.silhouette.mask, hand),
    )
    pose[:2] = features.silhouette.in_picture(hand.pose[:2])
    return OpenHand(pose, hand.scale * features.silhouette.reduction, shape, misfit, remarks)


def _initial_guess(features: HandFeatures) -> FlatHand:
    """Return a first guess from five protrusions."""
    fingers = [measure_finger(protrusion) for protrusion in _five(features.protrusions)]
    fingers, side = _order(fingers, features.wrist)
    bases = np.array([finger.base for finger in fingers[1:]])
    tips = np.array([finger.tip for finger in fingers[1:]])
    row = math.dist(bases[0], bases[-1])
    wrist = features.wrist
    if wrist is None:  # from the knuckles' row and the fingers' direction alone
        along = unit((tips - bases).mean(axis=0))
        wrist = bases.mean(axis=0) - along * row / _model_row()
    rough = math.dist(bases.mean(axis=0), wrist)
    ways = np.array([unit(finger.tip - finger.base) for finger in fingers[1:]])
    knuckles = bases - ROOT_BEHIND * rough * ways
    axis = knuckles.mean(axis=0) - wrist
    scale = math.hypot(*axis) / float(MODEL.roots[1:, 1].mean())
    # Rounded, so that the last bits of an arc tangent, which differ by machine, decide about nothing.
    turn = round(math.atan2(-axis[0], -axis[1]), 6)
    across = knuckles[0] - knuckles[-1]
    breadth = side * (across[0] * math.cos(turn) - across[1] * math.sin(turn)) / scale
    if scale < LEAST_SCALE_PX:
        raise NoOpenHandError(TOO_SMALL.format(scale))
    if breadth < LEAST_ROW * _model_row():
        raise NoOpenHandError("the palm is seen from its side: turn it to the camera")
    return hand_of(wrist, turn, scale, side, dict(enumerate(fingers)))


def _five(protrusions: tuple[Protrusion, ...]) -> list[Protrusion]:
    """Return the five that are fingers; of more than five those that are clearly shorter are left out."""
    by_length = sorted(protrusions, key=lambda protrusion: -len(protrusion.axis))
    if len(by_length) > 5:
        least = LONGER_THAN_THE_REST * len(by_length[3].axis)
        by_length = [protrusion for protrusion in by_length if len(protrusion.axis) >= least]
    if len(by_length) != 5:
        seen = (
            ("no finger is", "one finger is")[len(by_length)] if len(by_length) < 2 else f"{len(by_length)} fingers are"
        )
        raise NoOpenHandError(f"{seen} seen: hold up an open hand with its five fingers spread, the palm to the camera")
    return by_length


def _order(fingers: list[SeenFinger], wrist: NDArray[np.float64] | None) -> tuple[list[SeenFinger], float]:
    """Return five fingers from the thumb to the little finger, and the thumb's side: 1 if that is counter-clockwise.

    Shimada looks at the distances between neighbours' palm sides alone. Tips, roots and wrist together tell more:
    of 144 simulated hands they told all, and those distances 140.
    """
    around = around_hand(fingers, np.array([finger.base for finger in fingers]).mean(axis=0))
    orders = {1.0: around, -1.0: around[::-1]}
    guesses = [similar(dict(enumerate(order)), wrist, side) for side, order in orders.items()]
    best, other = sorted(guesses, key=attrgetter("off"))
    if other.off < CLEARLY * best.off:
        raise NoOpenHandError("the thumb cannot be distinguished from the little finger: spread it")
    return orders[best.side], best.side


def around_hand(fingers: list[SeenFinger], centre: NDArray[np.float64]) -> list[SeenFinger]:
    """Return fingers in their order around a place (2,), counter-clockwise on the screen from the arm on."""
    angles = [math.atan2(centre[1] - finger.tip[1], finger.tip[0] - centre[0]) for finger in fingers]
    order = sorted(range(len(fingers)), key=angles.__getitem__)
    gaps = [(angles[after] - angles[before]) % (2.0 * math.pi) for before, after in pairwise([*order, order[0]])]
    first = gaps.index(max(gaps)) + 1  # the arm is where no finger is
    return [fingers[number] for number in order[first:] + order[:first]]


def _guess_from_tips(features: HandFeatures, tips: NDArray[np.float64]) -> FlatHand:
    """Return a first guess from five marked tips (5, 2), px of the mask."""
    reach = NEAR_MARK * max(np.ptp(tips, axis=0).tolist())
    pairs = sorted(
        (math.dist(tip, protrusion.axis[0]), finger, number)
        for finger, tip in enumerate(tips)
        for number, protrusion in enumerate(features.protrusions)
    )
    seen: dict[int, SeenFinger] = {}
    taken: set[int] = set()
    for away, finger, number in pairs:
        if away <= reach and finger not in seen and number not in taken:
            seen[finger] = measure_finger(features.protrusions[number])._replace(tip=tips[finger])
            taken.add(number)
    if len(seen) < 2:
        raise NoOpenHandError(
            "fewer than two of the marked tips belong to fingers that are seen: two that are straight are needed"
        )
    guess = min((similar(seen, features.wrist, side) for side in (1.0, -1.0)), key=attrgetter("off"))
    if guess.scale < LEAST_SCALE_PX:
        raise NoOpenHandError(TOO_SMALL.format(guess.scale))
    hand = hand_of(guess.wrist, guess.turn, guess.scale, guess.side, seen)
    return hand._replace(pose=fold(hand, {finger: tips[finger] for finger in range(5) if finger not in seen}))


def _check(hand: FlatHand, misfit: float, *, marked: bool) -> tuple[str, ...]:
    """Return what a person may want to check of a fitted hand; refuse one that is none."""
    remarks = []
    odd = f"what is seen differs from an open hand in {100 * misfit:.0f} % of its pixels"
    if misfit > LARGEST_MISFIT:
        if not marked:
            raise NoOpenHandError(f"{odd}: hold the palm to the camera, with the fingers straight and spread")
        remarks.append(odd)
    lengths = (hand.shape.phalanges / MODEL.phalanges).mean(axis=1)
    for finger, length in zip(FINGERS, lengths.tolist(), strict=True):
        if not LENGTHS[0] < length < LENGTHS[1]:
            if not marked:
                raise NoOpenHandError(
                    f"the {finger} is {length:.1f} times as long as usual: hold all fingers straight and flat"
                )
            remarks.append(f"the {finger} is {length:.1f} times as long as usual")
    if hand.shape.side < 0.0:
        remarks.append("with the fingers upwards the thumb is on the left: a left palm, or the back of a right hand")
    if math.cos(hand.pose[2]) < FROM_ABOVE:
        remarks.append("the arm comes from above")
    return tuple(remarks)


def _arm(mask: NDArray[np.bool_], hand: FlatHand) -> tuple[float, float]:
    """Return half the width of the forearm as it is seen, in palm axes, and a length that reaches the border."""
    cosine, sine = math.cos(hand.pose[2]), math.sin(hand.pose[2])
    across, along = np.array([cosine, -sine]), np.array([-sine, -cosine])
    steps = np.arange(-round(hand.scale), round(hand.scale) + 1)
    widths = []
    for down in ARM_AT:
        places = hand.pose[:2] - down * hand.scale * along + steps[:, None] * across
        columns, rows = np.rint(places).astype(np.int64).T
        inside = (columns >= 0) & (rows >= 0) & (columns < mask.shape[1]) & (rows < mask.shape[0])
        if inside[len(steps) // 2]:
            widths.append(int(mask[rows[inside], columns[inside]].sum()))
    if not widths:
        return float(MODEL.arm[0]), ARM_LENGTH
    return min(max(0.5 * sorted(widths)[len(widths) // 2] / hand.scale, 0.1), 0.6), ARM_LENGTH


def _model_row() -> float:
    """Return the distance of the index finger's root from the little finger's, in palm axes."""
    return math.dist(MODEL.roots[1, :2], MODEL.roots[4, :2])
