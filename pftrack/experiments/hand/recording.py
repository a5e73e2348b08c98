"""A recording of a hand: the first hand, the separation of the hand from the rest, and the error.

A mark is not required: the tracker searches for an open hand and follows it from its first picture. A user may mark the
five tips to correct it, or to begin with a hand that is not open.

A hand is *right* if its tips are off by less than 0.20 palm axes on average, every angle of the palm by less than 0.30
rad, and the flexions of the fingers by less than 0.30 rad on average. Three things may be right: the most probable hand
of a frame, any kept hand, and, once the last frame is known, each frame's ancestor of the last best hand
(docs/methods/hands.md).
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import combinations
from operator import itemgetter
from typing import Any, ClassVar, NamedTuple, Self

import cv2
import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.model.marks import FeaturePoints
from pftrack.core.model.parameters import revise
from pftrack.core.model.recipe import Footage
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.setup import Finder, Setup, Sighting, Suitability, grade
from pftrack.core.model.source import Frame, FrameSequence, Target, Truth
from pftrack.core.model.tracker import Diagnostics
from pftrack.core.refusal import RefusedError
from pftrack.experiments.hand import first_pose
from pftrack.experiments.hand.fingers import HandFeatures, features_of
from pftrack.experiments.hand.model import NO_FINGER, HandState, HandTrackerParameters
from pftrack.experiments.hand.scene import HandTarget
from pftrack.experiments.hand.shape import FINGERS, HIGH, finger_slice, joints
from pftrack.experiments.hand.silhouette import Finding, suggest_parameters
from pftrack.experiments.shared import recording
from pftrack.filters.beam import backtrack

TIPS = {
    "thumb": "Thumb",
    "index": "Index finger",
    "middle": "Middle finger",
    "ring": "Ring finger",
    "little": "Little finger",
}

OFFERED = {
    "thumb": (0.72, 0.52),
    "index": (0.62, 0.3),
    "middle": (0.5, 0.24),
    "ring": (0.39, 0.29),
    "little": (0.29, 0.4),
}
"""Places for a right hand that shows its palm, so the user sees which point belongs to which finger."""


class HandTips(FeaturePoints):
    """The five tips of an open hand."""

    title: ClassVar[str] = "Tips of the fingers"
    instruction: ClassVar[str] = (
        "Drag each point to the tip of its finger, that of a folded finger to where its tip is; two fingers at least "
        "have to be straight."
    )
    features: ClassVar[Mapping[str, str]] = TIPS
    joined: ClassVar[tuple[tuple[str, str], ...]] = tuple(zip(list(TIPS), list(TIPS)[1:], strict=False))
    offered: ClassVar[Mapping[str, tuple[float, float]]] = OFFERED

    @classmethod
    def of_target(cls, target: Target) -> Self | None:
        """Return the tips of a hand that is known."""
        return cls.of(target.tips) if isinstance(target, HandTarget) else None

    @classmethod
    def of(cls, tips: Floats) -> Self:
        """Return the mark of tips (5, 2), thumb first, px."""
        return cls.model_validate({"points": dict(zip(TIPS, tips.tolist(), strict=True))})

    @property
    def tips(self) -> Floats:
        """(5, 2) the tips, thumb first, px; NaN where one is not marked."""
        return np.array([self.points.get(name, (np.nan, np.nan)) for name in TIPS])


to_search = partial(recording.frames_to_search, closely=60, most=400)
"""Each picture takes some ms."""

FAR_MARK, LOST_MARK = 0.25, 0.6
"""Largest distance of a tip from its mark, in palm axes, in a hand that fits well, and in one that fits at all."""

GROWTH_SD = 0.015
"""Relative growth of a hand from picture to picture, as when it approaches a real camera."""


class RecordedHandParameters(recording.RecordingParameters, HandTrackerParameters):
    """A recording with an overlay, and its trackers."""


def wire(sequence: FrameSequence, mark: HandTips | None, start: int, truth: Truth | None) -> Setup:
    """Wire a recording of a hand.

    Args:
        sequence: The pictures.
        mark: The tips of the fingers in the picture `start`; None to search for an open hand.
        start: Number of the picture to start at, or to look for an open hand from.
        truth: Not used, since the truth of hands is unknown.

    Raises:
        ValueError: It does not begin with a hand; the sentence says why.
    """
    if mark is None:
        start, mark = _first(sequence, start)
        mark.check(sequence.size)
    parameters = _parameters(sequence, start)
    hand = first_pose.find_open_hand(_features(sequence, start, parameters), mark.tips)
    target = HandTarget.of(hand.pose, hand.scale, hand.shape, hand.shape, hidden=None)
    source = recording.RecordingSource(sequence, (0.0, 0.0, 1.0, 1.0), start, None, start=target)
    return Setup(lambda _seed, _parameters: source, parameters, Footage.of(sequence, mark, start, truth))


def search(sequence: FrameSequence, frames: Sequence[int]) -> Iterator[Sighting]:
    """Search for an open hand in one picture after the other; the error explains the first picture's problem.

    In a single picture a hand that is not open is guessed as well, for the user to confirm.
    """
    for place, frame in enumerate(frames):
        features = _features(sequence, frame, _parameters(sequence, frame))
        try:
            found = first_pose.find_open_hand(features)
        except RefusedError as error:
            if len(frames) == 1:
                yield _guess(features, frame, str(error))
            else:
                yield Sighting(frame, remarks=(str(error),) if place == 0 else ())
        else:
            yield Sighting(frame, _tips(found), sure=True, remarks=found.remarks)


def _tips(found: first_pose.OpenHand) -> HandTips:
    """Return the tips of an open hand that was found."""
    return HandTips.of(HandTarget.of(found.pose, found.scale, found.shape, found.shape).tips)


def _guess(features: HandFeatures, frame: int, reason: str) -> Sighting:
    """Return guessed tips of a hand that is not open; if no guess is possible, why no open hand was found."""
    try:
        found = propose(features)
    except RefusedError:
        return Sighting(frame, remarks=(reason,))
    placed = tuple(f"points.{name}" for name, seen in zip(TIPS, found.seen, strict=True) if not seen)
    return Sighting(frame, HandTips.of(found.tips), placed=placed, remarks=found.remarks)


# A proposal for the first pose where fewer than five fingers are visible.
#
# Two to four protrusions are matched with every choice of as many fingers in their order around the hand, of a right
# and of a left palm, with the other fingers folded. The proposal is the choice whose silhouette is most similar to the
# measured one. It is only a guess: the user confirms it, or drags the tips to their places. A tracker that begins
# automatically waits for an open hand (`pftrack.experiments.hand.first_pose`).

FOLDED = 0.8
"""Flexion of a folded finger, as a share of the largest."""
FITTED = 4
"""Number of the most similar choices that are fitted."""
LARGEST_MISFIT = 0.3

USUAL = {(1, 2), (1, 2, 3), (1, 2, 3, 4), (0, 1), (0, 1, 2), (0, 1, 2, 3), (0, 4), (1, 4), (0, 1, 4), (2, 3, 4)}
UNUSUAL = 0.05
"""Fingers that people raise together, 0 being the thumb; others must fit better by this share of the pixels."""


class ProposedTips(NamedTuple):
    """Proposed places of a hand's tips.

    Attributes:
        tips: (5, 2) thumb first, px of the picture.
        seen: (5,) whether each is seen rather than guessed.
        remarks: The interpretation, in words.
    """

    tips: Floats
    seen: tuple[bool, ...]
    remarks: tuple[str, ...]


def propose(features: HandFeatures) -> ProposedTips:
    """Return where the five tips of the hand in a silhouette may be.

    Args:
        features: Features of the silhouette.

    Raises:
        RefusedError: It does not show a hand with at least two visible fingers; the sentence says why.
    """
    try:
        hand = first_pose.find_open_hand(features)
    except RefusedError as error:
        if not features.finding.ok or not 2 <= len(features.protrusions) <= 4:
            raise
        return _of_some(features, str(error))
    return ProposedTips(joints(hand.pose, hand.scale, hand.shape)[:, 3, :2], (True,) * 5, hand.remarks)


def _of_some(features: HandFeatures, reason: str) -> ProposedTips:
    """Return the tips of the choice of fingers that fits best."""
    mask = features.silhouette.mask
    choices = [
        (first_pose.misfit_of(mask, hand) + _unusual(seen), number, hand, seen)
        for number, (hand, seen) in enumerate(_choices(features))
    ]
    fits = [
        (first_pose.fit_hand(mask, hand), seen) for _, _, hand, seen in sorted(choices, key=itemgetter(0, 1))[:FITTED]
    ]
    fit, seen = min(fits, key=lambda found: found[0].cost + _unusual(found[1]))
    if fit.misfit > LARGEST_MISFIT:
        raise RefusedError(reason)
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


def _choices(features: HandFeatures) -> Iterator[tuple[first_pose.FlatHand, dict[int, first_pose.SeenFinger]]]:
    """Yield hands with some fingers raised and the others folded, and which fingers the protrusions are."""
    depths = cv2.distanceTransform(features.silhouette.mask.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    row, column = divmod(int(np.argmax(depths)), depths.shape[1])
    palm = np.array([column, row], np.float64)
    around = first_pose.around_hand(
        [first_pose.measure_finger(protrusion) for protrusion in features.protrusions], palm
    )
    for chosen in combinations(range(5), len(around)):
        for side in (1.0, -1.0):
            seen = dict(zip(chosen, around[:: int(side)], strict=True))
            found = first_pose.similar(seen, features.wrist, side, palm)
            hand = first_pose.hand_of(found.wrist, found.turn, found.scale, side, seen)
            for finger in set(range(5)) - seen.keys():
                flexions = finger_slice(finger)
                hand.pose[flexions.start + 1 : flexions.stop] = FOLDED * HIGH[flexions.start + 1 : flexions.stop]
            yield hand, seen


def _unusual(seen: dict[int, first_pose.SeenFinger]) -> float:
    return 0.0 if tuple(sorted(seen)) in USUAL else UNUSUAL


FINDER = Finder(to_search, search, lambda _sequence, sighting: sighting, HandTips)


def suits(sequence: FrameSequence, footage: Footage, parameters: RecordedHandParameters) -> Suitability:
    """Return the fit of a recording's first hand to its silhouette and its marked tips.

    Two fingers of a hand cover about the same whichever they are taken for, but then some tip is far from its mark.
    """
    features, tips = _features(sequence, footage.start, parameters), HandTips.read(footage.mark).tips
    try:
        hand = first_pose.find_open_hand(features, tips)
    except RefusedError as error:
        return Suitability(
            0.0, str(error), ("change how the hand is separated from the background, or begin with another picture",)
        )
    seen = len(features.protrusions)
    fingers = "1 finger is" if seen == 1 else f"{seen} fingers are"
    remark = f"{fingers} seen, and the hand differs from the silhouette in {100 * hand.misfit:.0f} % of its area"
    advice, better = list(hand.remarks), None
    away, value = _distances(hand, tips), _fit(hand, tips)
    if away.max() > FAR_MARK:
        worst = int(away.argmax())
        remark += f"; where it fits best the tip of the {FINGERS[worst]} is {away[worst]:.2f} palms from its mark"
        turned = tips[::-1].copy()
        try:
            other = _fit(first_pose.find_open_hand(features, turned), turned)
        except RefusedError:
            other = 0.0
        if other > value:
            better = HandTips.of(turned)
            # The other remarks concern a hand that is the wrong way round.
            advice = ["the marks fit better the other way round, with the thumb at the other end"]
    if seen < len(TIPS):
        advice.append("begin with a picture in which all five fingers are spread, which shows their lengths")
    return Suitability(value, remark, tuple(advice), better)


def _fit(hand: first_pose.OpenHand, tips: Floats) -> float:
    """Return the fit of a hand, 0..1: the worse of its cover of the silhouette and its tips' distance from marks."""
    covered = grade(max(1.0 - hand.misfit, 0.0), 0.5, 0.8)
    return min(covered, grade(max(1.0 - float(_distances(hand, tips).max()), 0.0), 1.0 - LOST_MARK, 1.0 - FAR_MARK))


