"""Counterfactuals: what would have saved a run that lost its target, found by experiment.

A run can be repeated from any of its frames with the same numbers. So pftrack goes back to shortly before the loss
(`pftrack.runs.loss`), changes one thing, and continues the run with many other seeds: does it then hold? The changes
(`pftrack.analysis.alternatives`) follow from the declared roles of parameters, so they exist for every tracker. The
first trial changes nothing: if many runs with other seeds hold, the loss was bad luck.

Each share comes with Wilson's interval. A change is compared with no change on the same seeds (McNemar's test), and
Holm's method corrects the p-values for their number. Fewer than eleven pairs give no verdict: even eleven seeds that
all favour a change are only just enough among thirty. Runs are judged soon after the loss and at their end, since a
change may save the target only for a while. A cure of this run need not cure others; only a sweep shows that.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
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
from pftrack.runs.many import KeptFrames, Trial, read_blocks
from pftrack.runs.run import Run

__all__ = ["Alternative", "Finding", "Report", "alternatives", "find_loss", "join", "read_record", "record", "what_if"]


# Reports: the results of the tested changes, with their certainty; and the trials themselves.
#
# A trial is a run that continues from shortly before a loss, with a change and with other seeds.

Verdict: TypeAlias = Literal["baseline", "better", "brief", "worse", "unclear", "few"]
"""The verdict on a change: "brief" if it helps soon after the loss but not later, "unclear" if chance explains as much,
"few" before it was tried with enough seeds."""

LEAST_P = 0.001
"""Smaller p-values are shown as below this."""

WORDS: Mapping[Verdict, str] = {
    "baseline": "",
    "better": "better than no change",
    "brief": "better for a while, but not later",
    "worse": "worse than no change",
    "unclear": "not clearly better than no change",
    "few": "too few seeds to tell",
}
"""Names of verdicts."""

LEVEL = 0.05
"""Corrected p-values below this are called better or worse than no change."""

LEAST_PAIRS = 11
"""Number of seeds required with and without a change for a verdict: with fewer, not even a change that always wins is
better after the correction for thirty changes."""

CAVEAT = "A cure of this run is not a cure in general: a sweep over seeds and scenes says that."


@dataclass(frozen=True, slots=True)
class Finding:
    """The results of one change.

    Attributes:
        alternative: The change.
        held: Whether the run held its target soon after the loss, by seed; of all seeds tried so far.
        steps: Steps that were taken.
        seconds: Their duration.
        place: Number of the change in the order in which they are tried; 0 is none.
        at_end: Whether the run held its target in the last frame of its trial, by seed; of those tried so far.
    """

    alternative: Alternative
    held: Mapping[int, bool]
    steps: int = 0
    seconds: float = 0.0
    place: int = 0
    at_end: Mapping[int, bool] = field(default_factory=dict)

    @property
    def runs(self) -> int:
        """Number of tried seeds."""
        return len(self.held)

    @property
    def holding(self) -> int:
        """Number of runs that held."""
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
    def rank(self) -> tuple[float, float, float]:
        """Smaller for a better change: by the share at the end where that is known, by the other, by its cost."""
        end = sum(self.at_end.values()) / len(self.at_end) if self.at_end else self.share
        return -end, -self.share, self.step_ms

    @property
    def seed(self) -> int | None:
        """The seed to look at: the first with which it held to the end, else for a while, else the first of all."""
        held = (seed for found in (self.at_end, self.held) for seed, each in found.items() if each)
        return next(held, next(iter(self.held), None))


@dataclass(frozen=True, slots=True)
class Comparison:
    """A change against none.

    Attributes:
        won: Seeds with which the run held with the change only.
        lost: Seeds with which it held without it only.
        pairs: Seeds that both were tried with.
        lasts: Whether more runs hold in the last frame with the change than without, as far as that is known.
        p_value: P value of McNemar's test.
        corrected: The same after Holm's correction for all changes that are tried.
    """

    won: int
    lost: int
    pairs: int
    lasts: bool
    p_value: float
    corrected: float

    @property
    def verdict(self) -> Verdict:
        """The verdict on it."""
        if self.pairs < LEAST_PAIRS:
            return "few"
        if self.corrected >= LEVEL:
            return "unclear"
        if self.won < self.lost:
            return "worse"
        return "better" if self.lasts else "brief"


@dataclass(frozen=True, slots=True)
class ToldFinding:
    """One change with its share of runs that hold; the first changes nothing but the seed.

    Attributes:
        kind: Kind of the change.
        title: Its title.
        values: The values that it sets.
        parameter: Name of the one parameter that is changed; empty if none is.
        holding: Number of runs that held soon after the loss.
        runs: Number of tried seeds.
        share: Share of the runs that held.
        low: Lower end of its 95 % interval (Wilson).
        high: Upper end.
        holding_at_end: Number of runs that held in the last frame to which they were followed.
        runs_to_end: Number of runs followed to that frame.
        shares: The shares of holding runs, in words.
        step_ms: Mean time of a step, ms.
        corrected: p-value of McNemar's test against no change on the same seeds, after Holm's correction.
        verdict: The verdict.
        words: The same in words.
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
    holding_at_end: int
    runs_to_end: int
    shares: str
    step_ms: float
    corrected: float | None
    verdict: Verdict
    words: str
    seed: int | None


