"""A finding: one figure of ours beside its reference."""

import math
from dataclasses import asdict, dataclass
from typing import Literal

__all__ = ["Finding", "claim", "compare", "share"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One result.

    Attributes:
        result: Name of the study and the quantity.
        ours: What we measured.
        reference: What it should be, or None for an ordering.
        tolerance: How far ours may be from the reference; None for an ordering.
        status: Whether it holds; `known-negative` for a claim of the document that the specification could not confirm.
        source: Where the reference comes from.
    """

    result: str
    ours: float
    reference: float | None
    tolerance: float | None
    status: Literal["pass", "fail", "known-negative"]
    source: str

    def as_dict(self) -> dict[str, object]:
        """Return the values by name, ready for JSON."""
        return {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in asdict(self).items()
        }


def compare(result: str, ours: float, reference: float, tolerance: float, source: str) -> Finding:
    """Judge a figure by its distance from the reference; NaN fails."""
    status: Literal["pass", "fail"] = "pass" if abs(ours - reference) <= tolerance else "fail"
    return Finding(result, ours, reference, tolerance, status, source)


def share(result: str, successes: int, runs: int, reference: float, reference_runs: int, source: str) -> Finding:
    """Judge a success rate by the reference's: within three standard errors of the difference, and 0.03.

    The allowance is the specification's for a cell of a map (6.5); it grows as either side has fewer runs.
    """
    spread = math.sqrt(reference * (1 - reference) * (1 / runs + 1 / reference_runs))
    return compare(result, successes / runs, reference, 3 * spread + 0.03, source)


def claim(result: str, ours: float, *, holds: bool, source: str, confirmed: bool = True) -> Finding:
    """Judge a statement: an ordering, or a count that has to be reached.

    Args:
        result: The statement.
        ours: The figure that it is judged by.
        holds: Whether it holds for us.
        source: Where it is made.
        confirmed: Whether the specification could confirm it; if not, it is a known negative unless it holds.
    """
    negative: Literal["fail", "known-negative"] = "fail" if confirmed else "known-negative"
    return Finding(result, ours, None, None, "pass" if holds else negative, source)
