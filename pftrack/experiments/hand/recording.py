"""A recording of a hand: which hand it begins with, and how the hand is told from the rest.

Nothing has to be marked: an open hand is looked for, and followed from where it is first seen. Whoever marks the five
tips corrects that, or begins with a hand that is not open.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.finder import Finder, Sighting
from pftrack.core.model.marks import Mark
from pftrack.core.model.parameters import ParameterError, revise
from pftrack.core.model.recipe import Footage
from pftrack.core.model.sequence import FrameSequence
from pftrack.core.model.suitability import Suitability, grade
from pftrack.core.model.truth import Truth
from pftrack.experiments.experiment import Setup
from pftrack.experiments.hand.detection.open_hand import NoOpenHandError, OpenHand, find_open_hand
from pftrack.experiments.hand.detection.protrusions import HandFeatures, features_of
from pftrack.experiments.hand.detection.raised_fingers import propose
from pftrack.experiments.hand.detection.silhouette import suggest_parameters
from pftrack.experiments.hand.marks import TIPS, HandTips
from pftrack.experiments.hand.scene import HandTarget
from pftrack.experiments.hand.shape import FINGERS
from pftrack.experiments.hand.trackers.parameters import HandTrackerParameters
from pftrack.sources.recording import RecordedBackdrop, RecordingParameters, RecordingSource, check_start

__all__ = ["FINDER", "RecordedHandParameters", "on_video", "suits"]

CLOSELY_SEARCHED, THEN_EVERY, MOST_SEARCHED = 60, 5, 400
"""Pictures that are looked into one by one, then every so-many-th, and in all; each takes some ms."""

FAR_MARK, LOST_MARK = 0.25, 0.6
"""How far a tip may be from its mark, in palm axes, in a hand that fits well, and in one that fits at all."""

GROWTH_SD = 0.015
"""By which share a hand may grow from picture to picture, as it does when it comes nearer to a real camera."""


class RecordedHandParameters(RecordingParameters, HandTrackerParameters):
    """A recording with an overlay, and its trackers."""


def on_video(sequence: FrameSequence, mark: Mark | None, *, start: int = 0, truth: Truth | None = None) -> Setup:
    """Wire a recording of a hand.

    Args:
        sequence: The pictures.
        mark: The tips of the fingers in the picture `start`; None to have an open hand found.
        start: Number of the picture to start at, or to look for an open hand from.
        truth: That of hands is not known.

    Raises:
        ParameterError: The mark or the start is not within the recording, or the mark is of another kind.
        ValueError: There is no hand to begin with; the sentence says why.
    """
    check_start(start, sequence)
    if mark is None:
        start, mark = _first(sequence, start)
    if not isinstance(mark, HandTips):
        raise ParameterError("mark", mark.kind, "the tips of the fingers")
    mark.check(sequence.size)
    parameters = _parameters(sequence, start)
    hand = find_open_hand(_features(sequence, start, parameters), mark.tips)
    target = HandTarget.of(hand.pose, hand.scale, hand.shape, hand.shape, hidden=None)
    source = RecordingSource(sequence, (0.0, 0.0, 1.0, 1.0), start, None, start=target)
    return Setup(lambda _seed, _parameters: source, parameters, Footage.of(sequence, mark, start, truth))


def frames_to_search(first: int, last: int) -> Sequence[int]:
    """Return the numbers of the pictures to look for an open hand in, from the first to the last."""
    near = range(first, min(first + CLOSELY_SEARCHED, last + 1))
    every = max(THEN_EVERY, -(-(last + 1 - near.stop) // (MOST_SEARCHED - CLOSELY_SEARCHED)))
    return [*near, *range(near.stop, last + 1, every)]


def search(sequence: FrameSequence, frames: Sequence[int]) -> Iterator[Sighting]:
    """Look for an open hand into one picture after the other; of the first it is said why there is none.

    Of a single picture a hand that is not open is guessed as well, for a person to confirm.
    """
    for place, frame in enumerate(frames):
        features = _features(sequence, frame, _parameters(sequence, frame))
        try:
            found = find_open_hand(features)
        except NoOpenHandError as error:
            if len(frames) == 1:
                yield _guess(features, frame, str(error))
            else:
                yield Sighting(frame, remarks=(str(error),) if place == 0 else ())
        else:
            yield Sighting(frame, _tips(found), sure=True, remarks=found.remarks)


def _tips(found: OpenHand) -> HandTips:
    """Return the tips of an open hand that was found."""
    return HandTips.of(HandTarget.of(found.pose, found.scale, found.shape, found.shape).tips)


def _guess(features: HandFeatures, frame: int, reason: str) -> Sighting:
    """Return where the tips of a hand that is not open may be; if nothing can be guessed, why there is no open one."""
    try:
        found = propose(features)
    except NoOpenHandError:
        return Sighting(frame, remarks=(reason,))
    placed = tuple(f"points.{name}" for name, seen in zip(TIPS, found.seen, strict=True) if not seen)
    return Sighting(frame, HandTips.of(found.tips), placed=placed, remarks=found.remarks)


FINDER = Finder(frames_to_search, search, lambda _sequence, sighting: sighting, HandTips)


def suits(sequence: FrameSequence, footage: Footage, parameters: RecordedHandParameters) -> Suitability:
    """Return how well the hand that a recording begins with fits what is seen: its silhouette, and its marked tips.

    Two fingers of a hand cover about the same whichever they are taken for, but then some tip is far from its mark.
    """
    features, tips = _features(sequence, footage.start, parameters), HandTips.read(footage.mark).tips
    try:
        hand = find_open_hand(features, tips)
    except NoOpenHandError as error:
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
            other = _fit(find_open_hand(features, turned), turned)
        except NoOpenHandError:
            other = 0.0
        if other > value:
            better = HandTips.of(turned)
            # What else there is to say is of a hand that is the wrong way round.
            advice = ["the marks fit better the other way round, with the thumb at the other end"]
    if seen < len(TIPS):
        advice.append("begin with a picture in which all five fingers are spread, which tells how long they are")
    return Suitability(value, remark, tuple(advice), better)


def _fit(hand: OpenHand, tips: NDArray[np.float64]) -> float:
    """Return how well a hand fits, 0..1: the worse of its cover of the silhouette and its tips' distance from marks."""
    covered = grade(max(1.0 - hand.misfit, 0.0), 0.5, 0.8)
    return min(covered, grade(max(1.0 - float(_distances(hand, tips).max()), 0.0), 1.0 - LOST_MARK, 1.0 - FAR_MARK))


