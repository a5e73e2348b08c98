"""Fingers, arm and wrist of silhouettes, and the open hand to begin with."""

from collections.abc import Container
from unittest.mock import ANY

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.elementary import wrap
from pftrack.core.refusal import RefusedError
from pftrack.experiments.hand.fingers import HandFeatures, features_in, features_of
from pftrack.experiments.hand.first_pose import OpenHand, find_open_hand
from pftrack.experiments.hand.recording import propose
from pftrack.experiments.hand.scene import HandTarget
from pftrack.experiments.hand.shape import MODEL, joints, open_pose, silhouette
from pftrack.experiments.hand.silhouette import Finding, Silhouette, SilhouetteParameters
from tests.experiments.hand.seen import simulated

DEFAULTS = SilhouetteParameters()


def seen(index: int = 0, seed: int = 0, **values: object) -> tuple[HandFeatures, HandTarget]:
    frame = simulated(index, seed, **{"motion": "bend", **values})
    return features_of(frame.image_rgb, DEFAULTS), frame.target


def test_the_fingers_of_an_open_hand_are_found_with_their_tips() -> None:
    """Most of twenty hands show five fingers, with tips to 1.6 px in the mean square and the wrist to 4 px."""
    tips, wrists, counts = [], [], []
    for seed in range(20):
        features, target = seen(0, seed)
        counts.append(len(features.protrusions))
        for axis, radii in features.protrusions:
            tips.append(np.hypot(*(axis[0] - target.tips).T).min())
            assert np.hypot(*np.diff(axis, axis=0).T) == pytest.approx(1.0, abs=0.35)
            assert axis.shape[0] == radii.shape[0] > 9
        wrists += [features.wrist - target.pose[:2]] if features.wrist is not None else []
    assert counts.count(5) >= 17
    assert np.sqrt(np.square(tips).mean()) < 1.6
    assert len(wrists) >= 18
    assert np.abs(np.mean(wrists, axis=0)).max() < 3.0
    assert np.std(wrists, axis=0).max() < 4.0


ROWS, COLUMNS = np.indices((200, 200))
AWAY = np.hypot(ROWS - 90, COLUMNS - 100)
NOISE = np.random.default_rng(1).random((200, 200))
FINGER = (ROWS >= 15) & (ROWS < 70) & (COLUMNS >= 80) & (COLUMNS < 100)


@pytest.mark.parametrize(
    ("mask", "fingers", "wrist"),
    [
        (FINGER | (ROWS >= 60) & (COLUMNS >= 50) & (COLUMNS < 140), [1], None),
        ((AWAY < 32) | (ROWS >= 90) & (COLUMNS >= 88) & (COLUMNS < 112), [0], pytest.approx([99.5, 119.5], abs=8)),
        ((AWAY < 50) & (AWAY > 30), [0], ANY),
        (NOISE < 0.7, range(1000), ANY),
        ((ROWS == 60) & (COLUMNS >= 10), range(1000), ANY),
        ((ROWS != 5) | (COLUMNS != 5), range(1000), ANY),
    ],
    ids=["broad arm", "fist on its arm", "ring", "noise", "line", "all but a pixel"],
)
def test_any_mask_has_finite_features(mask: NDArray[np.bool_], fingers: Container[int], wrist: object) -> None:
    """An arm is not a finger, and ends where the disc of a fist begins."""
    features = features_in(Silhouette(mask, 1, Finding.CLEAR))
    assert len(features.protrusions) in fingers
    assert wrist == features.wrist
    for axis, radii in features.protrusions:
        assert np.isfinite(np.column_stack([axis, radii])).all()


# The first pose: an open hand found automatically, or by five marked tips.


def errors(found: OpenHand, target: HandTarget) -> NDArray[np.float64]:
    """Return the errors of tips and wrist (palm axes), of the size (share) and of the turn (rad)."""
    tips = np.hypot(*(joints(found.pose, found.scale, found.shape)[:, 3, :2] - target.tips).T).mean()
    wrist, turn = np.hypot(*(found.pose[:2] - target.pose[:2])), wrap(found.pose[2] - target.pose[2])
    return np.abs([tips / target.scale, wrist / target.scale, found.scale / target.scale - 1, float(turn)])


CASES = {
    "turn_deg": (0, 35, 90, -90, 150, 180, -140, -45),
    "hand": ("right", "left") * 4,
    "palm_axis_px": (52, 60, 46, 52, 44, 56, 48, 40),
    "proportions": (0.04, 0.08, 0.12, 0.04, 0.08, 0.04, 0.04, 0.08),
}


def test_open_hands_are_found_automatically() -> None:
    """Hands of several people, sizes, sides and turns are found to 11 % each and to 6 % on average."""
    found = []
    for number, (turn, *values) in enumerate(zip(*CASES.values(), strict=True)):
        features, target = seen(0, 500 + number, **dict(zip(CASES, (turn, *values), strict=True)))
        hand = find_open_hand(features)
        assert hand.shape.side == target.shape.side
        assert ("a left palm" in " ".join(hand.remarks)) == (target.shape.side < 0)
        assert ("from above" in " ".join(hand.remarks)) == (abs(turn) > 120)
        assert hand.misfit < 0.15
        found.append(errors(hand, target))
    assert np.max(found) < 0.11
    assert (np.mean(found, axis=0) < [0.035, 0.06, 0.04, 0.035]).all()


