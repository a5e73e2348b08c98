"""A proposal for the first pose where fewer than five fingers are seen: which they may be.

Two to four protrusions are taken for every choice of as many fingers in their order around the hand, of a right and of
a left palm, with the other fingers folded. The choice whose silhouette is most like the one that is seen is proposed.
It is a guess, and handed on as one: a person who looks at the picture confirms it, or drags the tips to where they
are. A tracker that begins by itself waits for an open hand (`pftrack.experiments.hand.first_pose`).
"""

from collections.abc import Iterator
from itertools import combinations
from operator import itemgetter
from typing import NamedTuple

import cv2
import numpy as np

from pftrack.core.arrays import Floats
from pftrack.experiments.hand.fingers import HandFeatures
from pftrack.experiments.hand.first_pose import (
    FlatHand,
    NoOpenHandError,
    SeenFinger,
    around_hand,
    find_open_hand,
    fit_hand,
    hand_of,
    measure_finger,
    misfit_of,
    similar,
)
from pftrack.experiments.hand.shape import FINGERS, HIGH, finger_slice, joints

FOLDED = 0.8
"""Of a folded finger's flexion, in the largest."""
FITTED = 4
"""Of the choices, those that are most like what is seen are fitted."""
LARGEST_MISFIT = 0.3

USUAL = {(1, 2), (1, 2, 3), (1, 2, 3, 4), (0, 1), (0, 1, 2), (0, 1, 2, 3), (0, 4), (1, 4), (0, 1, 4), (2, 3, 4)}
UNUSUAL = 0.05
"""Fingers that people raise together, 0 being the thumb; others must fit better by this share of the pixels."""


class ProposedTips(NamedTuple):
    """Where the tips of a hand may be.

    Attributes:
        tips: (5, 2) thumb first, px of the picture.
        seen: (5,) which of them are seen rather than guessed.
        remarks: What it was taken for, in words.
    """

    tips: Floats
    seen: tuple[bool, ...]
    remarks: tuple[str, ...]


def propose(features: HandFeatures) -> ProposedTips:
    """Return where the five tips of the hand in a silhouette may be.

    Args:
        features: Of the silhouette.

    Raises:
        NoOpenHandError: It shows no hand, or none of which at least two fingers are seen, with the reason.
    """
    try:
        hand = find_open_hand(features)
    except NoOpenHandError as error:
        if not features.finding.ok or not 2 <= len(features.protrusions) <= 4:
            raise
        return _of_some(features, str(error))
    return ProposedTips(joints(hand.pose, hand.scale, hand.shape)[:, 3, :2], (True,) * 5, hand.remarks)


def _of_some(features: HandFeatures, reason: str) -> ProposedTips:
    """Return the tips of the choice of fingers that fits best."""
    mask = features.silhouette.mask
    choices = [
        (misfit_of(mask, hand) + _unusual(seen), number, hand, seen)
        for number, (hand, seen) in enumerate(_choices(features))
    ]
    fits = [(fit_hand(mask, hand), seen) for _, _, hand, seen in sorted(choices, key=itemgetter(0, 1))[:FITTED]]
    fit, seen = min(fits, key=lambda found: found[0].cost + _unusual(found[1]))
    if fit.misfit > LARGEST_MISFIT:
        raise NoOpenHandError(reason)
    tips = joints(fit.hand.pose, fit.hand.scale, fit.hand.shape)[:, 3, :2]
    for finger, found in seen.items():
        tips[finger] = found.tip
    names = [FINGERS[finger] for finger in sorted(seen)]
    palm = "right" if fit.hand.shape.side > 0.0 else "left"
    taken = (
        f"{len(seen)} fingers are seen; they were taken for {', '.join(names[:-1])} and {names[-1]} of a {palm} palm, "
        "or of the other hand's back: drag the tips to where they are if they are others"
    )
    return ProposedTips(features.silhouette.in_picture(tips), tuple(finger in seen for finger in range(5)), (taken,))


def _choices(features: HandFeatures) -> Iterator[tuple[FlatHand, dict[int, SeenFinger]]]:
    """Yield hands with some fingers raised and the others folded, and which fingers the protrusions are."""
    depths = cv2.distanceTransform(features.silhouette.mask.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    row, column = divmod(int(np.argmax(depths)), depths.shape[1])
    palm = np.array([column, row], np.float64)
    around = around_hand([measure_finger(protrusion) for protrusion in features.protrusions], palm)
    for chosen in combinations(range(5), len(around)):
        for side in (1.0, -1.0):
            seen = dict(zip(chosen, around[:: int(side)], strict=True))
            found = similar(seen, features.wrist, side, palm)
            hand = hand_of(found.wrist, found.turn, found.scale, side, seen)
            for finger in set(range(5)) - seen.keys():
                flexions = finger_slice(finger)
                hand.pose[flexions.start + 1 : flexions.stop] = FOLDED * HIGH[flexions.start + 1 : flexions.stop]
            yield hand, seen


def _unusual(seen: dict[int, SeenFinger]) -> float:
    return 0.0 if tuple(sorted(seen)) in USUAL else UNUSUAL