@dataclass(frozen=True)
class Report:
    """The results of all changes tried so far; its JSON has the findings as shown.

    Attributes:
        loss: Frame in which the loss began that is explained, as *Why?* names it.
        begin: Last frame that all runs have in common; the changes are in force from the next one on.
        end: Frame soon after the loss up to which runs are compared.
        last: Last frame to which they are followed: 300 frames after the loss, or the end of the run.
        judged: Number of last frames in which a run must not have lost its target, to hold.
        planned: Number of changes to try, in addition to none.
        trials: Seeds that each is tried with in the end.
        findings: Finding on the unchanged settings first, then on changes in the order of their trials.
        is_complete: Whether all that was planned was tried.
        first_lost_frame: The first frame of all in which the run has lost its target.
        reaches_end: Whether `last` is the end of the run.
    """

    loss: int
    begin: int
    end: int
    last: int
    judged: int
    planned: int
    trials: int
    findings: Annotated[tuple[Finding, ...], Field(exclude=True)]
    is_complete: bool = False
    first_lost_frame: int | None = None
    reaches_end: bool = True

    @computed_field  # type: ignore[prop-decorator]
    @property
    def loss_sentence(self) -> str:
        """The loss that is explained, in a sentence."""
        first = self.first_lost_frame
        return f"Lost in frame {self.loss}" + ("." if first in {None, self.loss} else f", first in frame {first}.")

    @property
    def baseline(self) -> Finding:
        """The result of the same settings with other seeds."""
        return self.findings[0]

    @cached_property
    def comparisons(self) -> Mapping[Alternative, Comparison]:
        """Each change that was tried against none, on the seeds that both were tried with.

        Changes that are yet to be tried count for the correction as if they made no difference.
        """
        others = self.findings[1:]
        pairs = [_pairs(self.baseline.held, each.held) for each in others]
        ends = [_pairs(self.baseline.at_end, each.at_end) for each in others]
        won = [sum(held and not before for before, held in each) for each in pairs]
        lost = [sum(before and not held for before, held in each) for each in pairs]
        lasts = [len(each) < LEAST_PAIRS or sum(held - before for before, held in each) > 0 for each in ends]
        p_values = mcnemar(won, lost)
        corrected = holm([*p_values, *(1.0 for _ in range(self.planned - len(others)))])
        told = zip(others, won, lost, map(len, pairs), lasts, p_values.tolist(), corrected.tolist(), strict=False)
        return {each.alternative: Comparison(*numbers) for each, *numbers in told}

    @cached_property
    def best_first(self) -> tuple[Finding, ...]:
        """The unchanged settings, then the changes, best first.

        Changes without a verdict, since their tracker reports no losses, are left out.
        """
        known = [each for each in self.findings[1:] if each.held]
        return (self.baseline, *sorted(known, key=lambda each: each.rank))

    def verdict(self, finding: Finding) -> Verdict:
        """Return the verdict on a change."""
        return "baseline" if finding is self.baseline else self.comparisons[finding.alternative].verdict

    def words(self, finding: Finding) -> str:
        """Return the verdict on a change, with its corrected p-value; empty for no change."""
        verdict = self.verdict(finding)
        if verdict in {"baseline", "few"}:
            return WORDS[verdict]
        p_value = self.comparisons[finding.alternative].corrected
        told = f"p < {LEAST_P}" if p_value < LEAST_P else f"p = {p_value:.2g}"
        return f"{WORDS[verdict]} ({told})"

    def shares(self, finding: Finding) -> str:
        """Return the numbers of runs that hold soon after the loss, and in the last frame, as far as known."""
        near = f"{finding.holding} of {finding.runs} hold to"
        end = "the end" if self.reaches_end else f"frame {self.last}"
        if self.end == self.last:
            return f"{near} {end}"
        far = f", {sum(finding.at_end.values())} of {len(finding.at_end)} to {end}" if finding.at_end else ""
        return f"{near} frame {self.end}{far}"

    @computed_field  # type: ignore[prop-decorator]
    @property
    def correction(self) -> str:
        """The origin of the p-values, a sentence."""
        tests = f"Holm's correction for {self.planned} changes"
        return f"p is from McNemar's test against no change on the same seeds, after {tests}."

    @computed_field  # type: ignore[prop-decorator]
    @property
    def sentence(self) -> str:
        """The result in one or two sentences, as far as the seeds tried so far allow."""
        base = self.baseline
        if base.runs < LEAST_PAIRS:
            return "Too few seeds to tell."
        luck = f"{base.holding} of {base.runs} other seeds with the same settings hold"
        luck += ": it was bad luck." if 2 * base.holding > base.runs else "."
        verdicts = list(map(self.verdict, self.best_first))
        few = "few" in verdicts or len(self.findings) <= self.planned
        if "better" in verdicts:
            best = self.best_first[verdicts.index("better")]
            among = "Best so far" if few else f"Best of the {self.planned} changes"
            return f"{luck} {among}: {best.alternative.title}: {self.shares(best)}."
        if few:
            return f"{luck} Too few seeds to tell what helps."
        return f"{luck} No change is clearly better{'' if self.is_complete else ' so far'}."

    @property
    def done(self) -> int:
        """Number of trials made: a run is judged soon after the loss, and again at its end."""
        return sum(each.runs + len(each.at_end) for each in self.findings)

    @property
    def total(self) -> int:
        """Number of planned trials."""
        return 2 * (self.planned + 1) * self.trials

    @property
    def lines(self) -> tuple[str, ...]:
        """The report in sentences: the result, each finding, and the limits of the result."""
        return (self.sentence, *map(self._line, self.best_first), self.correction, CAVEAT)

    def _line(self, each: Finding) -> str:
        low, high = each.interval
        held = f"{each.alternative.title}: {self.shares(each)} ({low:.0%} to {high:.0%})"
        said = [held, f"{each.step_ms:.2g} ms a step", self.words(each)]
        return ", ".join(filter(None, said)) + "."

    @computed_field(alias="findings")  # type: ignore[prop-decorator]
    @property
    def told(self) -> tuple[ToldFinding, ...]:
        """One entry a change, best first."""
        return tuple(map(self._tell, self.best_first))

    def as_dict(self) -> dict[str, Any]:
        """Return its displayed values as JSON values."""
        return as_json(self)

    def _tell(self, each: Finding) -> ToldFinding:
        low, high = each.interval
        return ToldFinding(
            **asdict(each.alternative),
            holding=each.holding,
            runs=each.runs,
            share=each.share,
            low=low,
            high=high,
            holding_at_end=sum(each.at_end.values()),
            runs_to_end=len(each.at_end),
            shares=self.shares(each),
            step_ms=each.step_ms,
            corrected=None if each is self.baseline else self.comparisons[each.alternative].corrected,
            verdict=self.verdict(each),
            words=self.words(each),
            seed=each.seed,
        )