def _distances(hand: OpenHand, tips: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far the tips of a hand are from those that are marked (5, 2), px, in palms (5,)."""
    own = HandTarget.of(hand.pose, hand.scale, hand.shape, hand.shape).tips
    return np.asarray(np.hypot(*(own - tips).T) / hand.scale)


def _first(sequence: FrameSequence, start: int) -> tuple[int, Mark]:
    """Return the number of the first picture with an open hand from one on, and its tips.

    Nothing is guessed here, not even of a single picture: nobody is there to confirm it.

    Raises:
        ValueError: There is none; it says why the first picture has none.
    """
    reason = ""
    for frame in frames_to_search(start, sequence.frame_count - 1):
        try:
            return frame, _tips(find_open_hand(_features(sequence, frame, _parameters(sequence, frame))))
        except NoOpenHandError as error:
            reason = reason or str(error)
    raise ValueError(f"{reason}; or mark the tips of its fingers")


def _parameters(sequence: FrameSequence, frame: int) -> RecordedHandParameters:
    suggested = suggest_parameters(sequence.picture(frame), RecordedBackdrop(sequence), frame)
    return revise(RecordedHandParameters(), {"growth_sd": GROWTH_SD, **suggested})


def _features(sequence: FrameSequence, frame: int, parameters: RecordedHandParameters) -> HandFeatures:
    return features_of(sequence.picture(frame), parameters.silhouette, RecordedBackdrop(sequence))
