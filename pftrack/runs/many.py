"""Many runs at once: runs that share what they see, carried out for what comes of them rather than to be watched.

Sweeps, *What if*, other seeds, fits and studies use them. The numbers are those of a live run (`Run`), to the bit: any
of them can be opened and stepped through. They are faster for three reasons: runs that see the same pictures read them
once, a tracker that can takes many frames or many seeds at a time, and only what is asked for is kept.

- `outcomes` carries out all runs of one condition and returns what came of each;
- `side_by_side` steps whole runs together, for records of any frame;
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
"""Pictures held at a time; sixty of Bando's scene are a quarter of it."""

SHORTEST_BLOCK, LONGEST_BLOCK = 4, 64
"""Frames held at a time where somebody waits for the first results."""

MOST_SIDE_BY_SIDE = 16
"""Runs whose whole past is kept at a time."""

Losses: TypeAlias = tuple[Floats, Floats]
"""Errors and verdicts (N, L) of N runs in L frames, as `Trial` has those of one."""


class FrameBlock:
    """Consecutive frames of a source, read once for all runs that see them.

    Attributes:
        frames: The frames, by ascending index.
        width: How many numbers a position has.
        pictures_rgb: The pictures (L, height, width, 3); None of a signal.
    """

    def __init__(self, frames: Iterable[Frame], count: int, width: int) -> None:
        """Read `count` frames and keep their pictures once; a single picture stays the very array that it is."""
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
        """How much memory the pictures take, bytes."""
        return sum(map(_picture_bytes, self.frames))

    @cached_property
    def truths(self) -> Truths:
        """What is true of the frames."""
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
    """Read the frames first..last of a source, a few at first, and then as many at a time as may be held."""
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
    """A source whose frames are made once: as many as may be held are kept, and no parameter changes them any more.

    Runs with other values of a tracker's parameters so see the very same frames, and a recording is decoded once.
    """

    noisy = False

    def __init__(
        self, source: Source[Any], history: History[Any], frames: int | None = None, most_bytes: int = BLOCK_BYTES
    ) -> None:
        """Begin with no frame.

        Args:
            source: Whose frames they are.
            history: The parameters that the source looks at.
            frames: How many there are; as many as the source has if not given.
            most_bytes: Pictures that are kept beside the last one that was asked for.
        """
        self.size, self.frame_rate_hz, self.start = source.size, source.frame_rate_hz, source.start
        self.frame_count = source.frame_count if frames is None else frames
        self._source, self._history = source, history
        self._kept: dict[int, Frame] = {}
        self._last: Frame | None = None
        self._left = most_bytes

    def frame(self, index: int, history: History[Any]) -> Frame:
        """Return a frame; the parameters of who asks change nothing."""
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
    """One of many runs: where it is, and of the frames behind it the estimates, errors and losses alone.

    Attributes:
        seed: Of the tracker's random numbers.
        state: Of the last frame; None before frame 0.
        steps: How many steps were taken.
        seconds: Processor time that they took: what waits for others costs no more.
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
            source: What is seen; where it begins counts, its frames are given.
            timeline: Parameters and trackers in force; its seeds do not count.
            seed: Of the random numbers from here on.
            state: Of the frame before the first to come; None to begin with frame 0.
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
        """(L,) 1 where the target is lost, as `pftrack.core.model.measures` has it; NaN where nobody says."""
        return self._join(2)

    @property
    def truly_lost(self) -> Floats:
        """(L,) the same by the truth alone; NaN where that is not known."""
        return self._join(3)

    def course(self, truths: Truths) -> EvaluatedRun:
        """Return the run beside its truth, of one that has taken all its frames by `fold`."""
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
        """Where the target is lost by the truth, of a run that has taken all its frames by `fold`."""
        truly = self.truly_lost
        return Loss(truly == 1.0, tuple("" if unknown else "truth" for unknown in np.isnan(truly)))

    def reductions(self) -> Mapping[str, float | int | None]:
        """Return what is kept of the tracker's series, of a run that has taken all its frames by `fold`."""
        kept: dict[str, float | int | None] = {}
        for series in self._tracker(0).series:
            if series.reductions:
                kept |= reduce(series, np.concatenate(self._columns.get(series.name, [np.zeros(0)])))
        return kept

    def _believed_sizes(self, truths: Truths) -> Floats:
        """Return the sizes that the tracker believes in, (L, 2) px; NaN for one that does not say."""
        name = extent_series(self._tracker(0).series)
        later = self._columns.get(name, []) if name else []
        return np.concatenate([self._extent, *later]) if later else np.tile(self._extent, (len(truths.sizes), 1))

    def take(self, block: FrameBlock) -> None:
        """Track through the frames of a block."""
        changed = {segment.start for segment in self._timeline.segments}
        edges = sorted({block.first, block.end} | {start for start in changed if block.first < start < block.end})
        for start, end in pairwise(edges):
            # Nobody knows which tracker, with which number of particles, left the state before these frames.
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
        """Track through a block of one tracker and its parameters all at once; return False if that cannot be done."""
        begun = [self._begun] if block.first == 0 and self._begun is not None else []
        return self._fold(block, block.first + len(begun), block.end, begun)

    def folds(self, index: int) -> bool:
        """Whether the tracker of a frame may take many at a time."""
        return self._tracker(index).fold is not None

    def _fold(self, block: FrameBlock, start: int, end: int, begun: Sequence[Floats] = ()) -> bool:
        """Take the frames start..end-1 at once, where that can be done, after those begun; return whether it was."""
        tracker, parameters, experiment = self._tracker(start), self._timeline.parameters_at(start), self._experiment
        if tracker.fold is None or experiment.judge.missed is not None or block.pictures_rgb is None:
            return False
        truths = block.truths.at(slice(start - len(begun) - block.first, end - block.first))
        known = np.isfinite(truths.positions).all()
        if not known and tracker.searching is not None and tracker.searching(self.state) is not None:
            return False  # its own account, which counts where no truth is known, takes the states of all frames
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
    """Carry out whole runs of the same parameters, and yield each when it has ended.

    Those that see the same frames, as all do where the source has no noise, take each frame together.

    Args:
        experiment: The wiring.
        setup: The source.
        cases: Name of the tracker and seed of each run; those with the same seed follow each other.
        changes: Of the parameters, by ascending frame.
        frames: Length of a run, as `Run` has it; where the source is shorter, a run ends with it.
        watch: Called with a run at each of its frames, to note what only its state tells; a run ends where it returns
            True.

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
    """What came of one run: its verdict, and more.

    Attributes:
        step_ms: Mean time of a step, ms; the one figure that differs from run to run.
        estimates_sha256: Hash of all estimates, as of a live run.
        measures: Those that the experiment declares and the run has a truth for, and those asked for, by name.
        reductions: What is kept of the series of tracker and experiment, by the reductions' names; None where no
            frame has a value.
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
    """Carry out all runs of one condition.

    Args:
        experiment: The wiring.
        setup: The source.
        values: Of the parameters that differ from the setup's.
        trackers: Names of the trackers.
        seeds: One a trial; every tracker meets the same.
        frames: Length of a run; a recording that is shorter ends earlier.
        measures: Beside those that the experiment declares. They look at estimates, truths, errors, losses and sizes;
            what else a course may have, not every run here has.
        loss_probability: Whether how probable it is that the target is lost is among the measures. It takes the rows of
            all frames, so that a tracker that has it takes them one by one.

    Returns:
        The outcomes by seed, and for each seed by tracker.

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
    """Return whether runs of a tracker may take many frames at once, and their outcomes be known by that."""
    # What an experiment keeps of its own series takes the states of all frames, and a fold has the last one only.
    # What a target is missed by takes states and targets, and a fold has estimates and places.
    # What a tracker says of itself, where there is no truth, takes the rows of all frames.
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
    """Return what came of the runs that can take many frames at once with these parameters; all see the same."""
    names = tuple(experiment.trackers)
    timelines = {name: Timeline.begin(parameters, name, names) for name in {tracker for tracker, _ in cases}}
    going = {(name, seed): Trial(experiment, source, timelines[name], seed) for name, seed in cases}
    truths: list[Truths] = []
    last = min(frames, source.frame_count or frames) - 1
    for block in read_blocks(source, History(((0, parameters),)), 0, last, shortest=frames):
        if block.first == 0:  # all at first: turn by turn, starts and folds slow each other down by 5 %
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
    """Return what came of a finished run."""
    verdict = judge(course, loss, experiment.measure_named(setup.success), allowed_loss(parameters))
    told = {it.name: getattr(verdict, it.name) for it in fields(Verdict)}
    return Outcome(
        **told,
        step_ms=step_ms,
        estimates_sha256=estimates_hash(course.estimates),
        measures=evaluate(measures, course),
        reductions=kept,
    )
