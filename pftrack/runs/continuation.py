"""Continuations: what becomes of many runs from a frame on, that differ in nothing but their seeds.

A run that is watched is one of many that might have been. Here they are computed together: those that see the same
pictures read them once, and a tracker that can takes many frames, or many seeds, at a time. The numbers are those of
live runs, to the bit: any of them can be opened as a branch (`Run.branch` with `seed` among the changes) or as a run of
that seed.

An ensemble is many runs with other seeds, and says of every frame which errors they have and what share of them still
holds the target. It shows whether a run is typical.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, tee
from time import thread_time
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.measures import judge_loss
from pftrack.core.model.recipe import Timeline
from pftrack.core.model.series import to_json
from pftrack.core.model.source import Frame, Source
from pftrack.core.model.tracker import EnsembleStep, Tracker, TrackState
from pftrack.core.numerics.random import LARGEST_SEED, Purpose, Stream
from pftrack.experiments.experiment import Experiment
from pftrack.runs.run import Run
from pftrack.runs.scoring import judge_estimates, judge_state

STRETCH_BYTES = 64 * 1024 * 1024
"""Pictures that are held at a time."""

Courses: TypeAlias = tuple[Floats, Floats]
"""Errors and verdicts (N, L) of N runs in L frames, as `Continuation` has those of one."""

SHORTEST_STRETCH, LONGEST_STRETCH = 4, 64
"""Frames that are held at a time: after so many, whoever waits is told how far it is. The first are soon there."""


class Stretch:
    """Consecutive frames of a source, read once for all runs that see them.

    Attributes:
        frames: The frames, by ascending index.
    """

    def __init__(self, frames: Sequence[Frame]) -> None:
        self.frames = tuple(frames)

    @property
    def first(self) -> int:
        """Index of the first frame."""
        return self.frames[0].index

    @property
    def end(self) -> int:
        """Index after the last frame."""
        return self.frames[-1].index + 1

    @property
    def nbytes(self) -> int:
        """How much memory the pictures take, bytes."""
        return sum(frame.image_rgb.nbytes for frame in self.frames if frame.image_rgb is not None)

    @cached_property
    def pictures_rgb(self) -> NDArray[np.uint8] | None:
        """The pictures (L, height, width, 3); None of a signal."""
        pictures = [frame.image_rgb for frame in self.frames if frame.image_rgb is not None]
        return np.stack(pictures) if len(pictures) == len(self.frames) else None


def read_stretches(source: Source[Any], timeline: Timeline, first: int, last: int) -> Iterator[Stretch]:
    """Read the frames first..last of a source, a few at first, and then as many at a time as may be held."""
    start, length = first, SHORTEST_STRETCH
    while start <= last:
        frame = source.frame(start, timeline.history)
        held = length
        if frame.image_rgb is not None:
            held = min(max(STRETCH_BYTES // frame.image_rgb.nbytes, 1), held)
        end = min(start + held - 1, last)
        frames = [frame, *(source.frame(index, timeline.history) for index in range(start + 1, end + 1))]
        yield Stretch(frames)
        start, length = end + 1, min(2 * length, LONGEST_STRETCH)


class Continuation:
    """A run that goes on with random numbers of its own, and what is kept of its frames.

    Attributes:
        seed: Of the tracker's random numbers.
        steps: How many steps were taken.
        seconds: Of processor time that they took: what waits for others costs no more.
    """

    def __init__(self, experiment: Experiment, timeline: Timeline, seed: int, state: TrackState) -> None:
        """Begin.

        Args:
            experiment: The wiring.
            timeline: Parameters and trackers in force; of its seeds none counts.
            seed: Of the random numbers from here on.
            state: Of the frame before the first to come.
        """
        self._experiment, self._timeline, self._state = experiment, timeline, state
        self.seed = seed
        self.steps, self.seconds = 0, 0.0
        self._errors: list[Floats] = []
        self._lost: list[Floats] = []
        self._truly_lost: list[Floats] = []

    @classmethod
    def start(
        cls,
        experiment: Experiment,
        source: Source[Any],
        timeline: Timeline,
        seed: int,
        stretch: Stretch,
    ) -> "Continuation":
        """Begin with frame 0, the first of a stretch, which is then the first that is kept."""
        tracker = experiment.trackers[timeline.tracker_at(0)]
        frame, parameters = stretch.frames[0], timeline.parameters_at(0)
        state = tracker.start(source.start, frame, parameters, Stream(seed, 0, Purpose.START))
        made = cls(experiment, timeline, seed, state)
        made._keep_state(tracker, frame, parameters)
        return made

    @property
    def state(self) -> TrackState:
        """Of the last frame."""
        return self._state

    @property
    def truly_lost(self) -> Floats:
        """(L,) the same by the truth alone; NaN where that is not known."""
        return np.concatenate([np.zeros(0), *self._truly_lost])

    @property
    def errors(self) -> Floats:
        """(L,) distances from the truth, in the experiment's unit; NaN where it is unknown."""
        return np.concatenate([np.zeros(0), *self._errors])

    @property
    def lost(self) -> Floats:
        """(L,) 1 where the target is lost, as `pftrack.core.model.measures` has it; NaN where nobody says."""
        return np.concatenate([np.zeros(0), *self._lost])

    def take(self, stretch: Stretch, first: int | None = None) -> None:
        """Track through the frames of a stretch, or through those from the frame `first` on."""
        begin = stretch.first if first is None else first
        changed = {segment.start for segment in self._timeline.segments}
        starts = sorted({begin} | {start for start in changed if begin < start < stretch.end})
        for start, end in zip(starts, [*starts[1:], stretch.end], strict=True):
            # Of the first step of all nobody knows which tracker, with which number of particles, left its state.
            alone = start in changed or not self.steps
            if alone:
                self._step(stretch, start, start + 1)
            if start + alone < end and not self._fold(stretch, start + alone, end):
                self._step(stretch, start + alone, end)

    def folds(self, index: int) -> bool:
        """Whether the tracker of a frame may take many at a time."""
        return self._tracker(index).fold is not None

    def _fold(self, stretch: Stretch, start: int, end: int) -> bool:
        """Take the frames start..end-1 at once, where that can be done; return whether it was."""
        tracker, parameters, experiment = self._tracker(start), self._timeline.parameters_at(start), self._experiment
        if tracker.fold is None or experiment.missed is not None or stretch.pictures_rgb is None:
            return False
        places = slice(start - stretch.first, end - stretch.first)
        if tracker.searching is not None and tracker.searching(self._state) is not None:
            return False  # its own account takes the states of all frames
        begun = thread_time()
        fold = tracker.fold(self._state, stretch.pictures_rgb[places], parameters, self.seed, start)
        if fold is None:
            return False
        self.seconds += thread_time() - begun
        self.steps += end - start
        self._state = fold.state
        errors, lost = judge_estimates(experiment, fold.estimates, stretch.frames[places], parameters)
        self._errors.append(errors)
        self._lost.append(lost)
        self._truly_lost.append(lost)
        return True

    def _step(self, stretch: Stretch, start: int, end: int) -> None:
        for index in range(start, end):
            tracker, parameters = self._tracker(index), self._timeline.parameters_at(index)
            frame = stretch.frames[index - stretch.first]
            begun = thread_time()
            self._state = tracker.step(self._state, frame, parameters, Stream(self.seed, index, Purpose.TRACK))
            self.seconds += thread_time() - begun
            self.steps += 1
            self._keep_state(tracker, frame, parameters)

    def _tracker(self, index: int) -> Tracker:
        return self._experiment.trackers[self._timeline.tracker_at(index)]

    def _keep_state(self, tracker: Tracker, frame: Frame, parameters: Any) -> None:  # noqa: ANN401 - the experiment's own model
        error, lost = judge_state(self._experiment, self._state, frame.target, parameters)
        searching = tracker.searching(self._state) if tracker.searching is not None else None
        self._errors.append(np.array([np.nan if error is None else error]))
        said = judge_loss(lost, searching).lost
        self._lost.append(np.array([np.nan if said is None else float(said)]))
        self._truly_lost.append(np.array([np.nan if lost is None else float(lost)]))


