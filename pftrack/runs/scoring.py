"""Verdicts: what a whole run comes to, judged by the frames whose truth is known."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.parameters import Parameters, with_role
from pftrack.runs.diagnostics import Diagnostics
from pftrack.series import Series, columns, reduced

__all__ = ["Verdict", "allowed_loss", "estimates_hash", "judge", "reductions"]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What came of a run.

    Attributes:
        labelled_frames: Frames whose truth is known.
        mean_error: Over those, in the experiment's unit; None where there are none.
        success: Whether few enough of them were lost; None where there are none, or no notion of lost.
        lost_frames: How many of them were lost; None as for success.
        first_lost_frame: The first of them, or None.
    """

    labelled_frames: int
    mean_error: float | None
    success: bool | None
    lost_frames: int | None
    first_lost_frame: int | None


def judge(errors: NDArray[np.float64], lost: NDArray[np.bool_] | None, lost_share: float) -> Verdict:
    """Judge a run.

    Args:
        errors: (L,) distance of the estimate from the truth in every frame, NaN where the truth is unknown.
        lost: (L,) whether that counts as lost, False where the truth is unknown; None if there is no such notion.
        lost_share: Share of the frames with known truth that may be lost, 0..1.
    """
    known = errors[~np.isnan(errors)]
    mean_error = float(known.mean()) if len(known) else None
    if lost is None or not len(known):
        return Verdict(len(known), mean_error, None, None, None)
    count = int(np.count_nonzero(lost))
    first = int(np.argmax(lost)) if count else None
    return Verdict(len(known), mean_error, count <= lost_share * len(known), count, first)


def allowed_loss(parameters: Parameters) -> float:
    """Return the share of frames, 0..1, that may be lost in a success; none where no parameter has that role."""
    shares = with_role(type(parameters), "loss_share")
    return float(getattr(parameters, shares[0].name)) if shares else 0.0


def reductions(declared: Sequence[Series], rows: Sequence[Diagnostics]) -> Mapping[str, float | int | None]:
    """Return what is kept of series over a whole run, by the reductions' names.

    Args:
        declared: The series.
        rows: Of the frames after the first; one that lacks a series does not count for it.
    """
    kept: dict[str, float | int | None] = {}
    for series in declared:
        if series.reductions:
            values = [row.series[series.name] for row in rows if series.name in row.series]
            kept |= reduced(series, columns(series, values)[series.name])
    return kept


def estimates_hash(estimates: NDArray[np.float64]) -> str:
    """Return the SHA-256 of estimates (L, d) as little-endian float64: equal if and only if they are to the bit."""
    return hashlib.sha256(np.ascontiguousarray(estimates, dtype="<f8").tobytes()).hexdigest()
