"""The experiment on a hand: correct hands, backtracking, and drawings."""

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
    """A hand can miss each of the three limits alone; a full turn gives the same palm."""
    found = errors(POSE, moved((0, 11.0)), moved((3, -0.31)), moved((3, 0.29)), moved((2, 2.0 * np.pi)))
    assert found.right.tolist() == [True, False, False, True, True]
    assert found.tips[1] == pytest.approx(11.0 / SCALE)
    assert found.palm[2] == pytest.approx(0.31)
    bent = errors(moved(*((place, 0.9) for place in (10, 11, 12, 14, 15))))
    assert bent.flexion[0] == pytest.approx(0.3)
    assert not bent.right[0]


def test_a_hand_turned_the_wrong_way_is_lost() -> None:
    """It looks the same in the picture, and in space its tips are far off."""
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


def test_backtracking_corrects_the_past() -> None:
    """The best hand of the last frame descends from the second of the frame before, which was right."""
    rows = [row(0, (1.0,), (1.0,), (-1,)), row(1, (0.0, 1.0), (0.6, 0.4), (0, 0))]
    said, again = (report([*rows, row(2, (1.0, 0.0), weights, (1, 0))]) for weights in ((0.7, 0.3), (0.3, 0.7)))
    assert (said["backtracked_right_share"], again["backtracked_right_share"]) == (1.0, 0.0)
    assert said["frames_per_second"] == pytest.approx(50.0)
    assert "backtracked_right_share" not in report(rows[:1])


def beam_of(*poses: np.ndarray) -> Any:
    """Return a step of the simulated hand with these hypotheses, the first with half of the weight."""
    step = Run(HAND, HAND.simulate(), seed=0, frames=2).current
    weights = np.array([0.5, 0.3, 0.2][: len(poses)])
    beam = Beam(poses, np.log(weights / weights.sum()), np.zeros(len(poses), np.int64))
    return replace(step, state=replace(step.state, beam=beam))


def drawn(step: Any, shown: int) -> dict[str, Any]:
    """Return the drawing in the picture, and that in space by names that begin with "space"."""
    chosen = replace(step, parameters=revise(step.parameters, {"shown_hypothesis": shown}))
    drawing = HAND.draw(chosen, [chosen.diagnostics])
    return {**drawing.primitives, **{f"space {name}": one for name, one in drawing.worlds[0].primitives.items()}}


def test_the_chosen_hand_is_drawn_whole_and_the_others_as_ghosts() -> None:
    """This holds in the picture and in space; a number beyond the last hand shows the last one."""
    step = beam_of(POSE, moved((3, 0.5)), moved((10, 1.2)))
    first, last, beyond = (drawn(step, shown) for shown in (1, 3, 16))
    alone = [drawn(beam_of(step.state.beam.members[place]), 1) for place in (0, 2)]
    for found, wanted in zip((first, last, beyond), (*alone, alone[1]), strict=True):
        assert np.array_equal(found["outline"].segments, wanted["outline"].segments)
        assert np.array_equal(found["space fingers"].vertices, wanted["space fingers"].vertices)
    assert np.unique(first["ghosts"].opacity) == pytest.approx([0.3 + 0.7 * 0.2, 0.3 + 0.7 * 0.3])
    assert np.unique(last["ghosts"].opacity) == pytest.approx([0.3 + 0.7 * 0.3, 0.3 + 0.7 * 0.5])
    assert not len(alone[0]["ghosts"].vertices)