def test_the_persons_fingers_are_measured() -> None:
    """Lengths are within 8 % of this hand's, widths within 12 %."""
    features, target = seen(0, 3, proportions=0.1)
    hand = find_open_hand(features)
    for name, within in (("phalanges", 0.08), ("radii", 0.12)):
        measured, true = (one.scale * getattr(one.shape, name).sum(axis=1) for one in (hand, target))
        assert measured / true == pytest.approx(1.0, abs=within)
    assert hand.shape.arm[0] == pytest.approx(MODEL.arm[0], rel=0.12)


@pytest.mark.parametrize(
    ("index", "values", "reason"),
    [
        (29, {}, "seen"),
        (21, {}, "fingers are seen"),
        (27, {"motion": "wrist"}, "fingers are seen"),
        (8, {"motion": "occlusion"}, "3 fingers are seen"),
        (0, {"palm_axis_px": 20, "picture_side_px": 120}, "seen|small"),
    ],
)
def test_an_unusable_hand_is_refused_in_words(index: int, values: dict[str, object], reason: str) -> None:
    """A fist, a bent hand, a hand from its side, folded fingers and a hand of a few pixels are refused by name."""
    features, _ = seen(index, 3, **values)
    with pytest.raises(RefusedError, match=reason):
        find_open_hand(features)


def test_a_hand_in_a_large_picture_is_measured_in_its_pixels() -> None:
    """In 1,000 x 1,000 px pose and size are those of the large picture, not of the reduced one."""
    mask = silhouette(open_pose((500, 685)), 260.0, MODEL, (1000, 1000))
    hand = find_open_hand(features_of(read_only(np.uint8(200) * np.stack([mask] * 3, axis=2)), DEFAULTS))
    assert hand.scale == pytest.approx(260, rel=0.03)
    assert hand.pose[:2] == pytest.approx([500, 685], abs=12)
    assert hand.misfit < 0.08


def test_marked_tips_name_the_fingers() -> None:
    """With all tips marked an open hand is the same as without; marks away from all fingers are refused."""
    features, target = seen(0, 6)
    alone, marked = find_open_hand(features), find_open_hand(features, target.tips)
    assert errors(marked, target)[0] < 0.05
    assert marked.scale == pytest.approx(alone.scale, rel=0.06)
    assert marked.shape.side == alone.shape.side == 1.0
    with pytest.raises(RefusedError, match="marked tips"):
        find_open_hand(features, target.tips + np.array([60.0, 50.0]))


def test_folded_fingers_may_be_marked() -> None:
    """With two fingers folded, marks start a hand that is not found automatically."""
    features, target = seen(10, 3, motion="occlusion", hand="left")
    with pytest.raises(RefusedError):
        find_open_hand(features)
    hand = find_open_hand(features, target.tips)
    assert hand.shape.side == -1.0
    assert (errors(hand, target) < [0.15, 0.15, 0.12, 0.12]).all()
    assert (hand.pose[[14, 18]] > 0.6).all()
    assert (hand.pose[[10, 22]] == 0).all()


@pytest.mark.parametrize(("raised", "side"), [((1, 2), -1.0), ((0, 4), 1.0), ((0, 1, 2), -1.0)])
def test_raised_fingers_are_proposed_for_confirmation(raised: tuple[int, ...], side: float) -> None:
    """With the other fingers folded, the raised ones are recognised, and a person is asked to drag the tips."""
    shape = MODEL.with_changes(side=side)
    pose = open_pose((100.0, 137.0), 0.2)
    for finger in set(range(5)) - set(raised):
        pose[6 + 4 * finger : 9 + 4 * finger] = 1.25 if finger else 0.7
    mask = silhouette(pose, 52.0, shape, (200, 200))
    features = features_of(np.repeat(mask[..., None], 3, axis=2).astype(np.uint8) * np.uint8(255), DEFAULTS)
    found = propose(features)
    assert found.seen == tuple(finger in raised for finger in range(5))
    assert "drag the tips" in found.remarks[0]
    tips = joints(pose, 52.0, shape)[:, 3, :2]
    assert np.hypot(*(found.tips - tips).T)[list(raised)].max() < 4.0
    assert np.hypot(*(found.tips - tips).T).max() < 40.0


def test_all_tips_of_an_open_hand_are_proposed_and_none_of_a_fist() -> None:
    """An open hand shows all five fingers; a fist is refused."""
    features, target = seen(0, 6)
    found = propose(features)
    assert found.seen == (True,) * 5
    assert np.hypot(*(found.tips - target.tips).T).max() < 5.0
    with pytest.raises(RefusedError, match="finger is seen"):
        propose(seen(29, 3)[0])
