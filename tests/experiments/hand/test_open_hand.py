"""The first pose: an open hand found by itself, or by five marked tips."""

import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.elementary import wrap
from pftrack.core.refusal import RefusedError
from pftrack.experiments.hand.fingers import HandFeatures, features_of
from pftrack.experiments.hand.first_pose import (
    FlatHand,
    OpenHand,
    disagreement,
    find_open_hand,
    fit_hand,
)
from pftrack.experiments.hand.recording import propose
from pftrack.experiments.hand.scene import HandSceneParameters, HandSource, HandTarget
from pftrack.experiments.hand.shape import MODEL, joints, open_pose, silhouette
from pftrack.experiments.hand.silhouette import Finding, SilhouetteParameters

SETTINGS = SilhouetteParameters()


def seen(index: int = 0, seed: int = 0, **values: object) -> tuple[HandFeatures, HandTarget]:
    parameters = revise(HandSceneParameters(), {"motion": "bend", **values})
    frame = HandSource(seed, parameters).frame(index, History(((0, parameters),)))
    assert frame.image_rgb is not None
    assert isinstance(frame.target, HandTarget)
    return features_of(frame.image_rgb, SETTINGS), frame.target


def errors(found: OpenHand, target: HandTarget) -> tuple[float, float, float, float]:
    """Of tips and wrist in palm axes, of size as a share, and of the turn in rad."""
    tips = joints(found.pose, found.scale, found.shape)[:, 3, :2]
    return (
        float(np.hypot(*(tips - target.tips).T).mean() / target.scale),
        float(np.hypot(*(found.pose[:2] - target.pose[:2])) / target.scale),
        abs(found.scale / target.scale - 1),
        abs(float(wrap(found.pose[2] - target.pose[2]))),
    )


CASES = [
    {"turn_deg": turn, "hand": hand, "palm_axis_px": size, "proportions": share}
    for turn, hand, size, share in [
        (0, "right", 52, 0.04),
        (35, "left", 60, 0.08),
        (90, "right", 46, 0.12),
        (-90, "left", 52, 0.04),
        (150, "right", 44, 0.08),
        (180, "left", 56, 0.04),
        (-140, "right", 48, 0.04),
        (-45, "left", 40, 0.08),
    ]
]


def test_open_hands_are_begun_by_themselves() -> None:
    """Of other people, sizes, sides and turns, with arms from all sides: tips within 5 %, sizes within 8 %."""
    found = []
    for number, values in enumerate(CASES):
        features, target = seen(0, 500 + number, **values)
        hand = find_open_hand(features)
        assert hand.shape.side == target.shape.side
        assert ("a left palm" in " ".join(hand.remarks)) == (target.shape.side < 0)
        assert ("from above" in " ".join(hand.remarks)) == (abs(values["turn_deg"]) > 120)  # type: ignore[operator, arg-type]
        assert hand.misfit < 0.15
        found.append(errors(hand, target))
    assert np.max(found, axis=0) == pytest.approx(0, abs=0.11)
    assert np.mean(found, axis=0)[0] < 0.035
    assert np.mean(found, axis=0)[1] < 0.06
    assert np.mean(found, axis=0)[2] < 0.04
    assert np.mean(found, axis=0)[3] < 0.035


def test_the_persons_fingers_are_measured() -> None:
    """Lengths within 8 % of this hand's, widths within 12 %."""
    features, target = seen(0, 3, proportions=0.1)
    hand = find_open_hand(features)
    lengths = hand.scale * hand.shape.phalanges.sum(axis=1) / (target.scale * target.shape.phalanges.sum(axis=1))
    widths = hand.scale * hand.shape.radii.mean(axis=1) / (target.scale * target.shape.radii.mean(axis=1))
    assert lengths == pytest.approx(1.0, abs=0.08)
    assert widths == pytest.approx(1.0, abs=0.12)
    assert hand.shape.arm[0] == pytest.approx(MODEL.arm[0], rel=0.12)


@pytest.mark.parametrize(
    ("index", "values", "reason"),
    [
        (29, {}, "seen"),
        (21, {}, "fingers are seen"),
        (27, {"motion": "wrist"}, "fingers are seen"),
        (8, {"motion": "occlusion"}, "3 fingers are seen"),
        (0, {"occlusion_width_px": 400}, Finding.EMPTY.value),
        (4, {"flash_every": 5}, Finding.FULL.value),
        (0, {"palm_axis_px": 20, "picture_side_px": 120}, "seen|small"),
    ],
)
def test_what_cannot_be_begun_is_said_in_words(index: int, values: dict[str, object], reason: str) -> None:
    """A fist, a hand from its side, folded fingers, nothing, a flash, and a hand of a few pixels."""
    features, _ = seen(index, 3, **values)
    with pytest.raises(RefusedError, match=reason):
        find_open_hand(features)


