"""Trials: runs that go on from shortly before a loss, with a change and with other seeds."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.analysis.counterfactuals.alternatives import Allow, Alternative, allow_all, alternatives
from pftrack.analysis.counterfactuals.report import Finding, Report
from pftrack.core.model.timeline import Change, Timeline
from pftrack.runs.continuation import Continuation, Stretch, go_on, read_stretches, takes_all_at_once
from pftrack.runs.ensemble import check_not_replayed, other_seeds
from pftrack.runs.loss_intervals import before_loss, first_loss, losses
from pftrack.runs.lost_frames import find_lost_frames
from pftrack.runs.run import Run

__all__ = ["HORIZON_FRAMES", "JUDGED_FRAMES", "ROUNDS", "LossError", "find_loss", "what_if"]

HORIZON_FRAMES = 30
"""So many frames after the loss runs are followed, where the run is that long."""

JUDGED_FRAMES = 10
"""In so many last of them a run must not have lost its target, to hold."""

ROUNDS = 1, 4, 10, 20, 40
"""Seeds that each change has been tried with after each round: all are tried a little before one is tried much."""


class LossError(ValueError):
    """There is no loss to be explained."""


def find_loss(run: Run, frame: int | None = None) -> int:
    """Return the frame in which a loss began.

    A target that was seen again for a moment only, fewer frames than a run must have it in to hold, was lost all along.

    Args:
        run: As far as it has been computed.
        frame: The last loss that began at or before this frame is meant, failing that the first after it; the first
            that lasts if not given.

    Raises:
        LossError: The run has not lost its target so far.
    """
    return _find_loss(run, frame)[0]


def _find_loss(run: Run, frame: int | None) -> tuple[int, int]:
    """Return the frame in which a loss began, as `find_loss` has it, and the same of the loss that is asked about."""
    lost = find_lost_frames(run).lost.tolist()
    first = first_loss(lost)
    if first is None:
        raise LossError("the run has not lost its target so far")
    found = losses(lost)
    asked = first if frame is None else max((start for start, _ in found if start <= frame), default=found[0][0])
    meant = asked
    for start, end in reversed(found):
        if end < meant <= end + JUDGED_FRAMES:
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
    what is known. Several may share the work, each with its part of the changes; `report.join` puts their reports
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
        LossError: The run has not lost its target so far, or begins with that.
        ReplayError: It is a recording of what was computed elsewhere.
    """
    loss, asked = _find_loss(run, frame)
    check_not_replayed(run, loss)
    if loss == 0:
        raise LossError("the run begins with its target lost: there is nothing before that could be changed")
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
    )
    before = {each.place: each for each in known.findings} if known is not None and report.is_of(known) else {}
    findings: dict[int, Finding] = {}
    for count, following in zip(rounds, (*rounds[1:], rounds[-1]), strict=True):
        for place in range(share[0], len(tried), share[1]):
            finding = findings.get(place) or _take_over(tried[place], place, before)
            wanted = seeds[: following if place == 0 else count]
            for some in trials.groups(finding, [seed for seed in wanted if seed not in finding.held]):
                if finding.is_unknown:
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
        self.judged = min(JUDGED_FRAMES, last - begin)
        self._run, self._begin, self._loss_frame, self._last = run, begin, loss, last
        self._state = run.branch(begin).current.state
        self._stretches: dict[Alternative | None, list[Stretch]] = {}

    def groups(self, finding: Finding, seeds: Sequence[int]) -> Sequence[Sequence[int]]:
        """Return the seeds that are tried together: all where the tracker takes them at once, else one by one."""
        together = self._together(self._timeline(finding.alternative))
        return [seeds] if together and seeds else [[seed] for seed in seeds]

    def extend(self, finding: Finding, seeds: Sequence[int]) -> Finding:
        """Return a finding with more seeds tried, without those of which nobody knows what came."""
        timeline, run = self._timeline(finding.alternative), self._run
        frames = self._frames(finding.alternative, timeline)
        one = Continuation(run.experiment, timeline, seeds[0], self._state)
        if self._together(timeline):
            courses = go_on(run.experiment, timeline, seeds, self._state, frames, first=self._begin + 1)
            lost = truly = np.concatenate([each for _, each in courses], axis=1)
            if not finding.steps:  # what a step of a run by itself takes
                one.take(Stretch(frames[0].frames[:1]))
        else:
            for stretch in frames:
                one.take(stretch)
            lost, truly = one.lost[None], one.truly_lost[None]
        holds = {seed: self._holds(*rows) for seed, *rows in zip(seeds, truly, lost, strict=True)}
        return replace(
            finding,
            held={**finding.held, **{seed: each for seed, each in holds.items() if each is not None}},
            steps=finding.steps + one.steps,
            seconds=finding.seconds + one.seconds,
        )

    def _together(self, timeline: Timeline) -> bool:
        return takes_all_at_once(self._run.experiment, timeline, self._begin + 1) is not None

    def _holds(self, truly: NDArray[np.float64], lost: NDArray[np.float64]) -> bool | None:
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

    def _frames(self, alternative: Alternative, timeline: Timeline) -> list[Stretch]:
        """Return the frames to come, which are the same for all changes but those of the world."""
        key = alternative if alternative.kind == "world" else None
        if key not in self._stretches:
            read = list(read_stretches(self._run.source, timeline, self._begin + 1, self._last))
            kept = self._stretches.get(None)
            self._stretches = {**({} if kept is None else {None: kept}), key: read}
        return self._stretches[key]


def _begin(run: Run, loss: int) -> int:
    """Return the frame from which on things are changed: some before the loss, or before what led to it.

    Of a loss that a mark tells, nobody knows when it began: it was held for sure in the last mark before that held.
    """
    said = find_lost_frames(run)
    hidden = [row.hidden is True for row in run.diagnostics]
    found = before_loss(said.lost.tolist(), hidden, loss)
    begin = min(loss - 1, loss if found is None else found)
    if said.witnesses[loss] == "truth":
        held = (at for at in range(loss - 1, -1, -1) if said.verdicts[at] == (False, "truth"))
        begin = min(begin, next(held, 0))
    return max(0, begin)
