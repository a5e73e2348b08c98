"""Batches: many runs of one condition at once, for what came of them rather than to be watched.

A batch gives the same numbers as live runs, to the bit: any run of it can be opened and stepped through.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pftrack.experiments.experiment import Experiment, Setup
from pftrack.parameters import Value
from pftrack.run import Change, Run

__all__ = ["Outcome", "outcomes"]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of one run.

    Attributes:
        success: Whether few enough frames were lost; None where the experiment has no notion of lost.
        mean_error: Over the frames whose truth is known, in the experiment's unit; None where there are none.
        lost_frames: How many frames were lost; None where the experiment has no notion of lost.
        first_lost_frame: The first of them, or None.
        labelled_frames: Frames whose truth is known.
        observation_share: Mean share of the particles that came from the observation sampler.
        switches: How often the sampler or the process noise changed.
        step_ms: Mean time of a step, ms; the one figure that differs from run to run.
        estimates_sha256: Hash of all estimates, as of a live run.
    """

    success: bool | None
    mean_error: float | None
    lost_frames: int | None
    first_lost_frame: int | None
    labelled_frames: int
    observation_share: float
    switches: int
    step_ms: float
    estimates_sha256: str


def outcomes(
    experiment: Experiment,
    setup: Setup,
    *,
    values: Mapping[str, Value],
    trackers: Sequence[str],
    seeds: Sequence[int],
    frames: int,
) -> list[list[Outcome]]:
    """Carry out all runs of one condition.

    Args:
        experiment: The wiring.
        setup: The source.
        values: Of the parameters that differ from the setup's.
        trackers: Names of the trackers.
        seeds: One a trial; every tracker meets the same.
        frames: Length of a run.

    Returns:
        The outcomes by seed, and for each seed by tracker.

    Raises:
        ParameterError: A value is unknown, out of bounds or at odds with another.
    """
    return [[_live(experiment, setup, values, tracker, seed, frames) for tracker in trackers] for seed in seeds]


def _live(
    experiment: Experiment, setup: Setup, values: Mapping[str, Value], tracker: str, seed: int, frames: int
) -> Outcome:
    timeline = (Change(0, values),)
    run = Run(experiment, setup, tracker=tracker, seed=seed, frames=frames, timeline=timeline)
    run.finish()
    summary = run.summary()
    rows = run.diagnostics[1:]
    shares = [
        row.observation_count / (row.prediction_count + row.observation_count)
        for row in rows
        if row.prediction_count + row.observation_count
    ]
    return Outcome(
        summary["success"],
        summary["mean_error"],
        summary["lost_frames"],
        summary["first_lost_frame"],
        summary["labelled_frames"],
        float(np.mean(shares)) if shares else 0.0,
        sum(row.switched for row in rows),
        float(np.mean([row.step_ms for row in rows])) if rows else 0.0,
        summary["estimates_sha256"],
    )