def _pairs(before: Mapping[int, bool], held: Mapping[int, bool]) -> list[tuple[bool, bool]]:
    """Return what came of the seeds that no change and a change were both tried with."""
    return [(before[seed], each) for seed, each in held.items() if seed in before]


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
    """Return one report from several on one run, each on other changes; None before anything is.

    Without findings about the unchanged settings there is nothing to compare with.
    """
    found = sorted((each for report in reports for each in report.findings), key=lambda each: each.place)
    if not found or found[0].place != 0:
        return None
    return replace(reports[0], findings=tuple(found), is_complete=all(report.is_complete for report in reports))


HORIZON_FRAMES, FAR_FRAMES = 30, 300
"""Frames after the loss: runs are compared after the first number, and followed to the second or to their end."""

ROUNDS = 1, 4, 12, 20, 40
"""Seeds that each change has been tried with after each round: all are tried a little before one is tried much."""

FEW = 12
"""With up to so many seeds, runs are followed to the horizon; then these and all others to the last frame, the best
changes first."""


def find_loss(run: Run, frame: int | None = None) -> tuple[int, int]:
    """Return the frame in which the loss that is explained began, and the one since which the run has not held.

    The second is earlier where the target came back between two losses, but for fewer frames than a run needs to hold.

    Args:
        run: The run, as far as computed.
        frame: The last loss that began at or before this frame is meant, failing that the first after it; the first
            that lasts if not given.

    Raises:
        RefusedError: The run has not lost its target so far.
    """
    known = Loss.of(run.diagnostics)
    lasting, found = known.lasting, known.spans
    if lasting is None:
        raise RefusedError("the run has not lost its target so far")
    loss = lasting if frame is None else max((start for start, _ in found if start <= frame), default=found[0][0])
    since = loss
    for start, end in reversed(found):
        if end < since <= end + END_FRAMES:
            since = start
    return loss, since


