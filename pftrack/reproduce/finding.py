"""A finding: one figure of ours beside its reference."""

import math
from dataclasses import asdict, dataclass
from typing import Literal, TypeAlias

__all__ = ["Finding", "claim", "compare", "share"]

Status: TypeAlias = Literal["pass", "fail", "known-negative"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One result.

    Attributes:
        result: Name of the study and the quantity.
        ours: What we measured.
        reference: What it should be, or None for an ordering.
        tolerance: How far ours may be from the reference; None for an ordering.
        status: Whether it holds; `known-negative` for a published claim that the reference could not confirm,
            and for a figure of which it is known why it comes out otherwise.
        source: Where the reference comes from.
    """

    result: str
    ours: float
    reference: float | None
    tolerance: float | None
    status: Status
    source: str

    def as_dict(self) -> dict[str, object]:
        """Return the values by name, ready for JSON."""
        return {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in asdict(self).items()
        }


def compare(
    result: str, ours: float, reference: float, tolerance: float, source: str, *, confirmed: bool = True
) -> Finding:
    """Judge a figure by its distance from the reference; NaN fails.

    Args:
        result: What it is.
        ours: What we measured.
        reference: What it should be.
        tolerance: How far ours may be from that.
        source: Where the reference comes from.
        confirmed: Whether it should hold; if it is known why not, it is a known negative unless it does.
    """
    holds = abs(ours - reference) <= tolerance
    return Finding(result, ours, reference, tolerance, _status(holds=holds, confirmed=confirmed), source)


def share(
    result: str,
    successes: int,
    runs: int,
    reference: float,
    reference_runs: int,
    source: str,
    *,
    confirmed: bool = True,
) -> Finding:
    """Judge a success rate by the reference's: within three standard errors of the difference, and 0.03.

    The allowance is that of a cell of a map; it grows as either side has fewer runs.
    """
    spread = math.sqrt(reference * (1 - reference) * (1 / runs + 1 / reference_runs))
    return compare(result, successes / runs, reference, 3 * spread + 0.03, source, confirmed=confirmed)


def claim(result: str, ours: float, *, holds: bool, source: str, confirmed: bool = True) -> Finding:
    """Judge a statement: an ordering, or a count that has to be reached.

    Args:
        result: The statement.
        ours: The figure that it is judged by.
        holds: Whether it holds for us.
        source: Where it is made.
        confirmed: Whether the reference could confirm it; if not, it is a known negative unless it holds.
    """
    return Finding(result, ours, None, None, _status(holds=holds, confirmed=confirmed), source)


def _status(*, holds: bool, confirmed: bool) -> Status:
    return "pass" if holds else "fail" if confirmed else "known-negative"
