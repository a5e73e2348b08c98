"""Diagnostics and steps: what is written down of every frame, and one frame of a run as all that shows it gets it.

Diagnostics are small enough to keep for all frames.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Protocol

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import Drawing
from pftrack.core.model.measures import judge_loss
from pftrack.core.model.series import Hypotheses, SeriesValue, to_json
from pftrack.core.model.source import Frame
from pftrack.core.model.tracker import TrackState


@dataclass(frozen=True, slots=True)
class Diagnostics:
    """One frame of a run in numbers.

    Attributes:
        frame: Index within the run.
        time_s: Time since frame 0, s.
        estimate: Posterior mean, in the experiment's unit (px of the picture, or degrees).
        sigma: Posterior standard deviations, same unit.
        log_evidence: log p(z_t | z_{1:t-1}) up to a constant of the likelihood; -inf if every weight was zero.
        truth: The true position; None where it is unknown.
        extent: Width and height of the true box, px; None where it is unknown, or there is none.
        observation: What was seen of a signal; None for pictures.
        error: Distance of the estimate from the truth, inf for an estimate that is not finite; None where the truth is
            unknown.
        lost: Whether that counts as lost; None where the truth is unknown.
        hidden: Whether the target is known to be out of sight.
        searching: Whether the tracker has lost the target by its own account; None for one that always follows.
        step_ms: Time that the tracker took for the frame, ms.
        series: What tracker and experiment have measured beside it, by name: that which they declare and have.
    """

    frame: int
    time_s: float
    estimate: tuple[float, ...]
    sigma: tuple[float, ...]
    log_evidence: float
    truth: tuple[float, ...] | None
    extent: tuple[float, float] | None
    observation: tuple[float, ...] | None
    error: float | None
    lost: bool | None
    hidden: bool | None
    searching: bool | None
    step_ms: float
    series: Mapping[str, SeriesValue] = field(default_factory=dict)

    @property
    def is_lost(self) -> bool:
        """Whether the target is lost: by the truth, or by the tracker's own account where the truth is unknown."""
        return judge_loss(self.lost, self.searching).lost is True

    def number(self, name: str) -> float:
        """Return the value of a series of numbers; NaN where the frame has none."""
        value = self.series.get(name, math.nan)
        return float(value) if isinstance(value, int | float) else math.nan

    def vector(self, name: str) -> tuple[float, ...] | None:
        """Return the value of a series of vectors or intervals; None where the frame has none."""
        value = self.series.get(name)
        return value if isinstance(value, tuple) else None

    def hypotheses(self, name: str) -> Hypotheses | None:
        """Return the value of a series of hypotheses; None where the frame has none."""
        value = self.series.get(name)
        return value if isinstance(value, Hypotheses) else None

    def as_dict(self) -> dict[str, object]:
        """Return the values by name, ready for JSON: a number that is not finite becomes None."""
        row: dict[str, object] = {}
        for it in fields(self):
            value = getattr(self, it.name)
            row[it.name] = to_json(value) if isinstance(value, float | tuple) else value
        return row | {"series": {name: to_json(value) for name, value in self.series.items()}}


def diagnose(
    frame: Frame,
    state: TrackState,
    verdict: tuple[float | None, bool | None],
    step_ms: float,
    *,
    scale: float = 1.0,
    searching: bool | None = None,
    series: Mapping[str, SeriesValue] | None = None,
) -> Diagnostics:
    """Write down a frame.

    Args:
        frame: What was seen.
        state: What is believed.
        verdict: Error, and whether that is lost; None where unknown.
        step_ms: Time that the tracker took, ms.
        scale: What turns estimates and positions into the experiment's unit.
        searching: Whether the tracker looks for a target that it has lost; None if it never does.
        series: What tracker and experiment have measured.
    """
    target = frame.target
    error, lost = verdict
    hidden = target.hidden if target else None
    return Diagnostics(
        frame=frame.index,
        time_s=frame.time_s,
        estimate=_scale(state.estimate, scale),
        sigma=_scale(state.sigma, scale),
        log_evidence=state.log_evidence,
        truth=_scale(target.position, scale) if target else None,
        extent=target.extent if target else None,
        observation=tuple(frame.signal.tolist()) if frame.signal is not None else None,
        error=error,
        lost=lost,
        hidden=None if hidden is None else bool(hidden),  # NumPy's own kind, which comparisons give, JSON does not know
        searching=searching,
        step_ms=step_ms,
        series=series or {},
    )


def _scale(values: Floats, scale: float) -> tuple[float, ...]:
    return tuple((scale * values).tolist())


@dataclass(frozen=True, slots=True)
class Step:
    """One frame of a run: what was seen, what is believed, and the numbers of both.

    Attributes:
        frame: What the source showed.
        state: The tracker's posterior, of the kind that the experiment's trackers have.
        diagnostics: The numbers.
        parameters: In force in this frame.
        tracker: Name of the tracker that took the step.
        tracker_title: Its title, as the experiment of the run has it.
    """

    frame: Frame
    state: Any
    diagnostics: Diagnostics
    parameters: Any
    tracker: str
    tracker_title: str


class Draw(Protocol):
    """Draw a frame."""

    def __call__(self, step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
        """Return what is to be seen.

        Args:
            step: The frame.
            past: The run's diagnostics up to this frame, or further.
            other: The diagnostics of the same frame in a second run, if there is one to compare with.
        """
