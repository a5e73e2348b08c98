"""Summaries: what came of a run, for a table, a file and a batch."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from pftrack.model.calibration import DIRECTIONS, Direction
from pftrack.model.measures import HIT_RATE
from pftrack.model.parameters import Value
from pftrack.model.timeline import Change
from pftrack.runs.scoring import Verdict

__all__ = ["Summary"]


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
