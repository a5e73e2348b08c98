"""The simulated hand."""

from typing import Any

import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.experiments.hand.scene import FRAMES, HandSceneParameters, HandSource, folded_time, pose_at
from pftrack.experiments.hand.shape import HIGH, LOW, MODEL, joints, silhouette
from tests.experiments.hand.seen import simulated


def mask(seen: Any) -> np.ndarray:
    return np.asarray(seen.image_rgb[..., 0] > 120)


def test_the_motions_are_those_of_the_reference() -> None:
    """All begin with an open hand and keep their limits; turn, bend and folded fingers are as specified."""
    for motion, count in FRAMES.items():
        assert simulated(motion=motion).target.pose[:5] == pytest.approx([100.0, 137.0, 0.0, 0.0, 0.0])
        poses = np.array([pose_at(motion, time) for time in np.arange(0, count, 0.5)])
        assert ((poses >= LOW) & (poses <= HIGH)).all()
    last = pose_at("wrist", 29)
    assert last[2:5] == pytest.approx([0.10, 1.05, 0.0])
    assert last[10:13] == pytest.approx(0.22)
    assert pose_at("bend", 3) == pytest.approx(pose_at("bend", 0))
    bent = pose_at("bend", 29)
    assert bent[6:9] == pytest.approx(0.35)
    assert bent[[10, 15, 20, 22]] == pytest.approx(1.25)
    folds = [pose_at("occlusion", time)[14] for time in (4, 5, 6, 14, 16, 18)]
    assert folds == pytest.approx([0, 0.65, 1.3, 1.3, 0.65, 0])
    assert pose_at("occlusion", 10)[[10, 22]] == pytest.approx(0)
    assert pose_at("occlusion", 10)[3] == pytest.approx(0.25 * np.sin(2.5))


def test_speed_and_passes_give_the_number_of_frames() -> None:
    """At twice the speed a motion takes half the frames; a second pass returns to the beginning."""
    cases = (({"motion": "wrist"}, 30), ({"motion": "wrist", "speed": 2}, 16), ({"motion": "bend", "passes": 2}, 59))
    for values, count in cases:
        assert HandSource(0, revise(HandSceneParameters(), values)).frame_count == count
    assert simulated(58, motion="bend", passes=2).target.pose == pytest.approx(simulated().target.pose)
    assert folded_time("wrist", 31.0) == 27.0


def test_the_picture_shows_the_hand_of_the_seed() -> None:
    """Without edge noise it is the silhouette of a hand whose proportions differ by at most the allowed share."""
    seen = simulated(3, 5, edge_noise_px=0)
    target = seen.target
    assert (mask(seen) == silhouette(target.pose, target.scale, target.shape, (200, 200))).all()
    for name in ("phalanges", "radii"):
        shares = getattr(target.shape, name) / getattr(MODEL, name) - 1
        assert np.ptp(shares, axis=1) == pytest.approx(0, abs=1e-12)
        assert 0.001 < np.abs(shares).max() <= 0.04
    assert np.array_equal(target.model.phalanges, MODEL.phalanges)
    assert target.position == pytest.approx(joints(target.pose, 52.0, target.shape)[:, 3].ravel())


def test_a_left_hand_is_the_mirror_image() -> None:
    """Its thumb is on the left, also in the tracker's model."""
    right, left = (simulated(20, hand=hand, motion="wrist").target for hand in ("right", "left"))
    assert left.model.side == left.shape.side == -1.0
    assert 200 - left.tips[:, 0] == pytest.approx(right.tips[:, 0])
    assert left.tips[:, 1] == pytest.approx(right.tips[:, 1])


@pytest.mark.parametrize("turn", [-90, 0, 45, 180])
def test_a_turned_hand_turns_about_the_middle_of_the_picture(turn: float) -> None:
    """Its tips are those of the upright hand, turned counter-clockwise; all lengths grow with the picture's side."""
    upright, turned = (simulated(turn_deg=angle).target for angle in (0, turn))
    cosine, sine = np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))
    assert turned.tips - 100 == pytest.approx((upright.tips - 100) @ [[cosine, -sine], [sine, cosine]])
    large = simulated(turn_deg=turn, picture_side_px=600).target
    assert large.tips == pytest.approx(3 * turned.tips)
    assert large.scale == 156


def test_the_occluder_hides_the_hand() -> None:
    """A strip as wide as the picture hides it, and the truth records this; a narrow one does not."""
    hidden, shown = (simulated(occlusion_width_px=width) for width in (400, 20))
    assert (hidden.target.hidden, shown.target.hidden, mask(hidden).any()) == (True, False, False)