def go_on(
    experiment: Experiment,
    timeline: Timeline,
    seeds: Sequence[int],
    state: TrackState,
    stretches: Iterable[Stretch],
    *,
    first: int,
) -> Iterator[Courses]:
    """Let runs of many seeds go on from one state, and yield what came of each stretch.

    Args:
        experiment: The wiring.
        timeline: Parameters and trackers in force in all runs; of its seeds none counts.
        seeds: (N,) one a run.
        state: Of the frame before the first.
        stretches: The frames to come, which all runs see.
        first: Index of the first of them.
    """
    step = takes_all_at_once(experiment, timeline, first)
    if step is not None:
        yield from _go_on_together(step, experiment, timeline, seeds, state, stretches)
        return
    made = [Continuation(experiment, timeline, seed, state) for seed in seeds]
    for stretch in stretches:
        take_side_by_side(made, stretch)
        length = stretch.end - stretch.first
        yield np.stack([each.errors[-length:] for each in made]), np.stack([each.lost[-length:] for each in made])


def take_side_by_side(runs: Sequence[Continuation], stretch: Stretch) -> None:
    """Track runs of the same trackers through a stretch that all of them see.

    All take one frame after the other: what a tracker makes of a picture alone, and keeps for as long as that is the
    last one, is then made once for all runs. Where a tracker takes many frames at a time, one run follows the other.
    """
    folds = any(one.folds(index) for one in runs[:1] for index in range(stretch.first, stretch.end))
    for part in [stretch] if folds else [Stretch((frame,)) for frame in stretch.frames]:
        for one in runs:
            one.take(part)


