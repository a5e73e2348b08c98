"""Reports: what came of the changes that were tried, and how sure one may be of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, TypeAlias

import numpy as np

from pftrack.analysis.counterfactuals.alternatives import Alternative
from pftrack.core.model.series import to_json
from pftrack.core.numerics.statistics import holm, mcnemar, wilson

__all__ = ["CAVEAT", "LEVEL", "Comparison", "Finding", "Report", "Verdict", "join", "read_record", "record"]

Verdict: TypeAlias = Literal["baseline", "better", "worse", "unclear"]
"""What may be said of a change: "unclear" where chance alone would do as much."""

LEAST_P = 0.001
"""Smaller p-values are told as below this."""

WORDS: Mapping[Verdict, str] = {
    "baseline": "",
    "better": "better than no change",
    "worse": "worse than no change",
    "unclear": "not clearly better than no change",
}
"""What verdicts are called."""

LEVEL = 0.05
"""Corrected p-values below this are called better or worse than no change."""

CAVEAT = "A cure of this run is not a cure in general: a sweep over seeds and scenes says that."


@dataclass(frozen=True, slots=True)
class Finding:
    """What came of one change.

    Attributes:
        alternative: The change.
        held: Whether the run held its target, by seed; of all seeds tried so far.
        steps: Steps that were taken.
        seconds: That they took.
        place: Number of the change in the order in which they are tried; 0 is none.
    """

    alternative: Alternative
    held: Mapping[int, bool]
    steps: int = 0
    seconds: float = 0.0
    place: int = 0

    @property
    def runs(self) -> int:
        """How many seeds were tried."""
        return len(self.held)

    @property
    def is_unknown(self) -> bool:
        """Whether it was tried, and nobody said whether the run held: then no other seed says more."""
        return self.steps > 0 and not self.held

    @property
    def holding(self) -> int:
        """How many runs held."""
        return sum(self.held.values())

    @property
    def share(self) -> float:
        """Share of the runs that held; NaN before any was tried."""
        return self.holding / self.runs if self.runs else np.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval of that share."""
        low, high = wilson(self.holding, self.runs)
        return float(low), float(high)

    @property
    def step_ms(self) -> float:
        """Mean time of a step, ms."""
        return 1e3 * self.seconds / self.steps if self.steps else 0.0

    @property
    def seed(self) -> int | None:
        """The seed to look at: the first with which it held, else the first of all."""
        return next((seed for seed, held in self.held.items() if held), next(iter(self.held), None))


@dataclass(frozen=True, slots=True)
class Comparison:
    """A change against none.

    Attributes:
        won: Seeds with which the run held with the change only.
        lost: Seeds with which it held without it only.
        p_value: Of McNemar's test.
        corrected: The same after Holm's correction for all changes that are tried.
    """

    won: int
    lost: int
    p_value: float
    corrected: float

    @property
    def verdict(self) -> Verdict:
        """What may be said of it."""
        if self.corrected >= LEVEL:
            return "unclear"
        return "better" if self.won > self.lost else "worse"


