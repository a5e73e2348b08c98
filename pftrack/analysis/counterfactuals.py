"""Counterfactuals: what would have saved a run that lost its target, found by experiment.

A run can be repeated from any of its frames, to the same numbers. So one goes back to shortly before the loss
(`pftrack.runs.scoring`), changes one thing, and lets the run go on with many other seeds: does it then hold? The
changes (`pftrack.analysis.alternatives`) are found by what parameters declare of themselves, their roles, so that they
exist for every tracker. First of all nothing is changed: of the same settings with other seeds many may hold, and then
it was bad luck.

Each share comes with Wilson's interval. A change is compared with no change on the same seeds (McNemar's test), and
since many are tried the p-values are corrected for that (Holm). What cures this run need not cure others: that is a
question for a sweep.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from pydantic import Field, TypeAdapter, computed_field

from pftrack.analysis.alternatives import Allow, Alternative, Kind, allow_all, alternatives
from pftrack.analysis.other_seeds import check_not_replayed, go_on, other_seeds, takes_all_at_once
from pftrack.core.arrays import Floats
from pftrack.core.model.measures import END_FRAMES
from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change, Timeline
from pftrack.core.model.series import Known, as_json
from pftrack.core.numerics.statistics import holm, mcnemar, wilson
from pftrack.core.refusal import RefusedError
from pftrack.runs.loss import Loss
from pftrack.runs.many import FrameBlock, Trial, read_blocks
from pftrack.runs.run import Run

__all__ = [
    "Alternative",
    "Finding",
    "Report",
    "alternatives",
    "find_loss",
    "join",
    "read_record",
    "record",
    "what_if",
]


# Reports: what came of the changes that were tried, and how sure one may be of it; and the trials themselves.
#
# A trial is a run that goes on from shortly before a loss, with a change and with other seeds.

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


@dataclass(frozen=True, slots=True)
class ToldFinding:
    """One change with its share of runs that hold; the first changes nothing but the seed.

    Attributes:
        kind: Of the change.
        title: What people call it.
        values: What it sets.
        parameter: Name of the one parameter that is changed; empty if none is.
        holding: How many runs held.
        runs: How many seeds were tried.
        share: Of the runs that held.
        low: Lower end of its 95 % interval (Wilson).
        high: Upper end.
        step_ms: Mean time of a step, ms.
        p_value: Of McNemar's test against no change on the same seeds.
        corrected: The same after Holm's correction for all changes that are tried.
        verdict: What may be said of it.
        seed: To look at: the first with which it holds, else the first that was tried.
    """

    kind: Kind
    title: str
    values: Mapping[str, Value]
    parameter: str
    holding: int
    runs: int
    share: Known
    low: Known
    high: Known
    step_ms: float
    p_value: float | None
    corrected: float | None
    verdict: Verdict
    seed: int | None


@dataclass(frozen=True)
class Report:
    """What came of all changes, as far as they have been tried; its JSON has findings as they are told.

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
        first_lost_frame: The first frame of all in which the run has lost its target.
    """

    loss: int
    begin: int
    end: int
    judged: int
    planned: int
    trials: int
    findings: Annotated[tuple[Finding, ...], Field(exclude=True)]
    is_complete: bool = False
    asked: Annotated[int | None, Field(exclude=True)] = None
    first_lost_frame: int | None = None

    @computed_field  # type: ignore[prop-decorator]
    @property
    def loss_sentence(self) -> str:
        """Which loss is meant, a sentence."""
        first = self.first_lost_frame
        lost = f"Lost in frame {self.loss}" + ("" if first in {None, self.loss} else f", first in frame {first}")
        if self.asked is None:
            return f"{lost}."
        return (
            f"{lost}, of which the loss in frame {self.asked} is a part: between them the target "
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

    @computed_field  # type: ignore[prop-decorator]
    @property
    def correction(self) -> str:
        """What the p-values are, a sentence."""
        return f"Each p is McNemar's against no change on the same seeds, corrected for all {self.planned} (Holm)."

    @computed_field  # type: ignore[prop-decorator]
    @property
    def sentence(self) -> str:
        """The result in one or two sentences."""
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

    @computed_field  # type: ignore[prop-decorator]
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

    @computed_field  # type: ignore[prop-decorator]
    @property
    def caveat(self) -> str:
        """What it does not say."""
        return CAVEAT

    @computed_field(alias="findings")  # type: ignore[prop-decorator]
    @property
    def told(self) -> tuple[ToldFinding, ...]:
        """One entry a change, best first."""
        return tuple(map(self._tell, self.best_first))

    def as_dict(self) -> dict[str, Any]:
        """Return what is told of it as JSON values."""
        return as_json(self)

    def _tell(self, each: Finding) -> ToldFinding:
        change, compared = each.alternative, None if each is self.baseline else self.comparisons[each.alternative]
        return ToldFinding(
            change.kind,
            change.title,
            change.values,
            change.parameter,
            each.holding,
            each.runs,
            each.share,
            *each.interval,
            each.step_ms,
            None if compared is None else compared.p_value,
            None if compared is None else compared.corrected,
            self.verdict(each),
            each.seed,
        )


_RECORDS: TypeAdapter[Report] = TypeAdapter(Report)


def record(report: Report) -> dict[str, Any]:
    """Return a report as JSON values, for another process; `read_record` reads it."""
    return asdict(report)


def read_record(values: Mapping[str, Any]) -> Report:
    """Return the report that `record` has written.

    Raises:
        ValidationError: The values are not those of a report; a process that has read what came from elsewhere may err.
    """
    return _RECORDS.validate_python(values)


def join(reports: Sequence[Report]) -> Report | None:
    """Return one report of what several have found of one run, each of other changes; None before anything is.

    Until somebody has told of the unchanged settings there is nothing to compare with.
    """
    found = sorted((each for report in reports for each in report.findings), key=lambda each: each.place)
    if not found or found[0].place != 0:
        return None
    return replace(reports[0], findings=tuple(found), is_complete=all(report.is_complete for report in reports))


HORIZON_FRAMES = 30
"""So many frames after the loss runs are followed, where the run is that long."""

ROUNDS = 1, 4, 10, 20, 40
"""Seeds that each change has been tried with after each round: all are tried a little before one is tried much."""


def find_loss(run: Run, frame: int | None = None) -> tuple[int, int]:
    """Return the frame in which a loss began that is to be explained, and that of the loss that was asked about.

    A target that was seen again for a moment only, fewer frames than a run must have it in to hold, was lost all along:
    then the one is earlier than the other.

    Args:
        run: As far as it has been computed.
        frame: The last loss that began at or before this frame is meant, failing that the first after it; the first
            that lasts if not given.

    Raises:
        RefusedError: The run has not lost its target so far.
    """
    loss = Loss.of(run.diagnostics)
    lasting, found = loss.lasting, loss.spans
    if lasting is None:
        raise RefusedError("the run has not lost its target so far")
    asked = lasting if frame is None else max((start for start, _ in found if start <= frame), default=found[0][0])
    meant = asked
    for start, end in reversed(found):
        if end < meant <= end + END_FRAMES:
            meant = start
    return meant, asked


def what_if(
    run: Run,
    frame: int | None = None,
    *,
    rounds: Sequence[int] = ROUNDS,
    allow: Allow = allow_all,
    share: tuple[int, int] = (0, 1),
    known: Report | None = None,
) -> Iterator[Report]:
    """Try what would have saved a run, and yield the report again and again as it grows.

    Whoever has seen enough stops asking: each report holds for what has been tried, and whoever goes on later gives
    what is known. Several may share the work, each with its part of the changes; `join` puts their reports
    together.

    Args:
        run: As far as it has been computed; it is left as it is.
        frame: In or after the loss that is meant; see `find_loss`.
        rounds: Ascending numbers of seeds: all changes are tried with the first so many, then with more. What all are
            compared with, no change, is a round ahead.
        allow: What may be computed.
        share: (k, n): of n parts of the changes only the k-th is tried, and in the reports. No change is in the first.
        known: What was found of this run before, with these limits. It is not tried again, unless it is of another
            loss: since the run has gone on another one may be meant.

    Raises:
        RefusedError: The run has not lost its target so far or begins with that, or was computed elsewhere.
    """
    loss, asked = find_loss(run, frame)
    check_not_replayed(run, loss)
    if loss == 0:
        raise RefusedError("the run begins with its target lost: there is nothing before that could be changed")
    begin, last = _begin(run, loss), min(loss + HORIZON_FRAMES, run.frames - 1)
    trials = _Trials(run, begin, loss, last)
    tried = alternatives(run, begin + 1, allow=allow)
    seeds = other_seeds(run.seed, rounds[-1])
    report = Report(
        loss,
        begin,
        last,
        trials.judged,
        len(tried) - 1,
        rounds[-1],
        (),
        asked=asked if asked != loss else None,
        first_lost_frame=Loss.of(run.diagnostics).first_lost_frame,
    )
    # Findings compare that went through the same frames and are judged in the same ones.
    same = known is not None and all(
        getattr(report, name) == getattr(known, name) for name in ("loss", "begin", "end", "judged")
    )
    before = {each.place: each for each in known.findings} if known is not None and same else {}
    findings: dict[int, Finding] = {}
    for count, following in zip(rounds, (*rounds[1:], rounds[-1]), strict=True):
        for place in range(share[0], len(tried), share[1]):
            finding = findings.get(place) or _take_over(tried[place], place, before)
            wanted = seeds[: following if place == 0 else count]
            for some in trials.groups(finding, [seed for seed in wanted if seed not in finding.held]):
                if finding.steps > 0 and not finding.held:  # nobody said whether the run held: no other seed says more
                    break
                finding = findings[place] = trials.extend(finding, some)
                report = replace(report, findings=tuple(findings.values()))
                yield report
            findings[place] = finding
    yield replace(report, findings=tuple(findings.values()), is_complete=True)


def _take_over(alternative: Alternative, place: int, before: Mapping[int, Finding]) -> Finding:
    known = before.get(place)
    if known is None or known.alternative.values != alternative.values:
        return Finding(alternative, {}, place=place)
    return replace(known, alternative=alternative)


class _Trials:
    """What all trials begin with."""

    def __init__(self, run: Run, begin: int, loss: int, last: int) -> None:
        self.judged = min(END_FRAMES, last - begin)
        self._run, self._begin, self._loss_frame, self._last = run, begin, loss, last
        self._state = run.branch(begin).current.state
        self._kept: dict[Alternative | None, list[FrameBlock]] = {}

    def groups(self, finding: Finding, seeds: Sequence[int]) -> Sequence[Sequence[int]]:
        """Return the seeds that are tried together: all where the tracker takes them at once, else one by one."""
        together = self._together(self._timeline(finding.alternative))
        return [seeds] if together and seeds else [[seed] for seed in seeds]

    def extend(self, finding: Finding, seeds: Sequence[int]) -> Finding:
        """Return a finding with more seeds tried, without those of which nobody knows what came."""
        timeline, run = self._timeline(finding.alternative), self._run
        blocks = self._blocks(finding.alternative, timeline)
        one = Trial(run.experiment, run.source, timeline, seeds[0], self._state)
        if self._together(timeline):
            found = go_on(run, timeline, seeds, self._state, blocks, self._begin + 1)
            lost = truly = np.concatenate([each for _, each in found], axis=1)
            if not finding.steps:  # what a step of a run by itself takes
                one.take(FrameBlock(blocks[0].frames[:1], blocks[0].width))
        else:
            for block in blocks:
                one.take(block)
            lost, truly = one.lost[None], one.truly_lost[None]
        holds = {seed: self._holds(*rows) for seed, *rows in zip(seeds, truly, lost, strict=True)}
        return replace(
            finding,
            held={**finding.held, **{seed: each for seed, each in holds.items() if each is not None}},
            steps=finding.steps + one.steps,
            seconds=finding.seconds + one.seconds,
        )

    def _together(self, timeline: Timeline) -> bool:
        return takes_all_at_once(self._run, timeline, self._begin + 1) is not None

    def _holds(self, truly: Floats, lost: Floats) -> bool | None:
        """Return whether a run holds its target, by who says so; None if nobody does.

        Where the truth of any of the last frames is known, it alone counts, and where only of a few frames it is, that
        of all since the loss: what else is said may be what was wrong with the run.
        """
        for each in (truly, lost):
            last, since = each[-self.judged :], each[self._loss_frame - self._begin - 1 :]
            said = since if np.isnan(last).all() else last
            if not np.isnan(said).all():
                return not np.any(said == 1.0)
        return None

    def _timeline(self, alternative: Alternative) -> Timeline:
        run, frame = self._run, self._begin + 1
        defaults, names = run.setup.parameters, tuple(run.experiment.trackers)
        timeline = Timeline.begin(defaults, run.tracker, names, run.timeline.changes_until(frame))
        return timeline.insert(Change(frame, alternative.values)) if alternative.values else timeline

    def _blocks(self, alternative: Alternative, timeline: Timeline) -> list[FrameBlock]:
        """Return the frames to come, which are the same for all changes but those of the world."""
        key = alternative if alternative.kind == "world" else None
        if key not in self._kept:
            read = list(read_blocks(self._run.source, timeline.history, self._begin + 1, self._last))
            kept = self._kept.get(None)
            self._kept = {**({} if kept is None else {None: kept}), key: read}
        return self._kept[key]


def _begin(run: Run, loss: int) -> int:
    """Return the frame from which on things are changed: some before the loss, or before what led to it.

    Of a loss that a mark tells, nobody knows when it began: it was held for sure in the last mark before that held.
    """
    said = Loss.of(run.diagnostics)
    found = said.approach([row.hidden is True for row in run.diagnostics], loss)
    begin = min(loss - 1, loss if found is None else found)
    if said.witnesses[loss] == "truth":
        held = (at for at in range(loss - 1, -1, -1) if said.witnesses[at] == "truth" and not said.lost[at])
        begin = min(begin, next(held, 0))
    return max(0, begin)