def takes_all_at_once(experiment: Experiment, timeline: Timeline, first: int) -> EnsembleStep | None:
    """Return how a tracker takes all seeds at once from a frame on; None where that cannot be done."""
    names = {timeline.tracker_at(max(segment.start, first)) for segment in timeline.segments}
    tracker = experiment.trackers[timeline.tracker_at(first)]
    judged_by_estimates = experiment.missed is None and tracker.searching is None
    return tracker.ensemble if len(names) == 1 and judged_by_estimates else None


def _go_on_together(
    step: EnsembleStep,
    experiment: Experiment,
    timeline: Timeline,
    seeds: Sequence[int],
    state: TrackState,
    stretches: Iterable[Stretch],
) -> Iterator[Courses]:
    ahead, again = tee(stretches)
    frames = (frame for stretch in ahead for frame in stretch.frames)
    found = step(state, frames, timeline.history, seeds)

    def judge(frame: Frame) -> Courses:
        estimates = next(found)
        return judge_estimates(experiment, estimates, [frame] * len(estimates), timeline.parameters_at(frame.index))

    for stretch in again:
        errors, lost = zip(*map(judge, stretch.frames), strict=True)
        yield np.stack(errors, axis=1), np.stack(lost, axis=1)


RUNS = 40
ROUNDS = (10,)
"""So many runs are carried out to the end before all others begin: few are soon there, and show where it leads."""

QUANTILES = 0.1, 0.5, 0.9

Scene: TypeAlias = Literal["same", "other"]
"""Whether all runs see the scene of the run that they are compared with, or each the one that its own seed makes."""


class ReplayError(ValueError):
    """A run was only recorded, and cannot be carried out again."""


@dataclass(frozen=True)
class Ensemble:
    """What runs of the same settings with other seeds do, as far as they have come.

    Attributes:
        seeds: One a run.
        errors: (N, L) of the runs in frames 0..L-1, in the experiment's unit; NaN where the truth is unknown.
        lost: (N, L) 1 where a run has lost the target, else 0; NaN where nobody knows.
        computed: (L,) how many of the runs, the first of them, have come so far; of the others all is NaN.
        unit: Of the errors.
    """

    seeds: tuple[int, ...]
    errors: Floats
    lost: Floats
    computed: Ints
    unit: str

    @property
    def frames(self) -> int:
        """How many frames some runs have come so far."""
        return int(self.errors.shape[1])

    @cached_property
    def quantiles(self) -> Floats:
        """(3, L) errors below which 10, 50 and 90 % of the runs are; NaN where the truth is unknown.

        Each is an error of one of the runs: between two, one of which has no estimate at all, there is nothing.
        """
        ordered = np.sort(self.errors, axis=0)  # NaN come last: where the truth is unknown, those of all runs
        places = [np.maximum(np.ceil(share * self.computed).astype(np.int64) - 1, 0) for share in QUANTILES]
        return np.take_along_axis(ordered, np.stack(places), axis=0)

    @cached_property
    def holding(self) -> Floats:
        """(L,) share of the runs that have the target, 0..1; NaN where nobody knows."""
        has_come = np.arange(len(self.seeds))[:, None] < self.computed
        return np.asarray(1.0 - np.where(has_come, self.lost, 0.0).sum(axis=0) / self.computed, np.float64)

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values: a number that is not finite becomes None."""
        low, middle, high = (tuple(map(to_json, row.tolist())) for row in self.quantiles)
        return {
            "runs": len(self.seeds),
            "frames": self.frames,
            "computed": tuple(self.computed.tolist()),
            "unit": self.unit,
            "low": low,
            "middle": middle,
            "high": high,
            "holding": tuple(map(to_json, self.holding.tolist())),
        }


def check_not_replayed(run: Run, frame: int) -> None:
    """Refuse to carry out again what was only recorded.

    Args:
        run: The run.
        frame: From which on its tracker would be used again.

    Raises:
        ReplayError: Its tracker replays.
    """
    if run.experiment.trackers[run.tracker_at(frame)].replays:
        raise ReplayError(
            "it was computed elsewhere and is shown as it was recorded, so no seed and no setting changes it"
        )


def other_seeds(seed: int, count: int) -> tuple[int, ...]:
    """Return so many seeds, none of which is the one given: those that follow it."""
    return tuple((seed + 1 + number) % (LARGEST_SEED + 1) for number in range(count))


def ensemble(run: Run, *, runs: int = RUNS, frames: int | None = None, scene: Scene = "same") -> Ensemble:
    """Return what runs of a run's settings with other seeds do.

    Args:
        run: Its timeline is that of all.
        runs: How many, at least 1.
        frames: How far they go, at least 1; as far as the run is long, if not given.
        scene: What they see.

    Raises:
        ReplayError: The run is a recording of what was computed elsewhere.
        ValueError: There are no runs or frames, or there is no such scene.
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
    """Carry out the runs of an ensemble side by side, and yield what they have come to, again and again.

    On the same scene all begin in frame 0 as the run does, and draw random numbers of their own from then on.

    Args:
        run: The settings of all; it is left as it is.
        seeds: One a run.
        frames: How far they go, at least 1.
        scene: What they see; where a scene does not depend on the seed, "other" is different in frame 0 alone.
        rounds: Ascending: so many runs are carried out to the end before further ones begin.

    Raises:
        ReplayError: The run is a recording of what was computed elsewhere.
    """
    check_not_replayed(run, 0)
    stops = [*(each for each in rounds if each < len(seeds)), len(seeds)]
    parts: list[Courses] = []
    shared = _Shared(run, frames)
    for begin, end in pairwise([0, *stops]):
        group = seeds[begin:end]
        grown: list[Courses] = []
        other = scene == "other"
        for courses in _on_other_scenes(run, group, frames) if other else _on_the_same_scene(run, group, shared):
            grown.append(courses)
            errors, lost = (np.concatenate(each, axis=1) for each in zip(*grown, strict=True))
            yield _join([*parts, (errors, lost)], tuple(seeds), run.experiment.unit)
        parts.append((errors, lost))


