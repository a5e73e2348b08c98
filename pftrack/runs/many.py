"""Many runs at once: runs on shared frames, computed for their results and not for viewing.

Sweeps, *What if*, other seeds, fits and studies use them. Their numbers equal those of a live run (`Run`) bit for bit,
so that any of them can be opened and stepped through. They are faster for three reasons: runs on the same pictures read
them once, some trackers compute many frames or seeds at a time, and only requested results are kept.

- `outcomes` computes all runs of one condition and returns their results;
- `side_by_side` steps complete runs together, for records of any frame;
- a `Trial` is one run without its past, from frame 0 or from a state of another run.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import chain, pairwise
from time import thread_time
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.measures import EvaluatedRun, Measure, evaluate, judge_loss
from pftrack.core.model.parameters import Parameters, Value, revise
from pftrack.core.model.recipe import Change, Timeline
from pftrack.core.model.series import reduce
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, History, Source
from pftrack.core.model.tracker import Tracker, TrackState
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.experiment import Experiment
from pftrack.runs.loss import Loss, Truths, judge_estimates, judge_state
from pftrack.runs.loss_probability import measure_loss_probability
from pftrack.runs.run import Run
from pftrack.runs.scoring import Verdict, allowed_loss, estimates_hash, evaluated_run, extent_series, judge, reductions

BLOCK_BYTES = 64 * 2**20
"""Memory for pictures, bytes; sixty pictures of Bando's scene take a quarter of it."""

SHORTEST_BLOCK, LONGEST_BLOCK = 4, 64
"""Fewest and most frames in a block; blocks start short so that first results come early."""

MOST_SIDE_BY_SIDE = 16
"""Most runs whose complete past is kept at the same time."""

Losses: TypeAlias = tuple[Floats, Floats]
"""Errors and verdicts (N, L) of N runs in L frames; `Trial` holds those of one run."""


class FrameBlock:
    """Consecutive frames of a source, read once for all runs on them.

    Attributes:
        frames: The frames in ascending order.
        width: Number of coordinates of a position.
        pictures_rgb: The pictures (L, height, width, 3); None for a signal.
    """

    def __init__(self, frames: Iterable[Frame], count: int, width: int) -> None:
        """Read `count` frames and store their pictures in one array; a single picture is not copied."""
        self.width = width
        self.pictures_rgb: NDArray[np.uint8] | None = None
        kept = []
        for place, frame in enumerate(frames):
            picture = frame.image_rgb
            if picture is None or count == 1:
                self.pictures_rgb = None if picture is None else picture[None]
                kept.append(frame)
                continue
            if self.pictures_rgb is None:
                self.pictures_rgb = np.empty((count, *picture.shape), np.uint8)
            self.pictures_rgb[place] = picture
            kept.append(replace(frame, image_rgb=read_only(self.pictures_rgb[place])))
        self.frames = tuple(kept)

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
        """Memory that the pictures take, bytes."""
        return sum(map(_picture_bytes, self.frames))

    @cached_property
    def truths(self) -> Truths:
        """The truth of the frames."""
        length = len(self.frames)
        found = Truths(np.full((length, self.width), np.nan), np.zeros(length), np.full((length, 2), np.nan))
        for place, frame in enumerate(self.frames):
            if frame.target is not None:
                found.positions[place], found.sizes[place] = frame.target.position, frame.target.size
                found.extents[place] = frame.target.extent or np.nan
        return found