def test_a_hand_in_a_huge_picture_is_begun_in_its_pixels() -> None:
    """4,000 x 4,000 px: pose and size are those of the large picture."""
    mask = silhouette(open_pose((1000, 1370)), 520.0, MODEL, (2000, 2000))
    image = np.repeat(np.repeat(mask, 2, axis=0), 2, axis=1)[..., None].astype(np.uint8) * np.uint8(200)
    hand = find_open_hand(features_of(read_only(np.repeat(image, 3, axis=2)), SETTINGS))
    assert hand.scale == pytest.approx(1040, rel=0.03)
    assert hand.pose[:2] == pytest.approx([2000.5, 2740.5], abs=50)
    assert hand.misfit < 0.08


def test_marks_give_what_is_seen_its_names() -> None:
    """With all tips marked an open hand is the one that is found without."""
    features, target = seen(0, 6)
    alone, marked = find_open_hand(features), find_open_hand(features, target.tips)
    assert errors(marked, target)[0] < 0.05
    assert marked.scale == pytest.approx(alone.scale, rel=0.06)
    assert marked.shape.side == alone.shape.side == 1.0


def test_folded_fingers_may_be_marked() -> None:
    """With two fingers folded, marks begin what cannot be begun by itself."""
    features, target = seen(10, 3, motion="occlusion", hand="left")
    with pytest.raises(RefusedError):
        find_open_hand(features)
    hand = find_open_hand(features, target.tips)
    tips, wrist, size, turn = errors(hand, target)
    assert hand.shape.side == -1.0
    assert tips < 0.15
    assert wrist < 0.15
    assert size < 0.12
    assert turn < 0.12
    assert (hand.pose[[14, 18]] > 0.6).all()
    assert (hand.pose[[10, 22]] == 0).all()


def test_marks_beside_the_fingers_are_refused() -> None:
    """At least two belong to fingers that are seen."""
    features, target = seen(0, 6)
    with pytest.raises(RefusedError, match="marked tips"):
        find_open_hand(features, target.tips + np.array([60.0, 50.0]))


def test_a_fit_finds_a_hand_that_is_known() -> None:
    """From five per cent beside it, to within 2 %; the disagreement of a hand with itself is nothing."""
    known = FlatHand(open_pose((100.0, 137.0), 0.1), 52.0, MODEL)
    mask = silhouette(known.pose, known.scale, known.shape, (200, 200))
    assert disagreement(mask, np.ones_like(mask), known.pose, known.scale, known.shape) == 0
    beside = known._replace(pose=known.pose + np.array([2.0, -2.0, 0.05] + 22 * [0.0]), scale=54.0)
    hand, misfit, _ = fit_hand(mask, beside)
    assert misfit < 0.05
    assert hand.scale == pytest.approx(52.0, rel=0.025)
    assert hand.pose[2] == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize(("raised", "side"), [((1, 2), -1.0), ((0, 4), 1.0), ((1, 2, 3), 1.0), ((0, 1, 2), -1.0)])
def test_fewer_fingers_are_proposed_and_not_taken_for_sure(raised: tuple[int, ...], side: float) -> None:
    """With the others folded the fingers that people raise together are told; a person is asked all the same."""
    shape = MODEL.with_changes(side=side)
    pose = open_pose((100.0, 137.0), 0.2)
    for finger in set(range(5)) - set(raised):
        pose[6 + 4 * finger : 9 + 4 * finger] = 1.25 if finger else 0.7
    mask = silhouette(pose, 52.0, shape, (200, 200))
    features = features_of(np.repeat(mask[..., None], 3, axis=2).astype(np.uint8) * np.uint8(255), SETTINGS)
    found = propose(features)
    assert found.seen == tuple(finger in raised for finger in range(5))
    assert "drag the tips" in found.remarks[0]
    tips = joints(pose, 52.0, shape)[:, 3, :2]
    assert np.hypot(*(found.tips - tips).T)[list(raised)].max() < 4.0
    assert np.hypot(*(found.tips - tips).T).max() < 40.0


def test_an_open_hand_needs_no_proposal_and_a_fist_has_none() -> None:
    """All five are seen; of one finger or none there is nothing to propose, for the reason that there is no hand."""
    features, target = seen(0, 6)
    found = propose(features)
    assert found.seen == (True,) * 5
    assert np.hypot(*(found.tips - target.tips).T).max() < 5.0
    for values in ({"occlusion_width_px": 400}, {"flash_every": 1}):
        with pytest.raises(RefusedError):
            propose(seen(0, 6, **values)[0])
    with pytest.raises(RefusedError, match="finger is seen"):
        propose(seen(29, 3)[0])
