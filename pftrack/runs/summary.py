"""Summaries: what came of a run, for a table, a file and a batch."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from statistics import median
from typing import Any

import numpy as np

from pftrack.core.model.calibration import DIRECTIONS, Direction
from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.measures import HIT_RATE, evaluate
from pftrack.core.model.parameters import Value, flat
from pftrack.core.model.timeline import Change, Timeline
from pftrack.experiments.experiment import Experiment, Setup
from pftrack.runs.scoring import Verdict, allowed_loss, estimates_hash, evaluated_run, judge

__all__ = ["Summary", "summarise"]


@dataclass(frozen=True, slots=True)
class Summary:
    """What came of a run so far.

    Attributes:
        experiment: Its name.
        tracker: Name of the tracker at frame 0.
        seed: Of all randomness.
        frames: How many were computed.
        parameters: Those of frame 0, by name.
        changes: Of the parameters.
        unit: Of the mean error.
        verdict: By the frames whose truth is known.
        measures: Those that the experiment declares and the run has a truth for, by name.
        step_ms_median: Of a frame's time in the tracker, ms; None for a run of one frame.
        miscalibration: Why the bands of some of its frames are not to be believed, by the way in which they are not.
        estimates_sha256: Hash of all estimates: equal if and only if they are to the bit.
    """

    experiment: str
    tracker: str
    seed: int
    frames: int
    parameters: Mapping[str, Value]
    changes: tuple[Change, ...]
    unit: str
    verdict: Verdict
    measures: Mapping[str, float | int]
    step_ms_median: float | None
    miscalibration: Mapping[Direction, str]
    estimates_sha256: str

    @property
    def hit_rate(self) -> float | None:
        """Share of the frames with known truth that were not lost; None where there are none."""
        return self.measures.get(HIT_RATE.name)

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values by name."""
        verdict = {it.name: getattr(self.verdict, it.name) for it in fields(Verdict)}
        return {
            "experiment": self.experiment,
            "tracker": self.tracker,
            "seed": self.seed,
            "frames": self.frames,
            "parameters": dict(self.parameters),
            "changes": [{"frame": change.frame, "values": dict(change.values)} for change in self.changes],
            **verdict,
            "mean_error_px": self.verdict.mean_error if self.unit == "px" else None,
            "hit_rate": self.hit_rate,
            **self.measures,
            "step_ms_median": self.step_ms_median,
            **{direction: self.miscalibration.get(direction) for direction in DIRECTIONS},
            "estimates_sha256": self.estimates_sha256,
        }


def summarise(
    experiment: Experiment, setup: Setup, timeline: Timeline, seed: int, rows: Sequence[Diagnostics]
) -> Summary:
    """Return what came of a run.

    Args:
        experiment: Its wiring.
        setup: Its source.
        timeline: Its changes.
        seed: Of all randomness.
        rows: The numbers of the frames that it has computed.
    """
    course, last = evaluated_run(experiment, rows), len(rows) - 1
    decisive = experiment.measure_named(setup.success)
    return Summary(
        experiment=experiment.id,
        tracker=timeline.tracker_at(0),
        seed=seed,
        frames=len(rows),
        parameters=flat(timeline.parameters_at(0)),
        changes=timeline.changes,
        unit=experiment.unit,
        verdict=judge(course, decisive, allowed_loss(timeline.parameters_at(last))),
        measures=evaluate(experiment.measures_on(setup.footage), course),
        step_ms_median=median(row.step_ms for row in rows[1:]) if last else None,
        miscalibration=experiment.miscalibration(*timeline.in_force_until(last)),
        estimates_sha256=estimates_hash(np.array([row.estimate for row in rows])),
    )
