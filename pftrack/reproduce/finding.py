"""Findings and records: figures of ours beside their references, what the comparison says, and the file of all."""

import json
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.files import write_whole

Verdict: TypeAlias = Literal["reproduced", "better", "differs", "our own figure", "not run"]
VERDICTS: tuple[Verdict, ...] = ("reproduced", "better", "differs", "our own figure", "not run")


class Own(str):
    """A source that is no reference: a figure of this project, which guards against its own mistakes."""

    __slots__ = ()


class Unexplained(str):
    """A reason why a difference was expected that does not tell its cause."""

    __slots__ = ()


PROTOCOL = "stated with the reference"
CHOSEN = "chosen by this project: the reference states none"
SHARE = "three standard errors of the runs of both sides, and 0.03"
TRIALS = "three standard errors of the trials of both sides"
FEWER = "the reference's, wider by as much as fewer trials scatter more"
OWN = "this project: far below what the statement is about"
"""Grounds of a tolerance."""


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
        source: Where the reference comes from.
        known: Whether a difference was expected. One that was not is a mistake somewhere.
        explained: Whether it differs and the cause is known.
        reason: Why it is better, why it was expected to differ, or why it was not run.
        ground: Why the tolerance is what it is.
        timed: Whether it is a time, which no second run repeats.
    """

    result: str
    ours: float
    reference: float | None
    tolerance: float | None
    verdict: Verdict
    source: str
    known: bool = False
    reason: str = ""
    ground: str = ""
    timed: bool = False
    explained: bool = False

    @property
    def fails(self) -> bool:
        """Whether it differs and nobody expected that."""
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
    ground: str,
    known: str = "",
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
        ground: Why the tolerance is what it is.
        known: Why it may differ; without a reason it must not.
        better: Which side is the good one, if a figure that is outside of the tolerance there is better.
        reason: Why it is.

    Raises:
        ValueError: It may be better and there is no reason.
    """
    if better is not None and not reason:
        raise ValueError(f"{result} may be better than its reference, for which a reason must be stated")
    ours, tolerance = float(ours), float(tolerance)
    if abs(ours - reference) <= tolerance:
        verdict = _held(source)
    elif (better == "higher" and ours > reference) or (better == "lower" and ours < reference):
        verdict = "better"
    else:
        verdict = "differs"
    said = reason if verdict == "better" else known if verdict == "differs" else ""
    explained = verdict == "differs" and _explains(known)
    return Finding(
        result, ours, reference, tolerance, verdict, source, bool(known), str(said), ground, explained=explained
    )


def share(
    result: str,
    successes: int,
    runs: int,
    reference: float,
    reference_runs: int,
    source: str,
    *,
    known: str = "",
) -> Finding:
    """Judge a success rate by the reference's: within three standard errors of the difference, and 0.03.

    The allowance is that of a cell of a map; it grows as either side has fewer runs.
    """
    spread = math.sqrt(reference * (1 - reference) * (1 / runs + 1 / reference_runs))
    return compare(result, successes / runs, reference, 3 * spread + 0.03, source, known=known, ground=SHARE)


def three_errors(values: Sequence[float] | Floats, reference_trials: int) -> float:
    """Return three standard errors of the difference of two means of trials, ours and as many of the reference.

    The trials of the reference are taken to scatter as ours do.

    Args:
        values: Of our trials.
        reference_trials: How many the reference has.
    """
    return 3.0 * float(np.std(values, ddof=1)) * math.sqrt(1 / len(values) + 1 / reference_trials)


def claim(result: str, ours: float, *, holds: bool, source: str, known: str = "", timed: bool = False) -> Finding:
    """Judge a statement: an ordering, or a count that has to be reached.

    Args:
        result: The statement.
        ours: The figure that it is judged by.
        holds: Whether it holds for us.
        source: Where it is made.
        known: Why it may not hold; without a reason it must.
        timed: Whether it is a time, which no second run repeats.
    """
    verdict: Verdict = _held(source) if holds else "differs"
    said = "" if holds else str(known)
    explained = not holds and _explains(known)
    return Finding(
        result, float(ours), None, None, verdict, source, bool(known), said, timed=timed, explained=explained
    )


