"""Runs of the study of a fish: whole clips, both fish of each, with the edges of every frame looked for once.

A run is what a session computes, step for step; only the pictures and their edges are shared by all runs of a clip.
"""

from dataclasses import dataclass
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.source import History
from pftrack.experiments import find
from pftrack.experiments.fish.scene import FishSource, FishTarget
from pftrack.experiments.fish.scene.edge_distance import Edges
from pftrack.experiments.fish.scene.swimming import FRAMES, TankName, clip
from pftrack.experiments.fish.trackers.learned import FISH
from pftrack.experiments.fish.trackers.step import MOTIONS, begin_at, find_edges, step_frame
from pftrack.filters.learning.diffusion import Learned, learn
from pftrack.reproduce.pool import Pool

__all__ = [
    "FISHES",
    "Clip",
    "Condition",
    "Outcome",
    "Successes",
    "TrainingClip",
    "edge_ms",
    "follow",
    "learn_from_truth",
    "successes",
    "track_training_clip",
    "track_training_clips",
]

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

    tracks: NDArray[np.float64]
    truths: NDArray[np.float64]
    tracked: NDArray[np.bool_]


class Outcome(NamedTuple):
    """Successes (fish, runs) of a condition on a clip, and processor time of a frame of the filter alone, ms."""

    successes: NDArray[np.bool_]
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
