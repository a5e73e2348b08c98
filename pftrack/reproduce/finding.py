"""A finding: one figure of ours beside its reference, and what comes of the comparison."""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Literal, TypeAlias

__all__ = ["Finding", "Own", "Verdict", "claim", "compare", "describe_verdicts", "not_run", "share"]

Verdict: TypeAlias = Literal["reproduced", "better", "differs", "our own figure", "not run"]
VERDICTS: tuple[Verdict, ...] = ("reproduced", "better", "differs", "our own figure", "not run")


class Own(str):
    """A source that is no reference: a figure of this project, which guards against its own mistakes."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Finding:
    """One result.

    Attributes:
        result: Name of the study and the quantity.
        ours: What we measured.
        reference: What it should be, or None for an ordering.
        tolerance: How far ours may be from the reference; None for an ordering.
        verdict: What comes of it. "reproduced" is within the tolerance, or holds; "better" is outside of it on the good
            side, for a stated reason, since a criterion may have become easier; "differs" is neither; "our own figure"
            has no reference and is as it was.
        source: Where the reference comes from; of a known difference also what is known of it.
        known: Whether a difference was expected: the reference could not confirm the claim either, or it is known why
            it comes out otherwise. A difference that is not known is a mistake somewhere.
        reason: Why it is better.
    """

    result: str
    ours: float
    reference: float | None
    tolerance: float | None
    verdict: Verdict
    source: str
    known: bool = True
    reason: str = ""

    @property
    def fails(self) -> bool:
        """Whether it differs and nobody knows why."""
        return self.verdict == "differs" and not self.known

    def as_dict(self) -> dict[str, object]:
        """Return the values by name, ready for JSON."""
        return {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in asdict(self).items()
        }


def compare(
    result: str,
    ours: float,
    reference: float,
    tolerance: float,
    source: str,
    *,
    confirmed: bool = True,
    better: Literal["higher", "lower"] | None = None,
    reason: str = "",
) -> Finding:
    """Judge a figure by its distance from the reference; NaN differs.

    Args:
        result: What it is.
        ours: What we measured.
        reference: What it should be.
        tolerance: How far ours may be from that.
        source: Where the reference comes from.
        confirmed: Whether it should hold; if not, it is known why.
        better: Which side is the good one, if a figure that is outside of the tolerance there is better.
        reason: Why it is.

    Raises:
        ValueError: It may be better and there is no reason.
    """
    if better is not None and not reason:
        raise ValueError(f"{result} may be better than its reference, for which a reason must be stated")
    if abs(ours - reference) <= tolerance:
        verdict = _held(source)
    elif (better == "higher" and ours > reference) or (better == "lower" and ours < reference):
        verdict = "better"
    else:
        verdict = "differs"
    said = reason if verdict == "better" else ""
    return Finding(result, ours, reference, tolerance, verdict, source, known=not confirmed, reason=said)


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
        confirmed: Whether the reference could confirm it; if not, it is known that it may not hold.
    """
    return Finding(result, ours, None, None, _held(source) if holds else "differs", source, known=not confirmed)


def not_run(result: str) -> Finding:
    """Return what is said of a result that was not asked for."""
    return Finding(result, math.nan, None, None, "not run", "")


def describe_verdicts(findings: Iterable[Finding]) -> str:
    """Return how many findings there are of each verdict, in words, and how many of the differences are not known."""
    found = list(findings)
    counts = Counter(one.verdict for one in found)
    words = ", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICTS if counts[verdict])
    failed = sum(one.fails for one in found)
    return f"{words}; of the differences {failed} {'is' if failed == 1 else 'are'} not known"


def _held(source: str) -> Verdict:
    return "our own figure" if isinstance(source, Own) else "reproduced"