def _distances(hand: first_pose.OpenHand, tips: Floats) -> Floats:
    """Return the distances of a hand's tips from the marked ones (5, 2), px, in palms (5,)."""
    own = HandTarget.of(hand.pose, hand.scale, hand.shape, hand.shape).tips
    return np.asarray(np.hypot(*(own - tips).T) / hand.scale)


def _first(sequence: FrameSequence, start: int) -> tuple[int, HandTips]:
    """Return the number of the first picture with an open hand from one on, and its tips.

    Nothing is guessed here, not even for a single picture, because no user can confirm it.

    Raises:
        ValueError: There is none; it says why the first picture has none.
    """
    reason = ""
    for frame in to_search(start, sequence.frame_count - 1):
        try:
            return frame, _tips(first_pose.find_open_hand(_features(sequence, frame, _parameters(sequence, frame))))
        except RefusedError as error:
            reason = reason or str(error)
    raise ValueError(f"{reason}; or mark the tips of its fingers")


def _parameters(sequence: FrameSequence, frame: int) -> RecordedHandParameters:
    suggested = suggest_parameters(sequence.picture(frame), recording.RecordedBackdrop(sequence), frame)
    return revise(RecordedHandParameters(), {"growth_sd": GROWTH_SD, **suggested})


def _features(sequence: FrameSequence, frame: int, parameters: RecordedHandParameters) -> HandFeatures:
    return features_of(sequence.picture(frame), parameters, recording.RecordedBackdrop(sequence))


