"""Other seeds: many runs of the same settings that differ only in their seeds.

A run is one of many possible ones. For every frame, an ensemble gives their errors and the share that still holds the
target; it shows whether a run is typical. Any of its runs can be opened as a branch (`Run.branch` with `seed` among the
changes) or as a run of that seed, with the same numbers to the bit.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, tee
from typing import Literal, TypeAlias, get_args

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.recipe import Timeline
from pftrack.core.model.series import Known
from pftrack.core.model.tracker import EnsembleStep, TrackState
from pftrack.core.numerics.random import LARGEST_SEED
from pftrack.core.refusal import RefusedError
from pftrack.runs.loss import judge_estimates
from pftrack.runs.many import FrameBlock, KeptFrames, Losses, Trial, read_blocks
from pftrack.runs.run import Run

RUNS = 40
ROUNDS = (10,)
"""Number of runs that are completed before all others begin: a few finish soon and give a first result."""

QUANTILES = 0.1, 0.5, 0.9

Scene: TypeAlias = Literal["same", "other"]
"""Whether all runs see the scene of the run that they are compared with, or each the one that its own seed makes."""


@dataclass(frozen=True, slots=True)
class Bands:
    """Results of runs with other seeds, frame by frame, as far as computed.

    Attributes:
        runs: Number of runs.
        frames: Number of frames computed so far in some of them.
        computed: Number of runs that have reached each frame so far.
        unit: Unit of the errors.
        low: Error below which 10 % of the runs are, by frame.
        middle: Below which 50 % are.
        high: Below which 90 % are.
        holding: Share of the runs that have the target, by frame.
    """

    runs: int
    frames: int
    computed: tuple[int, ...]
    unit: str
    low: tuple[Known, ...]
    middle: tuple[Known, ...]
    high: tuple[Known, ...]
    holding: tuple[Known, ...]


@dataclass(frozen=True)
class Ensemble:
    """Runs of the same settings with other seeds, as far as computed.

    Attributes:
        seeds: One a run.
        errors: (N, L) of the runs in frames 0..L-1, in the experiment's unit; NaN where the truth is unknown.
        lost: (N, L) 1 where a run has lost the target, else 0; NaN where unknown.
        computed: (L,) number of runs that have reached the frame; they are the first ones, and all others are NaN.
        unit: Unit of the errors.
    """

    seeds: tuple[int, ...]
    errors: Floats
    lost: Floats
    computed: Ints
    unit: str

    @property
    def frames(self) -> int:
        """Number of frames computed so far in some runs."""
        return int(self.errors.shape[1])

    @cached_property
    def quantiles(self) -> Floats:
        """(3, L) errors below which 10, 50 and 90 % of the runs are; NaN where the truth is unknown.

        Each is the error of one run; nothing is interpolated towards a run without an estimate.
        """
        ordered = np.sort(self.errors, axis=0)  # NaN come last: where the truth is unknown, those of all runs
        places = [np.maximum(np.ceil(share * self.computed).astype(np.int64) - 1, 0) for share in QUANTILES]
        return np.take_along_axis(ordered, np.stack(places), axis=0)

    @cached_property
    def holding(self) -> Floats:
        """(L,) share of the runs that have the target, 0..1; NaN where unknown."""
        has_come = np.arange(len(self.seeds))[:, None] < self.computed
        return np.asarray(1.0 - np.where(has_come, self.lost, 0.0).sum(axis=0) / self.computed, np.float64)

    @property
    def bands(self) -> Bands:
        """The range of most runs in each frame."""
        low, middle, high = (tuple(row) for row in self.quantiles.tolist())
        computed, holding = tuple(self.computed.tolist()), tuple(self.holding.tolist())
        return Bands(len(self.seeds), self.frames, computed, self.unit, low, middle, high, holding)


def check_not_replayed(run: Run, frame: int) -> None:
    """Refuse to carry out again what was only recorded.

    Args:
        run: The run.
        frame: From which on its tracker would be used again.

    Raises:
        RefusedError: Its tracker replays.
    """
    if run.experiment.trackers[run.tracker_at(frame)].replays:
        raise RefusedError(
            "it was computed elsewhere and is shown as it was recorded, so no seed and no setting changes it"
        )


def other_seeds(seed: int, count: int) -> tuple[int, ...]:
    """Return the seeds that follow the one given, so many."""
    return tuple((seed + 1 + number) % (LARGEST_SEED + 1) for number in range(count))


def ensemble(run: Run, *, runs: int = RUNS, frames: int | None = None, scene: Scene = "same") -> Ensemble:
    """Return what runs of a run's settings with other seeds do.

    Args:
        run: Its timeline is that of all.
        runs: Number of runs, at least 1.
        frames: Their length, at least 1; by default that of the run.
        scene: The scene that they see.

    Raises:
        RefusedError: The run is a recording of what was computed elsewhere.
        ValueError: There are no runs or frames, or the scene is unknown.
    """
    length = run.frames if frames is None else frames
    for name, given in (("runs", runs), ("frames", length)):
        if given < 1:
            raise ValueError(f"{name} must be at least 1, got {given}")
    if scene not in get_args(Scene):
        raise ValueError(f"scene must be one of {', '.join(get_args(Scene))}, got {scene}")
    *_, last = ensembling(run, other_seeds(run.seed, runs), length, scene=scene)
    return last


def ensembling(
    run: Run, seeds: Sequence[int], frames: int, *, scene: Scene = "same", rounds: Sequence[int] = ROUNDS
) -> Iterator[Ensemble]:
    """Compute the runs of an ensemble side by side, and repeatedly yield the results so far.

    On the same scene all begin in frame 0 like the run, and draw their own random numbers from then on.

    Args:
        run: The settings of all; it is left as it is.
        seeds: One a run.
        frames: Their length, at least 1.
        scene: The scene that they see; if a scene does not depend on the seed, "other" differs only in frame 0.
        rounds: Ascending: so many runs are carried out to the end before further ones begin.

    Raises:
        RefusedError: The run is a recording of what was computed elsewhere.
    """
    check_not_replayed(run, 0)
    stops = [*(each for each in rounds if each < len(seeds)), len(seeds)]
    parts: list[Losses] = []
    shared = KeptFrames(run.source, run.timeline.history, frames)
    for begin, end in pairwise([0, *stops]):
        group = seeds[begin:end]
        grown: list[Losses] = []
        other = scene == "other"
        for found in _on_other_scenes(run, group, frames) if other else _on_the_same_scene(run, group, shared, frames):
            grown.append(found)
            errors, lost = (np.concatenate(each, axis=1) for each in zip(*grown, strict=True))
            yield _join([*parts, (errors, lost)], tuple(seeds), run.experiment.judge.unit)
        parts.append((errors, lost))


def _join(parts: Sequence[Losses], seeds: tuple[int, ...], unit: str) -> Ensemble:
    """Join what groups of runs have computed; earlier groups have at least as many frames as later ones."""
    frames = parts[0][0].shape[1]
    errors, lost, computed = *np.full((2, len(seeds), frames), np.nan), np.zeros(frames, np.int64)
    begin = 0
    for some_errors, some_lost in parts:
        count, length = some_errors.shape
        errors[begin : begin + count, :length], lost[begin : begin + count, :length] = some_errors, some_lost
        computed[:length] += count
        begin += count
    return Ensemble(seeds, errors, lost, computed, unit)


def _on_the_same_scene(run: Run, seeds: Sequence[int], shared: KeptFrames, frames: int) -> Iterator[Losses]:
    """Continue with the seeds from frame 0 of a run, on what it sees."""
    begun, history = Trial(run.experiment, shared, run.timeline, run.seed), run.timeline.history
    (first,) = read_blocks(shared, history, 0, 0)
    begun.take(first)
    errors, lost = _newest([begun], first)
    yield np.tile(errors, (len(seeds), 1)), np.tile(lost, (len(seeds), 1))
    blocks = read_blocks(shared, history, 1, frames - 1)
    yield from go_on(run, run.timeline, seeds, begun.state, blocks, 1)


def _on_other_scenes(run: Run, seeds: Sequence[int], frames: int) -> Iterator[Losses]:
    """Begin a run with each of the seeds, on its version of the scene."""
    timeline = run.timeline
    opened = run.setup.open_source(seeds[0], timeline.parameters_at(0))
    sources = [run.setup.open_source(seed, timeline.parameters_at(0)) for seed in seeds] if opened.noisy else [opened]
    trials = [Trial(run.experiment, sources[place % len(sources)], timeline, seed) for place, seed in enumerate(seeds)]
    for blocks in zip(*(read_blocks(source, timeline.history, 0, frames - 1) for source in sources), strict=True):
        for place, trial in enumerate(trials):
            trial.take(blocks[place % len(blocks)])
        yield _newest(trials, blocks[0])


def go_on(
    run: Run, timeline: Timeline, seeds: Sequence[int], state: TrackState, blocks: Iterable[FrameBlock], first: int
) -> Iterator[Losses]:
    """Continue with many seeds from one state, and yield what came of each block.

    Args:
        run: Whose wiring and source all have.
        timeline: Parameters and trackers in force in all runs; its seeds do not count.
        seeds: (N,) one a run.
        state: State of the frame before the first.
        blocks: The frames to come.
        first: Index of the first of them.
    """
    step, experiment = takes_all_at_once(run, timeline, first), run.experiment
    if step is None:
        trials = [Trial(experiment, run.source, timeline, seed, state) for seed in seeds]
        for block in blocks:
            _take_side_by_side(trials, block)
            yield _newest(trials, block)
        return
    ahead, again = tee(blocks)
    found = step(state, (frame for block in ahead for frame in block.frames), timeline.history, seeds)
    same = np.zeros(len(seeds), np.intp)
    for block in again:
        judged = [
            judge_estimates(experiment, next(found), block.truths.at(same + place), timeline.parameters_at(frame.index))
            for place, frame in enumerate(block.frames)
        ]
        errors, lost = zip(*judged, strict=True)
        yield np.stack(errors, axis=1), np.stack(lost, axis=1)


def _newest(trials: Sequence[Trial], block: FrameBlock) -> Losses:
    """Return errors and verdicts of trials in the block that they took last."""
    length = block.end - block.first
    return np.stack([each.errors[-length:] for each in trials]), np.stack([each.lost[-length:] for each in trials])


def _take_side_by_side(trials: Sequence[Trial], block: FrameBlock) -> None:
    """Track runs of the same trackers through a block that all of them see.

    All runs advance frame by frame: values that a tracker computes from a picture alone, and caches for the last
    picture, are then computed once for all runs. Where a tracker takes many frames at a time, one run follows the
    other.
    """
    folds = any(one.folds(index) for one in trials[:1] for index in range(block.first, block.end))
    for part in [block] if folds else [FrameBlock((frame,), 1, block.width) for frame in block.frames]:
        for one in trials:
            one.take(part)


def takes_all_at_once(run: Run, timeline: Timeline, first: int) -> EnsembleStep | None:
    """Return how a tracker takes all seeds at once from a frame on; None where that cannot be done."""
    names = {timeline.tracker_at(max(segment.start, first)) for segment in timeline.segments}
    tracker = run.experiment.trackers[timeline.tracker_at(first)]
    moved = any(segment.moves for segment in timeline.segments if segment.start >= first)
    judged_by_estimates = run.experiment.judge.missed is None and tracker.searching is None
    return tracker.ensemble if len(names) == 1 and judged_by_estimates and not moved else None
