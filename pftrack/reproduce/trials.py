"""Runs of the ball by the hundred, and what is counted of them."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from pftrack.experiments import find
from pftrack.parameters import Value
from pftrack.reproduce.pool import Pool
from pftrack.run import Change, Run

__all__ = ["Outcome", "Tally", "Trial", "run_all", "tally"]


@dataclass(frozen=True)
class Trial:
    """One run: tracker, seed, length and what differs from the defaults."""

    tracker: str
    seed: int
    frames: int
    parameters: dict[str, Value] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a run: success, mean error in px, frames lost, share of particles from the observation sampler."""

    success: bool
    mean_error_px: float
    lost_frames: int
    observation_share: float


@dataclass(frozen=True, slots=True)
class Tally:
    """Many runs together; the error is that of the successful ones, NaN if there are none."""

    runs: int
    success: float
    mean_error_px: float
    median_lost_frames: float
    observation_share: float


def carry_out(trial: Trial) -> Run:
    """Return a finished run of the simulated ball."""
    experiment = find("ball")
    run = Run(
        experiment,
        experiment.simulate(),
        tracker=trial.tracker,
        seed=trial.seed,
        frames=trial.frames,
        timeline=(Change(0, trial.parameters),),
    )
    run.finish()
    return run


def run_all(pool: Pool, trials: Iterable[Trial]) -> list[Outcome]:
    """Return the outcomes of all trials, in order."""
    return pool.map(_outcome, trials)


def tally(outcomes: Iterable[Outcome]) -> Tally:
    """Count outcomes together; there must be at least one."""
    rows = list(outcomes)
    errors = [row.mean_error_px for row in rows if row.success]
    return Tally(
        len(rows),
        float(np.mean([row.success for row in rows])),
        float(np.mean(errors)) if errors else float("nan"),
        float(np.median([row.lost_frames for row in rows])),
        float(np.mean([row.observation_share for row in rows])),
    )


def _outcome(trial: Trial) -> Outcome:
    run = carry_out(trial)
    summary = run.summary()
    shares = [
        row.observation_count / (row.prediction_count + row.observation_count)
        for row in run.diagnostics[1:]
        if row.prediction_count + row.observation_count
    ]
    return Outcome(
        bool(summary["success"]),
        float(summary["mean_error_px"]),
        int(summary["lost_frames"]),
        float(np.mean(shares)) if shares else 0.0,
    )
