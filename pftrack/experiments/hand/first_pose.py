"""The first pose: an open hand that faces the camera, found automatically (Shimada 1997, section 2.4).

Five protrusions are ordered around the hand, and the model is laid over them with the thumb at either end; the better
fit gives the thumb's side. A left palm looks like the back of a right hand, and both are accepted. The roots of the
four fingers and the wrist give place, turn and size; the similar triangle of the model gives the root of the thumb.
Along each finger joints lie in the model's ratios, and the palm's thickness is proportional to the fingers' mean width.
Then the whole is fitted to the silhouette, since the wrist is measured only to about five per cent of the palm.

A sentence says why a picture is unsuitable: a fist, two hands, a hand cut by the border or seen from its side. A user
may mark the five tips instead. Then fingers are assigned to the nearest marks, and a hidden finger is bent until its
tip is nearest to its mark.
"""

import math
from collections.abc import Callable
from itertools import pairwise
from operator import attrgetter, itemgetter
from typing import NamedTuple

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.geometry import fill
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponential, logarithm, sines_cosines
from pftrack.core.refusal import RefusedError
from pftrack.experiments.hand.fingers import HandFeatures, Protrusion
from pftrack.experiments.hand.shape import FINGERS as FINGER_NAMES
from pftrack.experiments.hand.shape import HIGH, LOW, MODEL, HandShape, finger_slice, joints, open_pose, parts

# The flat hand is fitted by place, turn and size, and by this person's deviations from the model: the palm's breadth,
# and direction, length and width of each finger. Steps in one quantity after the other reduce the number of pixels that
# belong to only one of the silhouettes; the steps become smaller where none helps (pattern search; R. Hooke and T.
# Jeeves 1961). A rough edge has as many extra as missing pixels, so it does not bias the fit. A weak prior keeps what
# the pixels do not decide near the model. The arm is left out: sleeves have any width.

TURN, SIZE, BREADTH, FINGERS = 2, 3, 4, 5
"""Indices of the quantities among the twenty, after the place in palm axes of the start: turn in rad, logarithms of
size and breadth; then the spread of each finger in rad and the logarithms of its length and width."""
QUANTITIES = 20

STEPS = np.array([0.04, 0.04, 0.04, 0.04, 0.05] + 5 * [0.06, 0.06, 0.08])
PRIOR = np.array([np.inf, np.inf, np.inf, np.inf, 0.04] + 5 * [0.12, 0.12, 0.12])
"""First steps, and standard deviations over people."""
HALVINGS = 4
LEAST_GAIN = 0.5
"""Least gain of a step, in pixels."""
PRIOR_SHARE = 6e-3
"""Cost of one standard deviation, as a share of the hand's pixels."""
ARM_BELOW = 0.1
"""Height above the wrist, in palm axes, below which pixels do not count."""


class FlatHand(NamedTuple):
    """A hand that faces the camera.

    Attributes:
        pose: (25,).
        scale: Length of the palm axis, px.
        shape: Shape of this person's hand.
    """

    pose: Floats
    scale: float
    shape: HandShape