def read_blocks(
    source: Source[Any], history: History[Any], first: int, last: int, *, shortest: int = SHORTEST_BLOCK
) -> Iterator[FrameBlock]:
    """Yield the frames first..last of a source in blocks, short ones first, then as long as memory allows."""
    start, length, width = first, shortest, len(source.start.position)
    while start <= last:
        frame = source.frame(start, history)
        held = length
        if frame.image_rgb is not None:
            held = min(max(BLOCK_BYTES // frame.image_rgb.nbytes, 1), held)
        end = min(start + held - 1, last)
        later = (source.frame(index, history) for index in range(start + 1, end + 1))
        yield FrameBlock(chain([frame], later), end + 1 - start, width)
        start, length = end + 1, max(length, min(2 * length, LONGEST_BLOCK))


class KeptFrames:
    """A source that makes each frame once and keeps as many as memory allows; parameters do not change them later.

    So runs with different tracker parameters see the same frames, and a recording is decoded once.
    """

    noisy = False

    def __init__(
        self, source: Source[Any], history: History[Any], frames: int | None = None, most_bytes: int = BLOCK_BYTES
    ) -> None:
        """Begin with no frame.

        Args:
            source: Source of the frames.
            history: Parameters of the source.
            frames: Number of frames (default: all frames of the source).
            most_bytes: Memory for pictures besides the newest one.
        """
        self.size, self.frame_rate_hz, self.start = source.size, source.frame_rate_hz, source.start
        self.frame_count = source.frame_count if frames is None else frames
        self._source, self._history = source, history
        self._kept: dict[int, Frame] = {}
        self._last: Frame | None = None
        self._left = most_bytes

    def frame(self, index: int, history: History[Any]) -> Frame:
        """Return a frame; the given parameters have no effect."""
        del history
        if self._last is not None and self._last.index == index:
            return self._last
        found = self._kept.get(index)
        if found is None:
            found = self._last = self._source.frame(index, self._history)
            if _picture_bytes(found) <= self._left:
                self._kept[index] = found
                self._left -= _picture_bytes(found)
        return found


def _picture_bytes(frame: Frame) -> int:
    return 0 if frame.image_rgb is None else frame.image_rgb.nbytes


class Trial:
    """One of many runs: its current state, and only estimates, errors and losses of earlier frames.

    Attributes:
        seed: Random seed of the tracker.
        state: State of the last frame; None before frame 0.
        steps: Number of steps taken.
        seconds: Processor time of these steps, s; waiting for other work does not count.
    """

    def __init__(
        self,
        experiment: Experiment,
        source: Source[Any],
        timeline: Timeline,
        seed: int,
        state: TrackState | None = None,
    ) -> None:
        """Begin.

        Args:
            experiment: The wiring.
            source: The source; only its start is used, since the frames are given.
            timeline: Parameters and trackers in force; its seeds are not used.
            seed: Random seed from here on.
            state: State of the frame before the first new one; None to begin with frame 0.
        """
        self._experiment, self._source, self._timeline = experiment, source, timeline
        self.seed = seed
        self.state: Any = state  # of the kind that the tracker's family has
        self.steps, self.seconds = 0, 0.0
        self._settled = False
        self._begun: Floats | None = None
        self._extent = np.full((1, 2), np.nan)
        self._kept: list[tuple[Floats, Floats, Floats, Floats]] = []
        self._columns: dict[str, list[Floats]] = {}

    @property
    def estimates(self) -> Floats:
        """(L, d) posterior means."""
        return self._join(0)

    @property
    def errors(self) -> Floats:
        """(L,) distances from the truth, in the experiment's unit; NaN where it is unknown."""
        return self._join(1)

    @property
    def lost(self) -> Floats:
        """(L,) 1 where the target is lost by `pftrack.core.model.measures`; NaN where nobody judges."""
        return self._join(2)

    @property
    def truly_lost(self) -> Floats:
        """(L,) 1 where the target is lost by the truth; NaN where the truth is unknown."""
        return self._join(3)

    def course(self, truths: Truths) -> EvaluatedRun:
        """Return the run with its truth; all frames must have come by `fold`."""
        scale, lost = self._experiment.judge.scale, self.truly_lost == 1.0
        return EvaluatedRun(
            scale * self.estimates,
            scale * truths.positions,
            self.errors,
            lost if self._experiment.judge.has_loss else None,
            truths.extents,
            self._believed_sizes(truths),
        )

    @property
    def loss(self) -> Loss:
        """Losses by the truth; all frames must have come by `fold`."""
        truly = self.truly_lost
        return Loss(truly == 1.0, tuple("" if unknown else "truth" for unknown in np.isnan(truly)))

    def reductions(self) -> Mapping[str, float | int | None]:
        """Return the reductions of the tracker's series; all frames must have come by `fold`."""
        kept: dict[str, float | int | None] = {}
        for series in self._tracker(0).series:
            if series.reductions:
                kept |= reduce(series, np.concatenate(self._columns.get(series.name, [np.zeros(0)])))
        return kept

    def _believed_sizes(self, truths: Truths) -> Floats:
        """Return the sizes that the tracker estimates, (L, 2) px; NaN for a tracker without a size."""
        name = extent_series(self._tracker(0).series)
        later = self._columns.get(name, []) if name else []
        return np.concatenate([self._extent, *later]) if later else np.tile(self._extent, (len(truths.sizes), 1))

    def take(self, block: FrameBlock) -> None:
        """Track through the frames of a block."""
        changed = {segment.start for segment in self._timeline.segments}
        edges = sorted({block.first, block.end} | {start for start in changed if block.first < start < block.end})
        for start, end in pairwise(edges):
            # It is unknown which tracker, with which number of particles, left the state before these frames.
            alone = start in changed or not self._settled
            if alone:
                self._step(block, start)
            if start + alone < end and not self._fold(block, start + alone, end):
                for index in range(start + alone, end):
                    self._step(block, index)

    def begin(self, frame: Frame) -> None:
        """Begin with frame 0, for `fold`."""
        tracker, self.state = self._tracker(0), self._start(frame)
        self._begun = self.state.estimate[None].copy()
        name = extent_series(tracker.series)
        if name and (extent := tracker.measure(self.state).get(name)):
            self._extent = np.array([extent], np.float64)

    def fold(self, block: FrameBlock) -> bool:
        """Track through a block with one tracker and set of parameters at once; return whether it was possible."""
        begun = [self._begun] if block.first == 0 and self._begun is not None else []
        return self._fold(block, block.first + len(begun), block.end, begun)

    def folds(self, index: int) -> bool:
        """Whether the tracker of a frame may process many frames at a time."""
        return self._tracker(index).fold is not None

    def _fold(self, block: FrameBlock, start: int, end: int, begun: Sequence[Floats] = ()) -> bool:
        """Process the frames start..end-1 at once, after those begun; return whether it was possible."""
        tracker, parameters, experiment = self._tracker(start), self._timeline.parameters_at(start), self._experiment
        if tracker.fold is None or experiment.judge.missed is not None or block.pictures_rgb is None:
            return False
        truths = block.truths.at(slice(start - len(begun) - block.first, end - block.first))
        known = np.isfinite(truths.positions).all()
        if not known and tracker.searching is not None and tracker.searching(self.state) is not None:
            return False  # without a truth the tracker's own report judges, and it needs the states of all frames
        estimates = list(begun)
        if start < end:
            clock = thread_time()
            pictures = block.pictures_rgb[start - block.first : end - block.first]
            fold = tracker.fold(self.state, pictures, parameters, self.seed, start)
            if fold is None:
                return False
            self.seconds += thread_time() - clock
            self.steps += end - start
            self.state = fold.state
            estimates.append(fold.estimates)
            for name, column in fold.series.items():
                self._columns.setdefault(name, []).append(column)
        joined = np.concatenate(estimates)
        errors, lost = judge_estimates(experiment, joined, truths, parameters)
        self._kept.append((joined, errors, lost, lost))
        return True

    def _start(self, frame: Frame) -> TrackState:
        tracker, parameters = self._tracker(0), self._timeline.parameters_at(0)
        return tracker.start(self._source.start, frame, parameters, Stream(self.seed, 0, Purpose.START))

    def _step(self, block: FrameBlock, index: int) -> None:
        tracker, parameters = self._tracker(index), self._timeline.parameters_at(index)
        frame = block.frames[index - block.first]
        if self.state is None:
            self.state = self._start(frame)
        else:
            before = self.state
            if moves := self._timeline.moves_at(index):
                before = self._tracker(index - 1).moved(before, moves)
            clock = thread_time()
            self.state = tracker.step(before, frame, parameters, Stream(self.seed, index, Purpose.TRACK))
            self.seconds += thread_time() - clock
            self.steps += 1
        self._settled = True
        error, lost = judge_state(self._experiment, self.state, frame.target, parameters)
        searching = tracker.searching(self.state) if tracker.searching is not None else None
        said = (error, judge_loss(lost, searching).lost, lost)
        errors, losses, truly = (np.array([np.nan if it is None else float(it)]) for it in said)
        self._kept.append((self.state.estimate[None], errors, losses, truly))

    def _join(self, which: int) -> Floats:
        parts = [kept[which] for kept in self._kept] or [np.zeros(0)]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def _tracker(self, index: int) -> Tracker:
        return self._experiment.trackers[self._timeline.tracker_at(index)]


# ---------------------------------------------------------------- whole runs


def side_by_side(
    experiment: Experiment,
    setup: Setup,
    cases: Sequence[tuple[str, int]],
    *,
    changes: Sequence[Change] = (),
    frames: int | None = None,
    watch: Callable[[Run], bool | None] = lambda _: None,
) -> Iterator[Run]:
    """Compute complete runs with the same parameters, and yield each at its end.

    Runs on the same frames (all runs if the source has no noise) process each frame together.

    Args:
        experiment: The wiring.
        setup: The source.
        cases: Name of the tracker and seed of each run; runs with the same seed are neighbours.
        changes: Parameter changes in ascending order of frames.
        frames: Length of a run, as for `Run`; a run ends with a shorter source.
        watch: Called with a run at each of its frames, to read its state; the run ends when it returns True.

    Raises:
        ParameterError: A value is unknown, out of bounds or at odds with another.
    """
    timeline = Timeline.begin(setup.parameters, experiment.default_tracker, tuple(experiment.trackers), changes)
    source, opened = setup.open_source(cases[0][1], timeline.parameters_at(0)), cases[0][1]
    noisy = source.noisy
    if not noisy and not isinstance(source, KeptFrames):
        source = KeptFrames(source, timeline.history)
    length = frames if frames is None else min(frames, source.frame_count or frames)
    for begin in range(0, len(cases), MOST_SIDE_BY_SIDE):
        runs = []
        for tracker, seed in cases[begin : begin + MOST_SIDE_BY_SIDE]:
            if noisy and seed != opened:
                source, opened = setup.open_source(seed, timeline.parameters_at(0)), seed
            shared = replace(setup, open_source=_give(source))
            runs.append(Run(experiment, shared, tracker=tracker, seed=seed, frames=length, timeline=changes))
        going = [run for run in runs if not watch(run)]
        while going := [run for run in going if run.position + 1 < run.frames]:
            for run in going:
                run.advance()
            going = [run for run in going if not watch(run)]
        yield from runs


def _give(source: Source[Any]) -> Callable[[int, Any], Source[Any]]:
    return lambda *_: source


@dataclass(frozen=True, slots=True)
class Outcome(Verdict):
    """The result of one run: its verdict and more.

    Attributes:
        step_ms: Mean time of a step, ms; the only figure that is not reproducible.
        estimates_sha256: Hash of all estimates, as for a live run.
        measures: By name, the experiment's measures for which the truth is known, and the requested ones.
        reductions: By name, reductions of the series of tracker and experiment; None if no frame has a value.
    """

    step_ms: float
    estimates_sha256: str
    measures: Mapping[str, float | int]
    reductions: Mapping[str, float | int | None]


def outcomes(
    experiment: Experiment,
    setup: Setup,
    *,
    values: Mapping[str, Value],
    trackers: Sequence[str],
    seeds: Sequence[int],
    frames: int,
    measures: Sequence[Measure] = (),
    loss_probability: bool = False,
) -> list[list[Outcome]]:
    """Compute all runs of one condition.

    Args:
        experiment: The wiring.
        setup: The source.
        values: Values of the parameters that differ from the setup's.
        trackers: Names of the trackers.
        seeds: One seed per trial, the same for every tracker.
        frames: Length of a run; a run on a shorter recording ends with it.
        measures: Measures besides the experiment's own. They may use estimates, truths, errors, losses and sizes; runs
            here do not always have more.
        loss_probability: Whether to measure the probability that the target is lost. It needs the rows of all frames,
            so a tracker that has it computes frames one by one.

    Returns:
        The outcomes for each seed, and within a seed for each tracker.

    Raises:
        ParameterError: A value is unknown, out of bounds or at odds with another.
    """
    parameters = revise(setup.parameters, values)
    wanted = (*experiment.measures_on(setup.footage), *measures)
    rows_needed = set(experiment.quality.loss_probability.models_on(setup.footage)) if loss_probability else set()
    folding = [name for name in trackers if _folds(experiment, setup, name) and name not in rows_needed]
    known: dict[tuple[str, int], Outcome] = {}
    if folding:
        source = setup.open_source(seeds[0], parameters)
        for group in [[seed] for seed in seeds] if source.noisy else [list(seeds)]:
            if group[0] != seeds[0]:
                source = setup.open_source(group[0], parameters)
            known |= _fold(
                experiment,
                setup,
                source,
                parameters,
                [(name, seed) for seed in group for name in folding],
                frames,
                wanted,
            )
    left = [(name, seed) for seed in seeds for name in trackers if (name, seed) not in known]
    changes = (Change(0, values),)
    for run in side_by_side(experiment, setup, left, changes=changes, frames=frames) if left else ():
        rows = run.diagnostics
        course, end = evaluated_run(experiment, rows), run.parameters_at(run.computed)
        more = measure_loss_probability(run) if run.tracker in rows_needed else {}
        step_ms = float(np.mean([row.step_ms for row in rows[1:]])) if rows[1:] else 0.0
        kept = reductions(experiment.all_series(run.tracker), rows[1:])
        made = _judge(experiment, setup, course, Loss.of(rows), end, wanted, step_ms, kept)
        known[run.tracker, run.seed] = replace(made, measures={**made.measures, **more})
    return [[known[name, seed] for name in trackers] for seed in seeds]


def _folds(experiment: Experiment, setup: Setup, tracker: str) -> bool:
    """Return whether runs of a tracker may process many frames at once and still have all results."""
    # Reductions of the experiment's own series need the states of all frames, and a fold has only the last one.
    # `missed` needs states and targets, and a fold has estimates and places.
    # Without a truth the tracker's own report judges, and that needs the rows of all frames.
    by_truth = experiment.measures_on(setup.footage) == experiment.run_measures and experiment.judge.missed is None
    kept = any(series.reductions for series in experiment.measured.series)
    return by_truth and not kept and experiment.trackers[tracker].fold is not None


def _fold(
    experiment: Experiment,
    setup: Setup,
    source: Source[Any],
    parameters: Parameters,
    cases: Sequence[tuple[str, int]],
    frames: int,
    measures: Sequence[Measure],
) -> dict[tuple[str, int], Outcome]:
    """Return the results of runs that can process many frames at once; all see the same frames."""
    names = tuple(experiment.trackers)
    timelines = {name: Timeline.begin(parameters, name, names) for name in {tracker for tracker, _ in cases}}
    going = {(name, seed): Trial(experiment, source, timelines[name], seed) for name, seed in cases}
    truths: list[Truths] = []
    last = min(frames, source.frame_count or frames) - 1
    for block in read_blocks(source, History(((0, parameters),)), 0, last, shortest=frames):
        if block.first == 0:  # starts come first: alternating with folds costs 5 %
            for trial in going.values():
                trial.begin(block.frames[0])
        going = {case: trial for case, trial in going.items() if trial.fold(block)}
        if not going:
            return {}
        truths.append(block.truths)
    found = Truths(*(np.concatenate([getattr(one, it.name) for one in truths]) for it in fields(Truths)))
    return {
        case: _judge(
            experiment,
            setup,
            trial.course(found),
            trial.loss,
            parameters,
            measures,
            1e3 * trial.seconds / trial.steps if trial.steps else 0.0,
            trial.reductions(),
        )
        for case, trial in going.items()
    }


def _judge(
    experiment: Experiment,
    setup: Setup,
    course: EvaluatedRun,
    loss: Loss,
    parameters: Parameters,
    measures: Sequence[Measure],
    step_ms: float,
    kept: Mapping[str, float | int | None],
) -> Outcome:
    """Return the result of a finished run."""
    verdict = judge(course, loss, experiment.measure_named(setup.success), allowed_loss(parameters))
    told = {it.name: getattr(verdict, it.name) for it in fields(Verdict)}
    return Outcome(
        **told,
        step_ms=step_ms,
        estimates_sha256=estimates_hash(course.estimates),
        measures=evaluate(measures, course),
        reductions=kept,
    )