def _join(parts: Sequence[Courses], seeds: tuple[int, ...], unit: str) -> Ensemble:
    """Return what runs come to, the first of which have come at least as far as those after them."""
    frames = parts[0][0].shape[1]
    errors, lost, computed = *np.full((2, len(seeds), frames), np.nan), np.zeros(frames, np.int64)
    begin = 0
    for some_errors, some_lost in parts:
        count, length = some_errors.shape
        errors[begin : begin + count, :length], lost[begin : begin + count, :length] = some_errors, some_lost
        computed[:length] += count
        begin += count
    return Ensemble(seeds, errors, lost, computed, unit)


class _Shared:
    """The frames of a scene for several rounds, the first by itself; kept where they are few."""

    def __init__(self, run: Run, frames: int) -> None:
        self._run, self._frames = run, frames
        self._kept: list[Stretch] | None = None

    def __iter__(self) -> Iterator[Stretch]:
        if self._kept is not None:
            yield from self._kept
            return
        read, held = [], 0
        for stretch in self._read():
            held += stretch.nbytes
            if held <= STRETCH_BYTES:
                read.append(stretch)
            yield stretch
        self._kept = read if held <= STRETCH_BYTES else None

    def _read(self) -> Iterator[Stretch]:
        source, timeline = self._run.source, self._run.timeline
        yield from read_stretches(source, timeline, 0, 0)
        yield from read_stretches(source, timeline, 1, self._frames - 1)


def _on_the_same_scene(run: Run, seeds: Sequence[int], shared: Iterable[Stretch]) -> Iterator[Courses]:
    """Go on with the seeds from frame 0 of a run, on what it sees."""
    experiment, timeline, stretches = run.experiment, run.timeline, iter(shared)
    begun = Continuation.start(experiment, run.source, timeline, run.seed, next(stretches))
    yield np.tile(begun.errors, (len(seeds), 1)), np.tile(begun.lost, (len(seeds), 1))
    yield from go_on(experiment, timeline, seeds, begun.state, stretches, first=1)


def _on_other_scenes(run: Run, seeds: Sequence[int], frames: int) -> Iterator[Courses]:
    """Begin a run with each of the seeds, on what it makes of the scene."""
    timeline = run.timeline
    opened = run.setup.open_source(seeds[0], timeline.parameters_at(0))
    sources = [run.setup.open_source(seed, timeline.parameters_at(0)) for seed in seeds] if opened.noisy else [opened]
    made: list[Continuation] = []
    for stretches in zip(*(read_stretches(source, timeline, 0, frames - 1) for source in sources), strict=True):
        for place, seed in enumerate(seeds):
            stretch, source = stretches[place % len(stretches)], sources[place % len(sources)]
            if place == len(made):
                made.append(Continuation.start(run.experiment, source, timeline, seed, stretch))
                made[place].take(stretch, 1)
            else:
                made[place].take(stretch)
        length = stretches[0].end - stretches[0].first
        yield np.stack([each.errors[-length:] for each in made]), np.stack([each.lost[-length:] for each in made])