def apply_changes(start: FlatHand, changes: Floats) -> FlatHand:
    """Return a hand changed by twenty quantities.

    The place is the middle of the knuckles. Turn and size affect only the palm: the fingers keep directions, lengths
    and widths in the picture, so each quantity can be searched separately.
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


def _knuckles(hand: FlatHand) -> Floats:
    """Return the middle (2,) of the knuckles of the four fingers, px."""
    return np.asarray(joints(hand.pose, hand.scale, hand.shape)[1:, 0, :2].mean(axis=0))


class Fit(NamedTuple):
    """The result of a fit.

    Attributes:
        hand: The fitted hand.
        misfit: Share of the silhouette's pixels that differ.
        cost: The same with how unlike the model the hand is: by this, fits are compared.
    """

    hand: FlatHand
    misfit: float
    cost: float


def misfit_of(mask: Bools, hand: FlatHand) -> float:
    """Return the share of a mask's pixels (height, width) above the wrist in which it differs from a hand's."""
    region = _above_wrist(mask.shape, hand)
    off = disagreement(mask, region, hand.pose, hand.scale, hand.shape)
    return off / max(int(np.count_nonzero(mask & region)), 1)


def fit_hand(mask: Bools, start: FlatHand) -> Fit:
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

    def cost(changes: Floats) -> float:
        hand = apply_changes(start, changes)
        off = disagreement(mask, region, hand.pose, hand.scale, hand.shape)
        strange: Floats = (unlike + changes) / PRIOR
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
            # Continue along the round's change, since quantities depend on one another.
            onwards = 2.0 * changes - before
            improved = bool((changes != before).any())
            if improved:
                tried, found = _around(cost, onwards, cost(onwards), steps)
                if found < least - LEAST_GAIN:
                    changes, least = tried, found
        steps /= 2.0
    hand = apply_changes(start, changes)
    return Fit(hand, disagreement(mask, region, hand.pose, hand.scale, hand.shape) / pixels, least / pixels)


def _around(cost: Callable[[Floats], float], changes: Floats, least: float, steps: Floats) -> tuple[Floats, float]:
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
def disagreement(mask: Bools, region: Bools, pose: Floats, scale: float, shape: HandShape) -> int:
    """Return the number of pixels of a region that belong to only one of a mask and a hand's silhouette.

    Args:
        mask: (height, width) what is seen.
        region: (height, width) where it counts.
        pose: (25,).
        scale: Length of the palm axis, px of the mask.
        shape: Shape of the hand.
    """
    corners, counts = parts(pose, scale, shape)
    height, width = mask.shape
    drawn = fill(corners, counts, height, width)
    off = 0
    for row in range(height):
        for column in range(width):
            off += region[row, column] and mask[row, column] != drawn[row, column]
    return off


def _above_wrist(size: tuple[int, ...], hand: FlatHand) -> Bools:
    """Return (height, width) which pixels are on the fingers' side of the wrist."""
    sines, cosines = sines_cosines(hand.pose[2:3])
    rows, columns = np.indices(size)
    along = -sines[0] * (columns - hand.pose[0]) - cosines[0] * (rows - hand.pose[1])
    return np.asarray(along > ARM_BELOW * hand.scale)


# To guess a hand, place, turn and size come from points that the model shares, such as tips and roots of straight
# fingers. Then each finger that is seen gets its direction, length and width; the palm's thickness goes with the mean
# width.

ROOT_BEHIND = 0.10
"""Distance of a finger's root behind the end of its protrusion, in palm axes: the web of the fingers is wider."""
FIRST_LENGTHS, FIRST_WIDTHS = (0.5, 2.0), (0.5, 2.0)
"""Range of lengths and widths, relative to the model."""
PALM_MIDDLE = np.array([0.0, -0.62])
"""Centre of the model's palm, the point farthest from its edge: column and row in palm axes."""
ARM_LENGTH = 4.0
"""Length of the forearm, in palm axes, beyond any border."""
FLEXIONS = 41
"""Flexions that are tried for a bent finger."""


class SeenFinger(NamedTuple):
    """One measured finger: tip and root at the palm (2,), and its half width, px of the mask."""

    tip: Floats
    base: Floats
    radius: float


