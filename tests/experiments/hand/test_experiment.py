"""The experiment on a hand: when a kept hand is right, what backtracking makes of it, and what is drawn."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.core.model.series import Hypotheses
from pftrack.core.model.source import Target
from pftrack.core.model.tracker import Diagnostics
from pftrack.experiments import find
from pftrack.experiments.hand.experiment import capsules, plate, ribbon
from pftrack.experiments.hand.recording import Errors, is_mirrored, report
from pftrack.experiments.hand.scene import HandTarget
from pftrack.experiments.hand.shape import MODEL, joints, open_pose
from pftrack.filters.beam import Beam
from pftrack.runs.run import Run

HAND = find("hand")
POSE, SCALE = open_pose((100.0, 137.0)), 52.0
TARGET = HandTarget.of(POSE, SCALE, MODEL, MODEL)


def moved(*changes: tuple[int, float]) -> np.ndarray:
    """The true pose with some numbers changed."""
    pose = POSE.copy()
    for place, change in changes:
        pose[place] += change
    return pose


def errors(*poses: np.ndarray) -> Errors:
    tips = np.array([joints(pose, SCALE, MODEL)[:, 3].ravel() for pose in poses])
    return Errors.of(np.array(poses), tips, TARGET)


def test_a_hand_is_right_if_tips_palm_and_flexions_are() -> None:
    """Each of the three limits is one that a hand can miss by itself; a whole turn more is the same palm."""
    found = errors(POSE, moved((0, 11.0)), moved((3, -0.31)), moved((3, 0.29)), moved((2, 2.0 * np.pi)))
    assert found.right.tolist() == [True, False, False, True, True]
    assert found.tips[1] == pytest.approx(11.0 / SCALE)
    assert found.palm[2] == pytest.approx(0.31)
    bent = errors(moved(*((place, 0.9) for place in (10, 11, 12, 14, 15))))
    assert bent.flexion[0] == pytest.approx(0.3)
    assert not bent.right[0]


def test_a_hand_that_is_turned_the_wrong_way_is_lost() -> None:
    """In the picture it hardly shows; in space the tips are far off."""
    tilted, mirrored = (HandTarget.of(moved((3, angle)), SCALE, MODEL, MODEL) for angle in (1.0, -1.0))
    assert np.abs(tilted.tips - mirrored.tips).mean() < 0.02 * SCALE
    unknown, nowhere = np.full(15, np.nan), Target(np.zeros(2), 1.0)
    cases = ((tilted.position, tilted), (mirrored.position, tilted), (unknown, tilted), (mirrored.position, nowhere))
    lost = [bool(HAND.judge.missed(SimpleNamespace(estimate=tips), target)) for tips, target in cases]
    assert lost == [False, True, True, False]
    assert is_mirrored(mirrored.position, tilted.position, SCALE)
    assert not is_mirrored(tilted.position, tilted.position, SCALE)
    assert not is_mirrored(TARGET.position + 5.0, TARGET.position, SCALE)


def row(frame: int, right: tuple[float, ...], weights: tuple[float, ...], parents: tuple[int, ...]) -> Diagnostics:
    hands = Hypotheses(tuple((0.0,) for _ in right), weights, parents)
    series = {"hands": hands, "hands_right": right, "best_right": right[0]}
    unknown = (0.0, None, None, None, 0.0, False, False, None, 20.0)
    return Diagnostics(frame, 0.1 * frame, (0.0,), (0.0,), *unknown, series)


def test_backtracking_corrects_what_was_best_at_the_time() -> None:
    """The best of the last frame comes from the second of the frame before, which was right when the best was not."""
    rows = [row(0, (1.0,), (1.0,), (-1,)), row(1, (0.0, 1.0), (0.6, 0.4), (0, 0))]
    said, again = (report([*rows, row(2, (1.0, 0.0), weights, (1, 0))]) for weights in ((0.7, 0.3), (0.3, 0.7)))
    assert (said["backtracked_right_share"], again["backtracked_right_share"]) == (1.0, 0.0)
    assert said["frames_per_second"] == pytest.approx(50.0)
    assert "backtracked_right_share" not in report(rows[:1])


def beam_of(*poses: np.ndarray) -> Any:
    """A step of the simulated hand whose tracker believes in these poses, the first with a half of the weight."""
    step = Run(HAND, HAND.simulate(), seed=0, frames=2).current
    weights = np.array([0.5, 0.3, 0.2][: len(poses)])
    beam = Beam(poses, np.log(weights / weights.sum()), np.zeros(len(poses), np.int64))
    return replace(step, state=replace(step.state, beam=beam))


def drawn(step: Any, shown: int) -> dict[str, Any]:
    """What is drawn in the picture, and in space by names that begin with "space"."""
    chosen = replace(step, parameters=revise(step.parameters, {"shown_hypothesis": shown}))
    drawing = HAND.draw(chosen, [chosen.diagnostics])
    return {**drawing.primitives, **{f"space {name}": one for name, one in drawing.worlds[0].primitives.items()}}


def test_the_hand_that_is_chosen_is_drawn_whole_and_the_others_as_ghosts() -> None:
    """In the picture and in space; what is chosen beyond those that there are is the last of them."""
    step = beam_of(POSE, moved((3, 0.5)), moved((10, 1.2)))
    first, second, last, beyond = (drawn(step, shown) for shown in (1, 2, 3, 16))
    alone = {place: drawn(beam_of(pose), 1) for place, pose in enumerate(step.state.beam.members)}
    for place, found in enumerate((first, second, last)):
        assert np.array_equal(found["outline"].segments, alone[place]["outline"].segments)
        assert np.array_equal(found["space fingers"].vertices, alone[place]["space fingers"].vertices)
    assert np.array_equal(beyond["outline"].segments, last["outline"].segments)
    assert np.unique(first["ghosts"].opacity) == pytest.approx([0.3 + 0.7 * 0.2, 0.3 + 0.7 * 0.3])
    assert np.unique(last["ghosts"].opacity) == pytest.approx([0.3 + 0.7 * 0.3, 0.3 + 0.7 * 0.5])
    assert not len(alone[0]["ghosts"].vertices)


def test_the_hand_in_space_stands_upright_and_is_seen_from_the_front_as_in_the_picture() -> None:
    """Turned in the picture, it is the same in space; its tips are where the picture has them, in palm axes."""
    upright, turned = (drawn(beam_of(moved((2, angle))), 1)["space joints"].positions for angle in (0.0, 1.1))
    assert turned == pytest.approx(upright, abs=1e-5)
    tips = (TARGET.tips - POSE[:2]) / SCALE
    assert upright.reshape(5, 4, 3)[:, 3, :2] == pytest.approx(tips * (1.0, -1.0), abs=1e-5)


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """The volume within a closed mesh whose faces are clockwise as seen from outside."""
    a, b, c = (vertices[faces[:, corner]].astype(np.float64) for corner in range(3))
    return float(np.einsum("ij,ij->i", np.cross(c, b), a).sum() / 6.0)


def test_solids_are_closed_and_as_large_as_they_should_be() -> None:
    """A capsule is a cylinder between two halves of a ball, a plate has its outline's area times its thickness."""
    ball, cylinder = 4.0 / 3.0 * np.pi, 3.0 * np.pi
    for way in np.eye(3):
        capsule = capsules(np.zeros((1, 3)), 3.0 * way[None], np.ones((1, 2)))
        assert volume(*capsule) == pytest.approx(ball + cylinder, rel=0.12)
    square = np.array([[0.0, 0.0, 0.5], [0.0, 2.0, 0.5], [2.0, 2.0, 0.5], [2.0, 0.0, 0.5]])
    assert volume(*plate(square, square - (0.0, 0.0, 1.0))) == pytest.approx(4.0)
    strip, _ = ribbon(np.array([[[0.0, 0.0, 1.0], [10.0, 0.0, 1.0]]]), 2.0)
    assert strip[:, :2].tolist() == [[-1.0, -1.0], [11.0, -1.0], [11.0, 1.0], [-1.0, 1.0]]