RIGHT_TIPS_PALMS, RIGHT_PALM_RAD, RIGHT_FLEXION_RAD = 0.20, 0.30, 0.30
OFF_PALMS, MUCH_NEARER = 0.3, 0.5
FLEXIONS = np.concatenate([np.arange(25)[finger_slice(finger)][1:] for finger in range(5)])
PALM = slice(2, 5)


class Errors(NamedTuple):
    """How far poses are from the truth.

    Attributes:
        tips: (K,) mean distance of the five tips in the picture, palm axes.
        palm: (K,) the largest of the palm's three angles, rad.
        flexion: (K,) mean over the fifteen flexions, rad.
    """

    tips: Floats
    palm: Floats
    flexion: Floats

    @classmethod
    def of(cls, poses: Floats, tips: Floats, target: HandTarget) -> "Errors":
        """Return the errors of poses (K, 25) whose tips (K, 15) are here, px."""
        off = (tips - target.position).reshape(len(tips), 5, 3)
        turned = np.abs(np.remainder(poses[:, PALM] - target.pose[PALM] + np.pi, 2.0 * np.pi) - np.pi)
        return cls(
            np.hypot(off[..., 0], off[..., 1]).mean(axis=1) / target.scale,
            turned.max(axis=1),
            np.abs(poses[:, FLEXIONS] - target.pose[FLEXIONS]).mean(axis=1),
        )

    @property
    def right(self) -> Bools:
        """(K,) whether each counts as right."""
        return (self.tips < RIGHT_TIPS_PALMS) & (self.palm < RIGHT_PALM_RAD) & (self.flexion < RIGHT_FLEXION_RAD)


