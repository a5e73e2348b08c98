"""Fingers, arm and wrist of silhouettes."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, History
from pftrack.experiments.hand.fingers import HandFeatures, features_in, features_of, resample
from pftrack.experiments.hand.scene import HandSceneParameters, HandSource, HandTarget
from pftrack.experiments.hand.silhouette import Finding, Silhouette, SilhouetteParameters

SETTINGS = SilhouetteParameters()


def seen(index: int = 0, seed: int = 0, **values: object) -> tuple[HandFeatures, HandTarget]:
    parameters = revise(HandSceneParameters(), values)
    frame: Frame = HandSource(seed, parameters).frame(index, History(((0, parameters),)))
    assert frame.image_rgb is not None
    assert isinstance(frame.target, HandTarget)
    return features_of(frame.image_rgb, SETTINGS), frame.target


def of_mask(mask: NDArray[np.bool_]) -> HandFeatures:
    return features_in(Silhouette(mask, 1, Finding.CLEAR))


def test_the_fingers_of_an_open_hand_are_found_with_their_tips() -> None:
    """On twenty hands: five protrusions in most, tips within 1.5 px in the mean square, the wrist within 4 px."""
    tips, wrists, counts = [], [], []
    for seed in range(20):
        features, target = seen(0, seed, motion="bend")
        counts.append(len(features.protrusions))
        for axis, radii in features.protrusions:
            tips.append(np.hypot(*(axis[0] - target.tips).T).min())
            assert np.hypot(*np.diff(axis, axis=0).T) == pytest.approx(1.0, abs=0.35)
            assert axis.shape[0] == radii.shape[0] > 9
        if features.wrist is not None:
            wrists.append(features.wrist - target.pose[:2])
    assert sum(count == 5 for count in counts) >= 17
    assert np.sqrt(np.square(tips).mean()) < 1.6
    assert len(wrists) >= 18
    assert np.abs(np.mean(wrists, axis=0)).max() < 3.0
    assert np.std(wrists, axis=0).max() < 4.0


@pytest.mark.parametrize("turn", [-120, -60, 45, 90, 180])
def test_features_turn_with_the_hand(turn: float) -> None:
    """With the arm from the side or from above there are as many fingers, and the wrist is where it is."""
    features, target = seen(0, 4, motion="bend", turn_deg=turn)
    assert features.finding.ok
    assert len(features.protrusions) == 5
    assert features.wrist is not None
    assert np.hypot(*(features.wrist - target.pose[:2])) < 7.0
    for axis, _ in features.protrusions:
        assert np.hypot(*(axis[0] - target.tips).T).min() < 3.0


def test_folded_fingers_are_no_protrusions() -> None:
    """In the middle of the occlusion thumb, index and little finger are left."""
    features, target = seen(9, 3, motion="occlusion")
    assert len(features.protrusions) == 3
    nearest = {int(np.hypot(*(axis[0] - target.tips).T).argmin()) for axis, _ in features.protrusions}
    assert nearest == {0, 1, 4}


def test_an_arm_as_broad_as_the_hand_is_an_arm_still() -> None:
    """However broad, its skeleton crosses the border, and it is taken for no finger."""
    mask = np.zeros((200, 200), np.bool_)
    mask[60:, 50:140] = True
    mask[15:70, 80:100] = True
    features = of_mask(mask)
    assert len(features.protrusions) == 1
    assert features.wrist is None


def test_a_fist_on_its_arm_is_no_finger() -> None:
    """It is one line from end to end, which is the arm's; the wrist is where the disc begins."""
    mask = np.zeros((200, 200), np.bool_)
    rows, columns = np.indices(mask.shape)
    mask[np.hypot(rows - 90, columns - 100) < 32] = True
    mask[90:, 88:112] = True
    features = of_mask(mask)
    assert features.protrusions == ()
    assert features.wrist is not None
    assert features.wrist == pytest.approx([99.5, 119.5], abs=8)


def test_a_silhouette_that_cannot_be_a_hand_has_no_features() -> None:
    """Nothing is made of it, and nothing is not a number."""
    for finding in (Finding.EMPTY, Finding.FULL, Finding.SEVERAL, Finding.CUT):
        features = features_in(Silhouette(np.ones((40, 40), np.bool_), 1, finding))
        assert features.protrusions == ()
        assert features.wrist is None
        assert features.finding is finding


@pytest.mark.parametrize("kind", ["disc", "noise", "line", "all but a pixel", "ring"])
def test_other_things_are_looked_at_without_fault(kind: str) -> None:
    """Whatever is connected gives finite features."""
    mask = np.zeros((120, 120), np.bool_)
    rows, columns = np.indices(mask.shape)
    away = np.hypot(rows - 60, columns - 60)
    if kind == "disc":
        mask = away < 40
    elif kind == "noise":
        mask = np.random.default_rng(1).random(mask.shape) < 0.7
    elif kind == "line":
        mask[60, 10:] = True
    elif kind == "ring":
        mask = (away < 50) & (away > 30)
    else:
        mask[:] = True
        mask[5, 5] = False
    features = of_mask(mask)
    for axis, radii in features.protrusions:
        assert np.isfinite(axis).all()
        assert np.isfinite(radii).all()
    assert kind not in {"disc", "ring"} or not features.protrusions


def test_lines_are_resampled_by_arc_length() -> None:
    """Points of a bent line are a px apart along it; values go along."""
    line = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.5]])
    points, values = resample(line, np.array([0.0, 3.0, 5.5]))
    assert points.tolist() == [[0, 0], [1, 0], [2, 0], [3, 0], [3, 1], [3, 2]]
    assert values == pytest.approx(np.arange(6.0))