def what_if(
    run: Run,
    frame: int | None = None,
    *,
    rounds: Sequence[int] = ROUNDS,
    allow: Allow = allow_all,
    share: tuple[int, int] = (0, 1),
) -> Iterator[Report]:
    """Try changes that might have saved a run, and yield the growing report repeatedly.

    Stop iterating when you have seen enough: each report holds for what has been tried. Several processes may share
    the work, each with its part of the changes; `join` puts their reports together.

    Args:
        run: The run, as far as computed; it stays unchanged.
        frame: In or after the loss that is meant; see `find_loss`.
        rounds: Ascending numbers of seeds: all changes are tried with the first so many, then with more.
        allow: Limits of the computation.
        share: (k, n): of n parts of the changes only the k-th is tried, and in the reports. No change is in the first.

    Raises:
        RefusedError: The run has not lost its target so far or begins with that, or was computed elsewhere.
    """
    loss, since = find_loss(run, frame)
    check_not_replayed(run, since)
    if since == 0:
        raise RefusedError("the run begins with its target lost, so no earlier frame can be changed")
    trials = _Trials(run, _begin(run, since), since)
    tried = alternatives(run, trials.begin + 1, allow=allow)
    seeds = other_seeds(run.seed, rounds[-1])
    limits = loss, trials.begin, trials.end, trials.last, trials.judged
    first = Loss.of(run.diagnostics).first_lost_frame
    report = Report(
        *limits, len(tried) - 1, rounds[-1], (), first_lost_frame=first, reaches_end=trials.last == run.frames - 1
    )
    findings = {place: Finding(tried[place], {}, place=place) for place in range(share[0], len(tried), share[1])}
    stages = [(count, trials.end) for count in rounds if count <= FEW]
    stages += [(count, trials.last) for count in rounds if count >= min(FEW, rounds[-1])]
    for count, last in stages:
        for place in sorted(findings, key=lambda place: (place > 0, findings[place].rank if last > trials.end else ())):
            known = findings[place].held if last == trials.end else findings[place].at_end
            for finding in trials.extend(findings[place], [seed for seed in seeds[:count] if seed not in known], last):
                findings[place] = finding
                report = replace(report, findings=tuple(each for each in findings.values() if each.steps))
                yield report
    yield replace(report, findings=tuple(findings.values()), is_complete=True)


