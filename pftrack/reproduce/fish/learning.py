"""What is learned offline: ten clips followed by the ordinary filter with 3,000 particles and wide noise (eqs 10-15).

`pftrack reproduce fish-offline --full --figures FOLDER` writes what was learned to FOLDER/learned.json; it is the file
that comes with the trackers, `pftrack/experiments/fish/trackers/learned.json`, and here it is compared with that.
"""

import numpy as np

from pftrack.experiments.fish.trackers.learned import FISH, GUIDANCE
from pftrack.filters.learning.diffusion import Learned, learn
from pftrack.reproduce.finding import CHOSEN, Finding, Own, claim, compare, not_run
from pftrack.reproduce.fish.trials import TrainingClip, track_training_clips
from pftrack.reproduce.pool import Pool

__all__ = ["learn_from_tracks", "offline"]

SOURCE = "reference implementation, offline"
FIRST = 100
LEAST_TRACKED = 19

RMS = (1.4, 1.5, 0.047, 0.118)
RMS_TOLERANCE = (0.3, 0.3, 0.01, 0.02)
STEP_SD = (6.11, 5.99, 0.161, 0.199)
CHANGE_SD = (3.78, 3.13, 0.162, 0.200)
EIGENVALUES = (14.3, 9.8, 0.0575, 0.0062)
RELATIVE = 0.1
"""Of standard deviations; of variances it is twice that."""
CORRELATIONS = ((2, 3, -0.77), (1, 2, 0.29))
CORRELATION_TOLERANCE = 0.08
STROKE = (-0.59, 0.81)
"""Turn and bend of the third mode."""


def offline(pool: Pool, full: bool) -> list[Finding]:
    """Tracks that are learned from: how many hold, how exact they are, and what they teach."""
    if not full:
        return [
            not_run("fish-offline", "what is rare is learned from all ten clips, which take minutes, or not at all")
        ]
    found = track_training_clips(pool, FIRST)
    learned = learn_from_tracks(found)
    if pool.folder is not None:
        (pool.folder / "learned.json").write_text(learned.text, encoding="utf-8")
    return [*_judge_tracking(found, LEAST_TRACKED), *_exact(found), *_judge_learned(learned)]


def learn_from_tracks(found: list[TrainingClip]) -> Learned:
    """Return what tracks teach; those that were lost are left out, as a person would who looks at them."""
    pairs = [(track, held) for one in found for track, held in zip(one.tracks, one.tracked, strict=True)]
    return learn([track for track, held in pairs if held], FISH, GUIDANCE.experiment)


def _judge_tracking(found: list[TrainingClip], least: int) -> list[Finding]:
    tracked = sum(int(one.tracked.sum()) for one in found)
    result = f"fish-offline: tracks that hold, of {2 * len(found)} (at least {least})"
    return [claim(result, float(tracked), holds=tracked >= least, source=SOURCE)]


def _exact(found: list[TrainingClip]) -> list[Finding]:
    off = np.concatenate([(one.tracks - one.truths)[one.tracked].reshape(-1, 4) for one in found])
    off[:, 2] = np.remainder(off[:, 2] + np.pi, 2.0 * np.pi) - np.pi
    rms = np.sqrt(np.square(off).mean(axis=0))
    return [
        compare(f"fish-offline: rms error of {name}", float(ours), reference, tolerance, SOURCE, ground=CHOSEN)
        for name, ours, reference, tolerance in zip(FISH.names, rms, RMS, RMS_TOLERANCE, strict=True)
    ]


def _judge_learned(learned: Learned) -> list[Finding]:
    diffusion = learned.diffusion("document")
    findings = []
    for name, ours, reference in zip(FISH.names, learned.step_sd, STEP_SD, strict=True):
        result = f"fish-offline: standard deviation of the steps of {name}"
        findings.append(compare(result, ours, reference, RELATIVE * reference, SOURCE, ground=CHOSEN))
    for name, sd, reference in zip(FISH.change_names, diffusion.sd, CHANGE_SD, strict=True):
        result = f"fish-offline: standard deviation of {name}"
        findings.append(compare(result, float(sd), reference, RELATIVE * reference, SOURCE, ground=CHOSEN))
    for number, reference in enumerate(EIGENVALUES):
        ours = float(diffusion.eigenvalues[number])
        allowed = 2.0 * RELATIVE * reference
        findings.append(compare(f"fish-offline: lambda {number + 1}", ours, reference, allowed, SOURCE, ground=CHOSEN))
    for one, other, reference in CORRELATIONS:
        result = f"fish-offline: correlation of {FISH.change_names[one]} and {FISH.change_names[other]}"
        ours = float(diffusion.correlation[one, other])
        findings.append(compare(result, ours, reference, CORRELATION_TOLERANCE, SOURCE, ground=CHOSEN))
    stroke = diffusion.modes[2:, 2]
    for name, ours, reference in zip(("turn", "bend"), stroke, STROKE, strict=True):
        findings.append(
            compare(f"fish-offline: {name} of the third mode", float(ours), reference, 0.05, SOURCE, ground=CHOSEN)
        )
    built_in = GUIDANCE.parse("").diffusion("document").covariance
    apart = float(np.abs(diffusion.covariance - built_in).max())
    result = "fish-offline: the file that comes with the trackers is what is learned here (largest difference)"
    return [*findings, claim(result, apart, holds=apart < 1e-9, source=Own("this project"))]
