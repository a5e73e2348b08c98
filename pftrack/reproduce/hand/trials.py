"""Runs of the simulated hand: what came of a motion with a seed under a condition."""

from typing import NamedTuple

import numpy as np

from pftrack.core.model.parameters import Value
from pftrack.experiments import find
from pftrack.runs.run import Change, Run

__all__ = ["Case", "Condition", "Outcome", "follow", "mean"]


class Condition(NamedTuple):
    """A tracker with the values of parameters that differ from the defaults."""

    tracker: str
    values: tuple[tuple[str, Value], ...] = ()


class Case(NamedTuple):
    """A motion, a seed and a condition."""

    motion: str
    seed: int
    condition: Condition


class Outcome(NamedTuple):
    """What came of a run, as means over its frames but the first.

    Attributes:
        tips: Mean distance of the tips of the best hand, palm axes.
        palm: Largest error of its palm's angles, rad.
        flexion: Mean error of its flexions, rad.
        best: Share of the frames whose best hand is right.
        any: Share of those in which any hand that is kept is.
        backtracked: Share of those in which the hand from which the last best one comes is.
        frame_ms: Time that a frame took, the median.
    """

    tips: float
    palm: float
    flexion: float
    best: float
    any: float
    backtracked: float
    frame_ms: float


def follow(case: Case) -> Outcome:
    """Follow the hand of a case to the end of its motion."""
    hand = find("hand")
    values = {"motion": case.motion, **dict(case.condition.values)}
    run = Run(hand, hand.simulate(), tracker=case.condition.tracker, seed=case.seed, timeline=(Change(0, values),))
    run.finish()
    rows = run.diagnostics[1:]
    said = hand.report(run.diagnostics) if hand.report else {}

    def average(name: str) -> float:
        return float(np.mean([row.number(name) for row in rows]))

    return Outcome(
        average("tip_error"),
        average("palm_error_rad"),
        average("flexion_error_rad"),
        average("best_right"),
        average("any_right"),
        float(said.get("backtracked_right_share", np.nan)),
        float(np.median([row.step_ms for row in rows])),
    )


def mean(outcomes: list[Outcome]) -> Outcome:
    """Return the means over several runs."""
    return Outcome(*np.mean(outcomes, axis=0).tolist())
