"""How true the probabilities of a loss are in real pictures (docs/explanation/loss.md).

Clips are few, so each is judged by weights that were fitted on all others, with everything that
`pftrack.reproduce.clips` does to a clip; the weights that are kept are fitted on all. A tracker declares its
probability on recordings where the expected calibration error of these judgements is at most 0.10 and they say more
than who knows but the share of lost frames. What a number means hangs on the pictures: weights are given to nothing but
what has changed since the beginning of a run, which means the same in all of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pftrack.experiment import Experiment
from pftrack.experiments import EXPERIMENTS, find
from pftrack.loss_probability.declaration import MOST_ERROR_ON_CLIPS
from pftrack.loss_probability.features import KINDS
from pftrack.loss_probability.logistic import fit
from pftrack.loss_probability.model import LossModel, Past, follow_features
from pftrack.reproduce.clips import clips_in, run_on, seed_of, take
from pftrack.reproduce.finding import Finding, not_run
from pftrack.reproduce.loss_probability import Judgement, Witnessed, findings_of, judge_told, signals_of
from pftrack.reproduce.pool import Pool

__all__ = ["RUNS", "ClipCase", "by_clip", "cases_on", "fit_on_clips", "judge_left_out", "on_clips", "witness_clips"]

RUNS = 4
"""So many ways each clip is taken."""

SIGNALS = "evidence", "spread", "jump", "ess"
"""What is read of a frame: few clips bear few weights, and these every tracker has that can have them."""

RELATIVE = "change", "lowest", "highest"
"""Kinds of features that mean the same in all pictures."""

RIDGE_SHARE = 0.03
"""Precision of the prior of each weight, for each frame that is fitted: those of one clip are much alike."""

NO_CLIPS = "it takes a folder of clips with their truth (--clips)"
REFUSED = "none is declared on recordings: its calibration error was {:.3f} on clips that it was not fitted on"
IDLE = "none is declared on recordings: on other clips it said no more than who knows but the share of lost frames"


@dataclass(frozen=True, slots=True)
class ClipCase:
    """What trackers of an experiment make of a clip, in one way to take it."""

    experiment: str
    trackers: tuple[str, ...]
    folder: Path
    clip: str
    number: int


def cases_on(experiment: str, trackers: Sequence[str], folder: Path) -> list[ClipCase]:
    """Return all ways to take the clips of a folder."""
    chosen, clips = tuple(trackers), clips_in(folder)
    return [ClipCase(experiment, chosen, folder, clip, number) for number in range(RUNS) for clip in clips]


def by_clip(
    cases: Sequence[ClipCase], runs: Sequence[Mapping[str, Witnessed]], tracker: str
) -> dict[str, list[Witnessed]]:
    """Return what was seen in the runs of a tracker, by the name of the clip; without those that know no truth."""
    found: dict[str, list[Witnessed]] = {}
    for case, seen in zip(cases, runs, strict=True):
        if tracker in seen and len(seen[tracker].lost):
            found.setdefault(case.clip, []).append(seen[tracker])
    return found


def witness_clips(case: ClipCase) -> dict[str, Witnessed]:
    """Return what was seen in the runs of the trackers that can begin on a clip as it is taken."""
    taken = take(case.folder, case.clip, case.number)
    experiment = find(case.experiment)
    seen: dict[str, Witnessed] = {}
    for name in case.trackers:
        run = run_on(experiment, name, taken, seed_of(case.clip, case.number)) if taken else None
        if run is not None:
            series = {one.name: one for one in experiment.trackers[name].series}
            _, features = follow_features(clip_signals(experiment, name), series, Past(), run.diagnostics)
            verdicts = [row.lost for row in run.diagnostics[1:]]
            known = np.array([one is not None for one in verdicts])
            seen[name] = Witnessed(features[known], np.array([one is True for one in verdicts])[known])
    return seen


def fit_on_clips(experiment: Experiment, tracker: str, seen: Sequence[Witnessed]) -> LossModel:
    """Return what says it of a tracker, by runs on clips that are there to be fitted."""
    features = np.concatenate([one.features for one in seen])
    lost = np.concatenate([one.lost for one in seen])
    counted = np.resize(np.isin(KINDS, RELATIVE), features.shape[1])
    regression = fit(np.where(counted, features, 0.0), lost, ridge=RIDGE_SHARE * len(lost))
    series = {one.name: one for one in experiment.trackers[tracker].series}
    return LossModel(clip_signals(experiment, tracker), regression, series)


def judge_left_out(experiment: Experiment, tracker: str, seen: Mapping[str, Sequence[Witnessed]]) -> Judgement:
    """Return how good such a probability is on clips that were not fitted: each is judged by a fit on the others."""
    told = []
    for clip, runs in seen.items():
        others = [one for name, some in seen.items() if name != clip for one in some]
        regression = fit_on_clips(experiment, tracker, others).regression
        told += [(regression.probabilities(one.features), one.lost) for one in runs]
    return judge_told(told)


def clip_signals(experiment: Experiment, tracker: str) -> tuple[str, ...]:
    """Return the signals of a tracker that count on recordings."""
    return tuple(name for name in signals_of(experiment, tracker) if name in SIGNALS)


def on_clips(pool: Pool, _full: bool) -> list[Finding]:
    """Judge what every tracker declares on recordings on the clips that are there for it."""
    if pool.clips is None:
        return [not_run("loss-clips", NO_CLIPS)]
    findings = []
    for name in EXPERIMENTS.own:
        declared = EXPERIMENTS[name].loss_probability
        if declared.on_recordings:
            cases = cases_on(name, tuple(declared.on_recordings), pool.clips)
            runs = pool.map(witness_clips, cases)
            for tracker in declared.on_recordings:
                judged = judge_left_out(EXPERIMENTS[name], tracker, by_clip(cases, runs, tracker))
                findings += findings_of(f"loss-clips: {name}, {tracker}", judged, MOST_ERROR_ON_CLIPS)
        refused = declared.refused_on_recordings.items()
        findings += [not_run(f"loss-clips: {name}, {tracker}", _reason(error)) for tracker, error in refused]
    return findings


def _reason(error: float) -> str:
    return REFUSED.format(error) if error > MOST_ERROR_ON_CLIPS else IDLE
