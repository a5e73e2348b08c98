"""Runs of the experiment of a chain, and how they stand beside the truth."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.recipe import Change
from pftrack.core.model.source import Frame, Measurements
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.linkage.scene import LinkageTarget
from pftrack.experiments.linkage.state import LinkageState
from pftrack.runs.run import Run

BOUND_SDS = 3.0
"""Noise beyond it is drawn again, as in the simulated scene."""


class Condition(NamedTuple):
    """A run: tracker, values that differ from the defaults, and seed."""

    tracker: str
    values: tuple[tuple[str, Value], ...]
    seed: int


class RunResult(NamedTuple):
    """What a run comes to.

    Attributes:
        errors: (T,) greatest error of a direction, rad.
        lengths: (T, 3) estimates, px.
        deviations: (T, 3) of the same.
        low: (T, 3) of what lengths are believed possible, px.
        high: (T, 3) of the same.
        true_lengths: (3,) px.
        hypotheses: (T,) how many there are.
        refuted: (T,) how many were refuted.
        splits: (T,) how many were added by a split.
        contained: (T,) whether regions hold the truth, 1 or 0; NaN of another belief.
    """

    errors: Floats
    lengths: Floats
    deviations: Floats
    low: Floats
    high: Floats
    true_lengths: Floats
    hypotheses: Ints
    refuted: Ints
    splits: Ints
    contained: Floats


def run_condition(condition: Condition) -> RunResult:
    """Run the experiment."""
    experiment = find("linkage")
    timeline = (Change(0, dict(condition.values)),)
    run = Run(experiment, experiment.simulate(), tracker=condition.tracker, seed=condition.seed, timeline=timeline)
    steps = list(run)
    targets = [step.frame.target for step in steps if isinstance(step.frame.target, LinkageTarget)]
    return _result([step.state for step in steps], targets)


def run_swing(condition: Condition, theta: Floats, r: Floats, start: Floats) -> RunResult:
    """Run a tracker on a motion that the scene has not.

    Args:
        condition: Tracker, values and seed.
        theta: (T, 3) joint angles, rad.
        r: (3,) lengths, px.
        start: (6,) pose and lengths at which the estimate begins, rad and px.
    """
    experiment = find("linkage")
    parameters = revise(experiment.simulate().parameters, dict(condition.values))
    tracker = experiment.trackers[condition.tracker]
    targets = [LinkageTarget(np.zeros(6), theta=angles, r=r) for angles in theta]
    beginning = LinkageTarget(np.zeros(6), theta=start[:3], r=start[3:])
    states: list[Any] = []
    for index, target in enumerate(targets):
        seen = np.cumsum(r * np.cos(np.cumsum(target.theta))) + _noise(condition.seed, index)
        measured = Measurements(np.column_stack([seen, np.zeros(3)]), np.ones((3, 2)))
        frame = Frame(index, float(index), measurements=measured, target=target)
        rng = Stream(condition.seed, index, Purpose.TRACK)
        state = tracker.step(states[-1], frame, parameters, rng) if states else None
        states.append(state or tracker.start(beginning, frame, parameters, rng))
    return _result(states, targets)


def _result(states: Sequence[LinkageState], targets: Sequence[LinkageTarget]) -> RunResult:
    errors = find("linkage").error
    believed = np.array([state.estimate for state in states])
    true = np.array([_position(target) for target in targets])
    return RunResult(
        np.deg2rad(errors(believed, true)),
        np.array([state.mean[-3:] for state in states]),
        np.array([state.spread[-3:] for state in states]),
        np.array([state.low[-3:] for state in states]),
        np.array([state.high[-3:] for state in states]),
        targets[0].r,
        np.array([len(state.belief) for state in states]),
        np.array([state.events.refuted for state in states]),
        np.array([state.events.splits for state in states]),
        np.array([_contains_truth(state, target) for state, target in zip(states, targets, strict=True)]),
    )


def _contains_truth(state: LinkageState, target: LinkageTarget) -> float:
    measure = find("linkage").measure
    held = measure(Frame(0, 0.0, target=target), state).get("contained") if measure else None
    return held if isinstance(held, float) else np.nan


def _position(target: LinkageTarget) -> Floats:
    """Return what trackers estimate, as the experiment tells it: angles in degrees."""
    if target.omega is None or target.t is None:
        return np.concatenate([np.rad2deg(target.theta), target.r])
    return np.concatenate([np.rad2deg(target.omega), target.t, np.rad2deg(target.theta), target.r])


def _noise(seed: int, index: int) -> Floats:
    stream = Stream(seed, index, Purpose.SCENE)
    numbers = np.asarray(stream.standard_normal(3))
    while (np.abs(numbers) > BOUND_SDS).any():
        numbers = np.where(np.abs(numbers) > BOUND_SDS, stream.standard_normal(3), numbers)
    return numbers