def measure(frame: Frame, state: HandState) -> Mapping[str, SeriesValue]:
    """Return the values of the series where the true pose is known."""
    if not isinstance(frame.target, HandTarget):
        return {}
    errors, best = Errors.of(np.array(state.beam.members), state.tips, frame.target), state.beam.best
    right = errors.right.astype(np.float64)
    return {
        "tip_error": float(errors.tips[best]),
        "palm_error_rad": float(errors.palm[best]),
        "flexion_error_rad": float(errors.flexion[best]),
        "best_right": float(right[best]),
        "any_right": float(right.max()),
        "mirrored": float(is_mirrored(state.estimate, frame.target.position, frame.target.scale)),
        "true_tilt": float(frame.target.pose[3]),
        "hands_right": tuple(right.tolist()),
    }


def is_mirrored(believed: Floats, true: Floats, scale: float) -> bool:
    """Whether tips (15,) are off, and much nearer to the true ones mirrored at the wrist's depth: both look alike.

    Tips near that depth are as near to one as to the other.
    """
    tips, truth = believed.reshape(5, 3), true.reshape(5, 3)
    mirror = truth * np.array([1.0, 1.0, -1.0])
    off, mirrored = (np.sqrt(np.square(tips - other).sum(axis=1)).mean() for other in (truth, mirror))
    return bool(off > OFF_PALMS * scale and mirrored < MUCH_NEARER * off)


def report(rows: Sequence[Diagnostics]) -> Mapping[str, Any]:
    """Report the frames per second of a whole run, and how often its hands were right after the last frame.

    Frame 0, in which a tracker only begins, does not count.
    """
    spent_s = 1e-3 * sum(row.step_ms for row in rows[1:])
    said: dict[str, Any] = {"frames_per_second": (len(rows) - 1) / spent_s if spent_s > 0.0 else None}
    right = [row.vector("hands_right") or () for row in rows]
    hands = [row.hypotheses("hands") for row in rows]
    if len(rows) > 1 and all(right) and None not in hands:
        known = [each for each in hands if each is not None]
        parents = [np.array(each.parents or [-1] * len(each.weights)) for each in known]
        bests = [int(np.argmax(each.weights)) for each in known]
        found = backtrack(parents, bests[-1])
        path = np.where(found < 0, bests, found)  # before a restarted hand, the best hand of that time counts
        said["backtracked_right_share"] = float(
            np.mean([each[place] for each, place in zip(right, path, strict=True)][1:])
        )
    return said


EVENTS = {
    Finding.EMPTY.value: "no_hand",
    Finding.AS_BACKDROP.value: "no_hand",
    Finding.FULL.value: "flash",
    Finding.SEVERAL.value: "two_hands",
    Finding.CUT.value: "cut",
}
"""Events by finding on a silhouette; any other finding means that no hand fits."""


def flags(state: HandState) -> Mapping[str, SeriesValue]:
    """Return which of these is so in a frame."""
    happened = EVENTS.get(state.finding, "no_fit") if state.finding else "no_finger" if not state.protrusions else ""
    return {name: float(name == happened) for name in (*dict.fromkeys(EVENTS.values()), "no_fit", "no_finger")}


def describe(state: HandState) -> str:
    """Return the remark on a frame in words; nothing if a hand and a finger of it are visible."""
    return state.finding or ("" if state.protrusions else NO_FINGER)