@dataclass(frozen=True)
class Report:
    """What came of all changes, as far as they have been tried.

    Attributes:
        loss: Frame in which the loss began.
        begin: Last frame that all runs have in common; the changes are in force from the next one on.
        end: Last frame that was computed.
        judged: In how many last frames a run must not have lost its target, to hold.
        planned: How many changes are tried in all, beside none.
        trials: Seeds that each is tried with in the end.
        findings: Of the unchanged settings first, then in the order in which they were tried.
        is_complete: Whether all that was planned was tried.
        asked: First frame of the loss that was asked about, if an earlier one goes on in it; else None.
    """

    loss: int
    begin: int
    end: int
    judged: int
    planned: int
    trials: int
    findings: tuple[Finding, ...]
    is_complete: bool = False
    asked: int | None = None

    def is_of(self, other: "Report") -> bool:
        """Whether the runs of both go through the same frames and are judged in the same ones, so that they compare."""
        numbers = ("loss", "begin", "end", "judged")
        return all(getattr(self, name) == getattr(other, name) for name in numbers)

    @property
    def loss_sentence(self) -> str:
        """Which loss is meant, a sentence."""
        if self.asked is None:
            return f"Lost in frame {self.loss}."
        return (
            f"Lost in frame {self.loss}, of which the loss in frame {self.asked} is a part: between them the target "
            "was back for too few frames to hold."
        )

    @property
    def baseline(self) -> Finding:
        """What came of the same settings with other seeds."""
        return self.findings[0]

    @cached_property
    def comparisons(self) -> Mapping[Alternative, Comparison]:
        """Each change that was tried against none, on the seeds that both were tried with.

        Changes that are yet to be tried count for the correction as if they made no difference.
        """
        base, others = self.baseline.held, self.findings[1:]
        pairs = [[(base[seed], held) for seed, held in each.held.items() if seed in base] for each in others]
        won = [sum(held and not before for before, held in each) for each in pairs]
        lost = [sum(before and not held for before, held in each) for each in pairs]
        p_values = mcnemar(won, lost)
        corrected = holm([*p_values, *(1.0 for _ in range(self.planned - len(others)))])
        told = zip(others, won, lost, p_values.tolist(), corrected.tolist(), strict=False)
        return {each.alternative: Comparison(*numbers) for each, *numbers in told}

    @cached_property
    def best_first(self) -> tuple[Finding, ...]:
        """The unchanged settings, then the changes by the share of runs that held, the cheaper first among equals.

        Those of which nothing is known, since a tracker gives no account of itself, are left out.
        """
        known = [each for each in self.findings[1:] if each.held]
        return (self.baseline, *sorted(known, key=lambda each: (-each.share, each.step_ms)))

    def verdict(self, finding: Finding) -> Verdict:
        """Return what may be said of a change."""
        return "baseline" if finding is self.baseline else self.comparisons[finding.alternative].verdict

    def words(self, finding: Finding) -> str:
        """Return what may be said of a change, with its corrected p-value; of none, nothing."""
        if finding is self.baseline:
            return ""
        p_value = self.comparisons[finding.alternative].corrected
        told = f"p < {LEAST_P}" if p_value < LEAST_P else f"p = {p_value:.2g}"
        return f"{WORDS[self.verdict(finding)]} ({told})"

    @property
    def correction(self) -> str:
        """What the p-values are, a sentence."""
        return f"Each p is McNemar's against no change on the same seeds, corrected for all {self.planned} (Holm)."

    @property
    def sentence(self) -> str:
        """What it comes to, in a sentence or two."""
        base = self.baseline
        if not base.runs:
            return "Nothing has been tried so far."
        luck = f"Of {base.runs} other seeds with the same settings {base.holding} hold"
        luck += ": it was bad luck." if 2 * base.holding > base.runs else "."
        better = [each for each in self.best_first if self.verdict(each) == "better"]
        if better:
            best = better[0]
            told = f"{best.alternative.title}: {best.holding} of {best.runs} hold."
            return f"{luck} Best of the {self.planned} changes: {told}"
        tried = "None" if self.is_complete else "So far none"
        return f"{luck} {tried} of the {self.planned} changes is clearly better."

    @property
    def progress(self) -> str:
        """With how many seeds the changes have been tried, in a sentence."""
        runs = [each.runs for each in self.findings[1:]]
        if not runs:
            return "No change has been tried so far."
        among = f"{len(runs)} of {self.planned}" if len(runs) < self.planned else f"All {self.planned}"
        seeds = f"{min(runs)} to {max(runs)}" if min(runs) < max(runs) else str(max(runs))
        return f"{among} changes were tried, with {seeds} of {self.trials} seeds each."

    @property
    def lines(self) -> tuple[str, ...]:
        """All of it in sentences: what it comes to, each finding, and what it does not say."""
        which = () if self.asked is None else (self.loss_sentence,)
        return (*which, self.sentence, *map(self._line, self.best_first), self.correction, CAVEAT)

    def _line(self, each: Finding) -> str:
        low, high = each.interval
        held = f"{each.holding} of {each.runs} hold ({low:.0%} to {high:.0%})"
        said = [f"{each.alternative.title}: {held}", f"{each.step_ms:.2g} ms a step", self.words(each)]
        return ", ".join(filter(None, said)) + "."

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values, the findings best first."""
        numbers = ("loss", "begin", "end", "judged", "planned", "trials", "is_complete", "loss_sentence", "sentence")
        findings = [self._told(each) for each in self.best_first]
        told = {name: getattr(self, name) for name in numbers}
        return {
            **told,
            "progress": self.progress,
            "correction": self.correction,
            "caveat": CAVEAT,
            "findings": findings,
        }

    def _told(self, each: Finding) -> dict[str, Any]:
        low, high = each.interval
        compared = None if each is self.baseline else self.comparisons[each.alternative]
        return {
            "kind": each.alternative.kind,
            "title": each.alternative.title,
            "values": dict(each.alternative.values),
            "parameter": each.alternative.parameter,
            "holding": each.holding,
            "runs": each.runs,
            "share": to_json(each.share),
            "low": to_json(low),
            "high": to_json(high),
            "step_ms": each.step_ms,
            "p_value": compared and compared.p_value,
            "corrected": compared and compared.corrected,
            "verdict": self.verdict(each),
            "seed": each.seed,
        }


def record(report: Report) -> dict[str, Any]:
    """Return a report as JSON values, for another process; `read_record` reads it."""
    names = ("loss", "begin", "end", "judged", "planned", "trials", "is_complete", "asked")
    return {**{name: getattr(report, name) for name in names}, "findings": [*map(_record_finding, report.findings)]}


def read_record(values: Mapping[str, Any]) -> Report:
    """Return the report that `record` has written, in which the keys of what held may be numbers or their digits."""
    return Report(**{**values, "findings": tuple(map(_read_finding, values["findings"]))})


def _record_finding(each: Finding) -> dict[str, Any]:
    change = {name: getattr(each.alternative, name) for name in ("kind", "title", "values", "parameter")}
    held = {str(seed): holds for seed, holds in each.held.items()}
    return {**change, "held": held, "steps": each.steps, "seconds": each.seconds, "place": each.place}


def _read_finding(values: Mapping[str, Any]) -> Finding:
    change = Alternative(*(values[name] for name in ("kind", "title", "values", "parameter")))
    held = {int(seed): holds for seed, holds in values["held"].items()}
    return Finding(change, held, values["steps"], values["seconds"], values["place"])


def join(reports: Sequence[Report]) -> Report | None:
    """Return one report of what several have found of one run, each of other changes; None before anything is.

    Until somebody has told of the unchanged settings there is nothing to compare with.
    """
    found = sorted((each for report in reports for each in report.findings), key=lambda each: each.place)
    if not found or found[0].place != 0:
        return None
    return replace(reports[0], findings=tuple(found), is_complete=all(report.is_complete for report in reports))
