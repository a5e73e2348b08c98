"""Diagnostics: what is written down of every frame, small enough to keep for all of them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.frame import Frame
from pftrack.trackers import TrackState

__all__ = ["Diagnostics", "Series", "diagnose"]

Proposal: TypeAlias = Literal["prediction", "observation", "mixed", "none"]
Series: TypeAlias = float | tuple[float, ...]
"""One number a frame, or several of a kind; NaN where there is none."""


@dataclass(frozen=True, slots=True)
class Diagnostics:
    """One frame of a run in numbers.

    Attributes:
        frame: Index within the run.
        time_s: Time since frame 0, s.
        estimate: Posterior mean, in the experiment's unit (px of the picture, or degrees).
        sigma: Posterior standard deviations, same unit.
        effective_sample_size: 1 / sum w^2; 0 for a filter without particles.
        log_evidence: log p(z_t | z_{1:t-1}) up to a constant of the likelihood; -inf if every weight was zero.
        prediction_count: Particles from the prediction sampler.
        observation_count: Particles from the observation sampler.
        proposal: Where the particles came from.
        resampled: Whether parents were drawn anew.
        switched: Whether the sampler or process noise changed since the frame before.
        unique_ancestors: How many different parents the particles have.
        searching: Whether the tracker itself has lost the target and looks for it.
        truth: The true position; None where it is unknown.
        observation: What was seen of a signal; None for pictures.
        reference: Mean of the exact posterior, where it is known beside an approximate one.
        error: Distance of the estimate from the truth; None where the truth is unknown.
        lost: Whether that counts as lost; None where the truth is unknown.
        hidden: Whether the target is known to be out of sight.
        step_ms: Time that the tracker took for the frame, ms.
        series: What else the experiment measures, by name; every frame of a run has the same names.
    """

    frame: int
    time_s: float
    estimate: tuple[float, ...]
    sigma: tuple[float, ...]
    effective_sample_size: float
    log_evidence: float
    prediction_count: int
    observation_count: int
    proposal: Proposal
    resampled: bool
    switched: bool
    unique_ancestors: int
    searching: bool
    truth: tuple[float, ...] | None
    observation: tuple[float, ...] | None
    reference: tuple[float, ...] | None
    error: float | None
    lost: bool | None
    hidden: bool | None
    step_ms: float
    series: Mapping[str, Series] = field(default_factory=dict)

    @property
    def gone(self) -> bool:
        """Whether the target is lost, by the truth or by the tracker's own account."""
        return self.searching or self.lost is True

    def as_dict(self) -> dict[str, object]:
        """Return the values by name, ready for JSON: a number that is not finite becomes None."""
        return {it.name: _finite(getattr(self, it.name)) for it in fields(self)}


def diagnose(
    frame: Frame,
    state: TrackState,
    verdict: tuple[float | None, bool | None],
    step_ms: float,
    *,
    scale: float = 1.0,
    series: Mapping[str, Series] | None = None,
) -> Diagnostics:
    """Write down a frame.

    Args:
        frame: What was seen.
        state: What is believed.
        verdict: Error, and whether that is lost; None where unknown.
        step_ms: Time that the tracker took, ms.
        scale: What turns estimates and positions into the experiment's unit.
        series: What else was measured.
    """
    target = frame.target
    error, lost = verdict
    return Diagnostics(
        frame=frame.index,
        time_s=frame.time_s,
        estimate=_scaled(state.estimate, scale),
        sigma=_scaled(state.sigma, scale),
        effective_sample_size=state.effective_sample_size,
        log_evidence=state.log_evidence,
        prediction_count=state.prediction_count,
        observation_count=state.observation_count,
        proposal=_proposal(state.prediction_count, state.observation_count),
        resampled=state.resampled,
        switched=state.switched,
        unique_ancestors=state.unique_ancestors,
        searching=state.searching,
        truth=_scaled(target.position, scale) if target else None,
        observation=tuple(frame.signal.tolist()) if frame.signal is not None else None,
        reference=None if state.reference_mean is None else _scaled(state.reference_mean, scale),
        error=error,
        lost=lost,
        hidden=target.hidden if target else None,
        step_ms=step_ms,
        series=series or {},
    )


def _scaled(values: NDArray[np.float64], scale: float) -> tuple[float, ...]:
    return tuple((scale * values).tolist())


def _proposal(predicted: int, observed: int) -> Proposal:
    if predicted + observed == 0:
        return "none"
    if observed == 0:
        return "prediction"
    return "mixed" if predicted else "observation"


def _finite(value: object) -> object:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Mapping):
        return {name: _finite(item) for name, item in value.items()}
    if isinstance(value, tuple):
        return [_finite(item) for item in value]
    return value