class _Trials:
    """The common start of all trials."""

    def __init__(self, run: Run, begin: int, loss: int) -> None:
        self.begin, most = begin, run.frames - 1
        self.end, self.last = min(loss + HORIZON_FRAMES, most), min(loss + FAR_FRAMES, most)
        self.judged = min(END_FRAMES, self.end - begin)
        self._run, self._since = run, loss - begin - 1
        self._state = run.branch(begin).current.state
        self._kept: dict[Alternative | None, KeptFrames] = {}

    def extend(self, finding: Finding, seeds: Sequence[int], last: int) -> Iterator[Finding]:
        """Yield a finding with more and more seeds tried up to a frame, where a tracker can with all of them at once.

        A seed with an unknown outcome is left out, and ends the trials of its change.
        """
        timeline, run, first = self._timeline(finding.alternative), self._run, self.begin + 1
        source, together = self._source(finding.alternative, timeline), takes_all_at_once(run, timeline, first)
        told = {"held": self.end - self.begin} | ({"at_end": last - self.begin} if last == self.last else {})
        for some in [seeds] if together and seeds else [[seed] for seed in seeds]:
            if finding.steps > 0 and not finding.held:
                return
            blocks = read_blocks(source, timeline.history, first, last)
            one = Trial(run.experiment, source, timeline, some[0], self._state)
            if together:
                found = go_on(run, timeline, some, self._state, blocks, first)
                lost = truly = np.concatenate([each for _, each in found], axis=1)
                if not finding.steps:  # the duration of a step of a single run
                    one.take(next(read_blocks(source, timeline.history, first, first)))
            else:
                for block in blocks:
                    one.take(block)
                lost, truly = one.lost[None], one.truly_lost[None]
            held: dict[str, Any] = {name: dict(getattr(finding, name)) for name in told}
            for seed, *rows in zip(some, truly, lost, strict=True):
                for name, length in told.items():
                    holds = self._holds(*(row[:length] for row in rows))
                    held[name] |= {} if holds is None else {seed: holds}
            finding = replace(finding, **held, steps=finding.steps + one.steps, seconds=finding.seconds + one.seconds)
            yield finding

    def _holds(self, truly: Floats, lost: Floats) -> bool | None:
        """Return whether a run holds its target, by the truth, else by the tracker's own account; None without either.

        Where the truth is known in any of the last frames, it alone counts; where it is known in earlier frames only,
        all frames since the loss count. The tracker's own account may be what was wrong with the run.
        """
        for each in (truly, lost):
            last, since = each[-self.judged :], each[self._since :]
            said = since if np.isnan(last).all() else last
            if not np.isnan(said).all():
                return not np.any(said == 1.0)
        return None

    def _timeline(self, alternative: Alternative) -> Timeline:
        run, frame = self._run, self.begin + 1
        defaults, names = run.setup.parameters, tuple(run.experiment.trackers)
        timeline = Timeline.begin(defaults, run.tracker, names, run.timeline.changes_until(frame))
        return timeline.insert(Change(frame, alternative.values)) if alternative.values else timeline

    def _source(self, alternative: Alternative, timeline: Timeline) -> KeptFrames:
        """Return the frames to come, which are the same for all changes but those of the world."""
        key = alternative if alternative.kind == "world" else None
        if key not in self._kept:
            kept, made = self._kept.get(None), KeptFrames(self._run.source, timeline.history)
            self._kept = {**({} if kept is None else {None: kept}), key: made}
        return self._kept[key]


def _begin(run: Run, loss: int) -> int:
    """Return the frame from which on things are changed: the one from which to watch a loss."""
    found = Loss.of(run.diagnostics).approach([row.hidden is True for row in run.diagnostics], loss)
    return loss - 1 if found is None else min(found, loss - 1)
