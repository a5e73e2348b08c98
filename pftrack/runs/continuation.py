"""Continuations: what becomes of many runs from a frame on, that differ in nothing but their seeds.

A run that is watched is one of many that might have been. Here they are computed together: those that see the same
pictures read them once, and a tracker that can takes many frames, or many seeds, at a time. The numbers are those of
live runs, to the bit: any of them can be opened as a branch (`Run.branch` with `seed` among the changes) or as a run of
that seed.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from itertools import tee
from time import thread_time
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.model.loss_witness import judge_loss
from pftrack.core.model.source import Source
from pftrack.core.model.timeline import Timeline
from pftrack.core.model.tracker import EnsembleStep, Tracker, TrackState
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.experiment import Experiment
from pftrack.runs.scoring import judge_estimates, judge_state

__all__ = [
    "STRETCH_BYTES",
    "Continuation",
    "Courses",
    "Stretch",
    "go_on",
    "read_stretches",
    "take_side_by_side",
    "takes_all_at_once",
]

STRETCH_BYTES = 64 * 1024 * 1024
"""Pictures that are held at a time."""

Courses: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64]]
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
        self._errors: list[NDArray[np.float64]] = []
        self._lost: list[NDArray[np.float64]] = []
        self._truly_lost: list[NDArray[np.float64]] = []

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
    def truly_lost(self) -> NDArray[np.float64]:
        """(L,) the same by the truth alone; NaN where that is not known."""
        return np.concatenate([np.zeros(0), *self._truly_lost])

    @property
    def errors(self) -> NDArray[np.float64]:
        """(L,) distances from the truth, in the experiment's unit; NaN where it is unknown."""
        return np.concatenate([np.zeros(0), *self._errors])

    @property
    def lost(self) -> NDArray[np.float64]:
        """(L,) 1 where the target is lost, as `pftrack.core.model.loss_witness` has it; NaN where nobody says."""
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