def not_run(result: str, reason: str = "") -> Finding:
    """Return what is said of a result that was not asked for, or not computed in this form for a reason."""
    return Finding(result, math.nan, None, None, "not run", "", reason=reason)


def describe_verdicts(findings: Iterable[Finding]) -> str:
    """Return how many findings there are of each verdict, in words, and of how many differences the cause is known."""
    found = list(findings)
    counts = Counter(one.verdict for one in found)
    words = ", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICTS if counts[verdict])
    explained, failed = sum(one.explained for one in found), sum(one.fails for one in found)
    other = counts["differs"] - explained - failed
    return f"{words}; differences: {explained} with a known cause, {other} without, {failed} not expected"


def _explains(known: str) -> bool:
    return bool(known) and not isinstance(known, Unexplained)


def _held(source: str) -> Verdict:
    return "our own figure" if isinstance(source, Own) else "reproduced"


# A record keeps findings as they come, so that a second call goes on with what is left. The file is JSON: by the name
# of a result the form in which it was computed, the revision of pftrack, the hash of the sources that it depends
# on, how many pieces of work it was, what they took, and the findings. A result whose sources have changed is computed
# again. docs/explanation/reproduction.md is written from it.

Form: TypeAlias = Literal["full", "quick"]


@dataclass(frozen=True, slots=True)
class Entry:
    """A result that was computed.

    Attributes:
        form: All trials of the protocol, or few.
        revision: Of pftrack.
        pieces: How many pieces of work it was; of most studies they are trials, of those of the ball 120 runs each.
        seconds: Processor time of these.
        findings: What came of it.
        sources: SHA-256 of the sources that it depends on (`hash_sources`); empty if that was not kept.
    """

    form: Form
    revision: str
    pieces: int
    seconds: float
    findings: tuple[Finding, ...]
    sources: str = ""


class Record:
    """The results in a file; one that is kept is on disk before the next one begins."""

    def __init__(self, path: Path, revision: str) -> None:
        """Begin a record, or go on with the one in the file.

        Args:
            path: The file; it need not be there.
            revision: What the results are of that are kept from now on.

        Raises:
            ValueError: The file holds something else.
            OSError: It cannot be read.
        """
        self.path, self.revision = path, revision
        self._entries = dict(read_record(path)) if path.exists() else {}

    def has(self, name: str, form: Form, sources: str) -> bool:
        """Return whether a result of these sources is there in this form, or for a quick one the full one of any."""
        entry = self._entries.get(name)
        return entry is not None and (
            (entry.form, entry.sources) == (form, sources) or (entry.form, form) == ("full", "quick")
        )

    def findings(self, name: str) -> list[Finding]:
        """Return the findings of a result that is there."""
        return list(self._entries[name].findings)

    def keep(
        self, name: str, form: Form, findings: Sequence[Finding], *, sources: str, pieces: int, seconds: float
    ) -> None:
        """Write a result into the file."""
        self._entries[name] = Entry(form, self.revision, pieces, round(seconds, 2), tuple(findings), sources)
        text = json.dumps({"results": _plain(self._entries)}, indent=1, ensure_ascii=False, allow_nan=False)
        write_whole(self.path, f"{text}\n".encode())


def read_record(path: Path) -> dict[str, Entry]:
    """Return the results in a file by name.

    Raises:
        ValueError: The file holds something else.
        OSError: It cannot be read.
    """
    try:
        kept: Mapping[str, Mapping[str, Any]] = json.loads(path.read_text(encoding="utf-8"))["results"]
        return {
            name: Entry(**{**entry, "findings": tuple(_finding(one) for one in entry["findings"])})
            for name, entry in kept.items()
        }
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ValueError(f"{path} is no record of reproduced results ({type(error).__name__})") from None


def _plain(entries: Mapping[str, Entry]) -> dict[str, object]:
    return {
        name: {
            "form": entry.form,
            "revision": entry.revision,
            "sources": entry.sources,
            "pieces": entry.pieces,
            "seconds": entry.seconds,
            "findings": [one.as_dict() for one in entry.findings],
        }
        for name, entry in sorted(entries.items())
    }


def _finding(values: Mapping[str, Any]) -> Finding:
    return Finding(**{**values, "ours": float("nan") if values["ours"] is None else values["ours"]})