def measure_finger(protrusion: Protrusion) -> SeenFinger:
    """Return a protrusion as a finger, with the median of its half widths away from the ends."""
    middle = protrusion.radii[len(protrusion.radii) // 8 : max(3 * len(protrusion.radii) // 4, 1)]
    return SeenFinger(protrusion.axis[0], protrusion.axis[-1], float(np.sort(middle)[len(middle) // 2]))


class Similarity(NamedTuple):
    """The place of the model's palm in a picture, and its fit.

    Attributes:
        off: Sum of squared distances between places and the model's, in palm axes.
        turn: On the screen, rad.
        scale: Length of the palm axis, px.
        wrist: (2,) px.
        side: Side of the thumb, 1 or -1.
    """

    off: float
    turn: float
    scale: float
    wrist: Floats
    side: float


def similar(seen: dict[int, SeenFinger], wrist: Floats | None, side: float, palm: Floats | None = None) -> Similarity:
    """Return the misfit of the model with straight fingers to roots, tips and wrist; and turn, scale, wrist, side."""
    model = joints(open_pose((0.0, 0.0)), 1.0, MODEL.with_changes(side=side))[:, :, :2]
    here, there = [], []
    for finger, found in seen.items():
        way = unit(found.tip - found.base)
        length = math.dist(found.tip, found.base)
        root = found.base - ROOT_BEHIND * length / 0.9 * way
        here.append(model[finger, 3])
        there.append(found.tip)
        if finger:  # the thumb's root is hidden in the palm
            here.append(model[finger, 0])
            there.append(root)
    for place, found_at in ((np.zeros(2), wrist), (PALM_MIDDLE, palm)):
        if found_at is not None:
            here.append(place)
            there.append(found_at)
    points, places = np.array(here), np.array(there)
    middle, at = points.mean(axis=0), places.mean(axis=0)
    points, places = points - middle, places - at
    along = float((points * places).sum())
    across = float((points[:, 1] * places[:, 0] - points[:, 0] * places[:, 1]).sum())
    turn = round(math.atan2(across, along), 6)
    scale = math.hypot(along, across) / float(np.square(points).sum())
    cosine, sine = scale * math.cos(turn), scale * math.sin(turn)
    turned = np.stack(
        [cosine * points[:, 0] + sine * points[:, 1], cosine * points[:, 1] - sine * points[:, 0]], axis=1
    )
    origin = at - np.array([cosine * middle[0] + sine * middle[1], cosine * middle[1] - sine * middle[0]])
    return Similarity(float(np.square(turned - places).sum()) / (scale * scale), turn, scale, origin, side)


def hand_of(wrist: Floats, turn: float, scale: float, side: float, seen: dict[int, SeenFinger]) -> FlatHand:
    """Return an open hand with the directions, lengths and widths of the fingers that are seen."""
    # Rounded, so the last bits of a cosine, which differ by machine, have no effect.
    wrist, scale = np.round(wrist, 6), round(scale, 6)
    shape = MODEL.with_changes(side=side)
    pose = open_pose(wrist, turn)
    model = joints(pose, scale, shape)[:, :, :2]
    rest, lengths, widths = shape.rest.copy(), np.ones(5), np.ones(5)
    for finger, found in seen.items():
        expected, way = model[finger, 3] - model[finger, 0], found.tip - model[finger, 0]
        lengths[finger] = min(max(math.hypot(*way) / math.hypot(*expected), FIRST_LENGTHS[0]), FIRST_LENGTHS[1])
        widths[finger] = min(
            max(found.radius / (scale * float(shape.radii[finger].mean())), FIRST_WIDTHS[0]), FIRST_WIDTHS[1]
        )
        # Counter-clockwise on the screen; on the other side of a mirror spread is clockwise.
        turned = math.atan2(expected[1] * way[0] - expected[0] * way[1], float((expected * way).sum()))
        spread = round(side * turned, 6)
        first = finger_slice(finger).start
        pose[first] = min(max(spread, LOW[first]), HIGH[first])
        rest[finger] += spread - pose[first]
    for finger in set(range(1, 5)) - seen.keys():
        widths[finger] = np.mean([widths[other] for other in seen])
    thickness = float(np.mean(widths[1:]))
    return FlatHand(
        pose,
        scale,
        shape.with_changes(
            rest=rest,
            phalanges=shape.phalanges * lengths[:, None],
            radii=shape.radii * widths[:, None],
            thickness=shape.thickness * thickness,
            arm=(shape.arm[0], ARM_LENGTH),
        ),
    )


def fold(hand: FlatHand, tips: dict[int, Floats]) -> Floats:
    """Return the pose of a hand with further fingers bent until their tips are nearest to marks."""
    pose = hand.pose.copy()
    for finger, tip in tips.items():
        bends = finger_slice(finger)
        tried = []
        for flexion in np.linspace(0.0, 1.0, FLEXIONS):
            other = pose.copy()
            other[bends.start + 1 : bends.stop] = flexion * HIGH[bends.start + 1 : bends.stop]
            tried.append((math.dist(joints(other, hand.scale, hand.shape)[finger, 3, :2], tip), flexion, other))
        pose = min(tried, key=itemgetter(0, 1))[2]
    return pose


def unit(way: Floats) -> Floats:
    """Return a vector of unit length."""
    return np.asarray(way / max(math.hypot(*way), 1e-9))


CLEARLY = 1.4
"""Required ratio of the misfits with and without thumb and little finger exchanged."""
LEAST_SCALE_PX = 16.0
TOO_SMALL = f"the hand is too small: its palm is {{:.0f}} px long, and {LEAST_SCALE_PX:g} are needed"
LARGEST_MISFIT = 0.18
"""Share of the silhouette's pixels, without the arm, that may differ from the fitted hand's."""
LENGTHS = (0.72, 1.4)
"""Range of a finger's length, relative to the model."""
LEAST_ROW = 0.55
"""Least breadth of the knuckles' row, relative to the model; a smaller one is a palm seen from its side."""
ARM_AT = tuple(0.1 * step for step in range(2, 9))
"""Distance below the wrist at which the forearm's width is measured, and a length that reaches any border, in palm
axes."""
FROM_ABOVE = -0.5
"""Cosine of the turn on the screen."""
NEAR_MARK = 0.12
"""Largest distance of a mark from a finger's tip, as a share of the marks' extent."""
LONGER_THAN_THE_REST = 0.45
"""If there are more than five, a protrusion shorter than this share of the fourth longest is not a finger."""


class OpenHand(NamedTuple):
    """An open hand that was found, in px of the picture.

    Attributes:
        pose: (25,).
        scale: Length of the palm axis, px.
        shape: Shape of this person's hand; its `side` is -1 if the thumb is on the left of the fingers.
        misfit: Share of the silhouette's pixels, without the arm, that differ from this hand's.
        remarks: Points to check, in words.
    """

    pose: Floats
    scale: float
    shape: HandShape
    misfit: float
    remarks: tuple[str, ...]


def find_open_hand(features: HandFeatures, tips: Floats | None = None) -> OpenHand:
    """Return the open hand that a silhouette shows.

    Args:
        features: Features of the silhouette.
        tips: (5, 2) tips marked by the user, thumb first, px of the picture; None without marks.

    Raises:
        RefusedError: The picture does not show an open hand; the sentence says why.
    """
    if not features.finding.ok:
        raise RefusedError(features.finding.value)
    start = _initial_guess(features) if tips is None else _guess_from_tips(features, features.silhouette.in_mask(tips))
    hand, misfit, _ = fit_hand(features.silhouette.mask, start)
    remarks = _check(hand, misfit, marked=tips is not None)
    pose = np.clip(hand.pose, LOW, HIGH)
    shape = hand.shape.with_changes(
        # Fingers further apart than they can be spread are so at rest.
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
    # Rounded, so the last bits of an arc tangent, which differ by machine, have no effect.
    turn = round(math.atan2(-axis[0], -axis[1]), 6)
    across = knuckles[0] - knuckles[-1]
    breadth = side * (across[0] * math.cos(turn) - across[1] * math.sin(turn)) / scale
    if scale < LEAST_SCALE_PX:
        raise RefusedError(TOO_SMALL.format(scale))
    if breadth < LEAST_ROW * _model_row():
        raise RefusedError("the palm is seen from its side: turn it to the camera")
    return hand_of(wrist, turn, scale, side, dict(enumerate(fingers)))


def _five(protrusions: tuple[Protrusion, ...]) -> list[Protrusion]:
    """Return the five fingers; if there are more than five, clearly shorter ones are left out."""
    by_length = sorted(protrusions, key=lambda protrusion: -len(protrusion.axis))
    if len(by_length) > 5:
        least = LONGER_THAN_THE_REST * len(by_length[3].axis)
        by_length = [protrusion for protrusion in by_length if len(protrusion.axis) >= least]
    if len(by_length) != 5:
        seen = (
            ("no finger is", "one finger is")[len(by_length)] if len(by_length) < 2 else f"{len(by_length)} fingers are"
        )
        raise RefusedError(f"{seen} seen: hold up an open hand with its five fingers spread, the palm to the camera")
    return by_length


def _order(fingers: list[SeenFinger], wrist: Floats | None) -> tuple[list[SeenFinger], float]:
    """Return five fingers from the thumb to the little finger, and the thumb's side: 1 if that is counter-clockwise.

    Shimada uses only the distances between neighbours' palm sides. Tips, roots and wrist together are better: they were
    right for all of 144 simulated hands, those distances for 140.
    """
    around = around_hand(fingers, np.array([finger.base for finger in fingers]).mean(axis=0))
    orders = {1.0: around, -1.0: around[::-1]}
    guesses = [similar(dict(enumerate(order)), wrist, side) for side, order in orders.items()]
    best, other = sorted(guesses, key=attrgetter("off"))
    if other.off < CLEARLY * best.off:
        raise RefusedError("the thumb cannot be distinguished from the little finger: spread it")
    return orders[best.side], best.side


def around_hand(fingers: list[SeenFinger], centre: Floats) -> list[SeenFinger]:
    """Return fingers in their order around a place (2,), counter-clockwise on the screen from the arm on."""
    angles = [math.atan2(centre[1] - finger.tip[1], finger.tip[0] - centre[0]) for finger in fingers]
    order = sorted(range(len(fingers)), key=angles.__getitem__)
    gaps = [(angles[after] - angles[before]) % (2.0 * math.pi) for before, after in pairwise([*order, order[0]])]
    first = gaps.index(max(gaps)) + 1  # the arm is where no finger is
    return [fingers[number] for number in order[first:] + order[:first]]


def _guess_from_tips(features: HandFeatures, tips: Floats) -> FlatHand:
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
        raise RefusedError(
            "fewer than two of the marked tips belong to fingers that are seen: two that are straight are needed"
        )
    guess = min((similar(seen, features.wrist, side) for side in (1.0, -1.0)), key=attrgetter("off"))
    if guess.scale < LEAST_SCALE_PX:
        raise RefusedError(TOO_SMALL.format(guess.scale))
    hand = hand_of(guess.wrist, guess.turn, guess.scale, guess.side, seen)
    return hand._replace(pose=fold(hand, {finger: tips[finger] for finger in range(5) if finger not in seen}))


def _check(hand: FlatHand, misfit: float, *, marked: bool) -> tuple[str, ...]:
    """Return points to check on a fitted hand; refuse one that is not a hand."""
    remarks = []
    odd = f"what is seen differs from an open hand in {100 * misfit:.0f} % of its pixels"
    if misfit > LARGEST_MISFIT:
        if not marked:
            raise RefusedError(f"{odd}: hold the palm to the camera, with the fingers straight and spread")
        remarks.append(odd)
    lengths = (hand.shape.phalanges / MODEL.phalanges).mean(axis=1)
    for finger, length in zip(FINGER_NAMES, lengths.tolist(), strict=True):
        if not LENGTHS[0] < length < LENGTHS[1]:
            if not marked:
                raise RefusedError(
                    f"the {finger} is {length:.1f} times as long as usual: hold all fingers straight and flat"
                )
            remarks.append(f"the {finger} is {length:.1f} times as long as usual")
    if hand.shape.side < 0.0:
        remarks.append("with the fingers upwards the thumb is on the left: a left palm, or the back of a right hand")
    if math.cos(hand.pose[2]) < FROM_ABOVE:
        remarks.append("the arm comes from above")
    return tuple(remarks)


def _arm(mask: Bools, hand: FlatHand) -> tuple[float, float]:
    """Return half the measured width of the forearm, in palm axes, and a length that reaches the border."""
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
