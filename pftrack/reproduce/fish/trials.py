"""Runs of the study of a fish: whole clips, both fish of each, with the edges of every frame looked for once.

A run is what a session computes, step for step; only the pictures and their edges are shared by all runs of a clip.
"""

from dataclasses import dataclass
from time import process_time
from typing import Any, NamedTuple

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.source import History
from pftrack.experiments import find
from pftrack.experiments.fish.model import Edges
from pftrack.experiments.fish.scene import FishSource, FishTarget
from pftrack.experiments.fish.step import MOTIONS, begin_at, find_edges, step_frame
from pftrack.experiments.fish.swimming import FRAMES, TankName, clip
from pftrack.experiments.fish.trackers import FISH, GUIDANCE
from pftrack.filters.learning.diffusion import Learned, learn
from pftrack.reproduce.finding import CHOSEN, Finding, Own, claim, compare, not_run
from pftrack.reproduce.pool import Pool

FISHES = 2
"""In each clip."""

LESSONS, LIVELY_LESSONS, TESTS, LIVELY_TESTS = 10, 8, 12, 9
OFFLINE: dict[str, Value] = {"sample_count": 3000, "walk_steps": "wide"}


class Clip(NamedTuple):
    """A clip of two fish: its number, whether the first of them is lively, and the tank."""

    number: int
    lively: bool
    tank: TankName = "goldfish"


class Condition(NamedTuple):
    """A tracker with the values of parameters that differ from the defaults."""

    tracker: str
    values: tuple[tuple[str, Value], ...]


@dataclass(frozen=True)
class TrainingClip:
    """What comes of a clip that is learned from: tracks and truths (fish, FRAMES, 4), and which fish were tracked."""

    tracks: Floats
    truths: Floats
    tracked: Bools


class Outcome(NamedTuple):
    """Successes (fish, runs) of a condition on a clip, and processor time of a frame of the filter alone, ms."""

    successes: Bools
    frame_ms: float


def track_training_clip(shown: Clip) -> TrainingClip:
    """Follow both fish of a clip with the offline filter."""
    parameters, edges, targets = _prepare(shown)
    offline = revise(parameters, OFFLINE)
    tracks, truths = np.empty((FISHES, FRAMES, 4)), np.empty((FISHES, FRAMES, 4))
    tracked = np.ones(FISHES, np.bool_)
    for fish in range(FISHES):
        state = begin_at(targets[fish][0], 3000)
        for frame, target in enumerate(targets[fish]):
            if frame > 0:
                state = step_frame(MOTIONS["ordinary"], state, edges[frame], offline, shown.number, frame)
            tracks[fish, frame], truths[fish, frame] = state.pose, target.pose
            tracked[fish] &= target.holds(state.estimate)
    return TrainingClip(tracks, truths, tracked)


def track_training_clips(pool: Pool, first: int, tank: TankName = "goldfish") -> list[TrainingClip]:
    """Return what comes of the ten clips that are learned from, the first of which has this number."""
    return pool.map(track_training_clip, [Clip(first + i, i < LIVELY_LESSONS, tank) for i in range(LESSONS)])


def learn_from_truth(first: int) -> Learned:
    """Return what the true motion in these clips teaches, without the noise of estimates."""
    clips = [clip(first + i, FISHES, i < LIVELY_LESSONS, "goldfish") for i in range(LESSONS)]
    return learn([poses[:, fish] for poses in clips for fish in range(FISHES)], FISH, "fish")


def follow(work: tuple[Clip, tuple[Condition, ...], int]) -> list[Outcome]:
    """Follow both fish of a clip under several conditions, a number of runs each."""
    shown, conditions, runs = work
    parameters, edges, targets = _prepare(shown)
    outcomes = []
    for condition in conditions:
        revised = revise(parameters, dict(condition.values))
        found, frames, began = np.ones((FISHES, runs), np.bool_), 0, process_time()
        for fish in range(FISHES):
            for run in range(runs):
                seed = 10_000 * run + FISHES * shown.number + fish
                state = begin_at(targets[fish][0], revised.sample_count)
                for frame in range(1, FRAMES):
                    state = step_frame(MOTIONS[condition.tracker], state, edges[frame], revised, seed, frame)
                    frames += 1
                    if not targets[fish][frame].holds(state.estimate):
                        found[fish, run] = False
                        break
        outcomes.append(Outcome(found, 1e3 * (process_time() - began) / frames))
    return outcomes


def edge_ms(shown: Clip, frames: int = 30) -> float:
    """Return the processor time of finding the edges of a frame, ms."""
    parameters: Any = revise(find("fish").simulate().parameters, {"tank_number": shown.number, "lively": shown.lively})
    source, history = FishSource(0, parameters), History(((0, parameters),))
    pictures = [source.frame(frame, history) for frame in range(frames)]
    began = process_time()
    for picture in pictures:
        find_edges(picture, parameters)
    return 1e3 * (process_time() - began) / frames


class Successes(NamedTuple):
    """Of 24 fish, the mean over the runs: all of them, the nine that turn sharply, and ms of a frame's filter."""

    fish: float
    sharp: float
    frame_ms: float


def successes(
    pool: Pool, first: int, conditions: list[Condition], runs: int, tank: TankName = "goldfish", every: int = 1
) -> dict[Condition, Successes]:
    """Return the successes of each condition on the twelve clips, the first of which has this number.

    Args:
        pool: That computes.
        first: Number of the first clip.
        conditions: Trackers with their values.
        runs: Of each condition on each fish.
        tank: The tank.
        every: Of the clips; from fewer, successes are told as of all.
    """
    clips = [Clip(first + i, i < LIVELY_TESTS, tank) for i in range(0, TESTS, every)]
    lively = sum(shown.lively for shown in clips)
    by_clip = pool.map(follow, [(shown, tuple(conditions), runs) for shown in clips])
    found = {}
    for place, condition in enumerate(conditions):
        table = np.array([outcomes[place].successes for outcomes in by_clip])
        sharp = table[:lively, 0]
        found[condition] = Successes(
            float(table.sum() / runs * TESTS / len(clips)),
            float(sharp.sum() / runs * LIVELY_TESTS / lively),
            float(np.mean([outcomes[place].frame_ms for outcomes in by_clip])),
        )
    return found


def _prepare(shown: Clip) -> tuple[Any, list[Edges], list[list[FishTarget]]]:
    """Return the parameters of a clip, the edges of each frame, and the truth of each fish in each frame."""
    parameters: Any = revise(
        find("fish").simulate().parameters,
        {"tank_number": shown.number, "lively": shown.lively, "tank": shown.tank},
    )
    history = History(((0, parameters),))
    sources = [FishSource(0, revise(parameters, {"followed_fish": fish + 1})) for fish in range(FISHES)]
    edges = [find_edges(sources[0].frame(frame, history), parameters) for frame in range(FRAMES)]
    targets = [[source.target(frame, parameters) for frame in range(FRAMES)] for source in sources]
    return parameters, edges, targets


# Offline, ten clips are followed by the ordinary filter with 3,000 particles and wide noise (Mitsugami et al. 2009,
# eqs. 10 to 15). `pftrack reproduce fish-offline --full --figures FOLDER` writes what was learned to
# FOLDER/learned.json; it is the file that comes with the trackers, `pftrack/experiments/fish/learned.json`, and here it
# is compared with that.

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
