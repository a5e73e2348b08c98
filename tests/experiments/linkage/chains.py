"""Chains on the paths of the simulated scene, measured without a picture."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.parameters import Value
from pftrack.core.model.source import Frame, Measurements
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.linkage.scene import LENGTH, LinkageSceneParameters, LinkageSource, LinkageTarget, PathName
from pftrack.experiments.linkage.state import LinkageState, LinkageTrackerParameters
from pftrack.experiments.linkage.trackers import TRACKERS, contains

Array = NDArray[np.float64]

SPACE: dict[str, Value] = {"motion_bound_rad": 0.035, "error_bound_px": 0.5, "start_angle_bound_rad": 0.08}
RUNS: dict[str, tuple[PathName, tuple[int, int, int], dict[str, Value]]] = {
    "static": ("static", (70, 60, 50), {}),
    "mirror3": ("mirror3", (70, 60, 50), {}),
    "mirror2": ("mirror2", (70, 60, 50), {"motion_bound_rad": 0.1}),
    "two-1": ("two", (65, 55, 45), {"motion_bound_rad": 0.08}),
    "two-2": ("two", (75, 65, 55), {"motion_bound_rad": 0.08}),
    "3d": ("3d", (68, 58, 48), {**SPACE, "start_length_bound_px": 15}),
}
"""Path, lengths and parameters that differ from the defaults."""

CAREFUL = {
    "start_angle_variance_rad2": 1e-4,
    "start_rate_variance_rad2": 1e-6,
    "start_length_variance_px2": 1.0,
    "observation_variance_px2": 1.0,
    "length_difference_12_px": 100,
    "length_difference_23_px": 100,
}
"""Parameters by which a chain is almost linear."""


def told(target: LinkageTarget) -> Array:
    """Its (theta, r) or (omega, t, theta, r), rad and px."""
    parts = [part for part in (target.omega, target.t, target.theta, target.r) if part is not None]
    return np.concatenate(parts)


def frame_of(target: LinkageTarget, index: int, noise: Array) -> Frame:
    """A frame in which its points are measured with some errors (3 or 4, 2)."""
    points = target.landmarks.points_px[-len(noise) :] + noise
    return Frame(index, index / 15, measurements=Measurements(points, np.ones_like(points)), target=target)


def frames(
    name: str, seed: int, count: int | None = None, spread: float = 1.0
) -> Iterator[tuple[LinkageTarget, Frame]]:
    """Truth and frames of a run; errors are normal, drawn again beyond three deviations."""
    path, (one, two, three), parameters = RUNS[name]
    scene = LinkageSceneParameters(chain_path=path, true_length_1_px=one, true_length_2_px=two, true_length_3_px=three)
    source = LinkageSource(seed, scene)
    deviation = spread * float(parameters.get("error_bound_px", 3)) / 3
    for index in range(min(count or LENGTH[path], LENGTH[path])):
        rng = np.random.default_rng((seed, index))
        noise = rng.normal(size=(4 if path == "3d" else 3, 2))
        while (abs(noise) > 3).any():
            noise = np.where(abs(noise) > 3, rng.normal(size=noise.shape), noise)
        target = source.target(index)
        yield target, frame_of(target, index, deviation * noise)


@cache
def tracked(
    name: str, seed: int, tracker: str = "ellipsoids", count: int | None = None, **changes: Value
) -> tuple[list[LinkageState], list[bool]]:
    """The states of a run, and whether each holds the truth."""
    parameters = LinkageTrackerParameters(**{**RUNS[name][2], **changes})
    return follow(tracker, frames(name, seed, count), parameters)


def follow(
    tracker: str,
    shown: Iterable[tuple[LinkageTarget, Frame]],
    parameters: LinkageTrackerParameters = LinkageTrackerParameters(),  # noqa: B008 - frozen
) -> tuple[list[LinkageState], list[bool]]:
    """The states from that of the start on, and whether each holds the truth."""
    chosen, states, held = TRACKERS[tracker], [], []
    for target, frame in shown:
        rng = Stream(0, frame.index, Purpose.TRACK)
        state = (
            chosen.step(states[-1], frame, parameters, rng) if states else chosen.start(target, frame, parameters, rng)
        )
        assert isinstance(state, LinkageState)
        chosen.measure(state)
        states.append(state)
        held.append(contains(state, told(target)))
    return states, held


def outliers(states: Sequence[LinkageState]) -> list[bool]:
    return [state.events.outlier for state in states]


def blind(frame: Frame, gone: slice) -> Frame:
    """The frame without some of its points."""
    points = frame.measurements.points_px.copy()
    points[gone] = np.nan
    return replace(frame, measurements=Measurements(points, frame.measurements.sd_px))


def lengths_of(state: LinkageState) -> Array:
    """(3, 2) intervals of the lengths."""
    return np.stack([state.low[-3:], state.high[-3:]], axis=1)
