"""Batches: many runs of one condition at once, for what came of them rather than to be watched.

A batch gives the same numbers as live runs, to the bit: any run of it can be opened and stepped through. It is faster
for three reasons: all runs share the pictures where these do not depend on the seed, a tracker that can takes many
frames at once, and nothing is kept but the estimates.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.measures import EvaluatedRun, evaluate
from pftrack.core.model.parameters import Parameters, Value, revise
from pftrack.core.model.recipe import Change
from pftrack.core.model.series import reduce
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import History, Source
from pftrack.core.model.tracker import Tracker, TrackState
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.experiment import Experiment
from pftrack.runs.loss_probability import measure_loss_probability
from pftrack.runs.run import Run
from pftrack.runs.scoring import allowed_loss, estimates_hash, extent_series, judge, reductions

BLOCK_BYTES = 64 * 1024 * 1024
"""Pictures held at a time; sixty of Bando's scene are a quarter of it."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of one run.

    Attributes:
        success: Whether the measure that decides is high enough; None where it is not known.
        mean_error: Over the frames whose truth is known, in the experiment's unit; None where there are none, or an
            estimate is not finite.
        lost_frames: How many frames were lost; None where the experiment has no notion of lost.
        first_lost_frame: The first of them, or None.
        labelled_frames: Frames whose truth is known.
        step_ms: Mean time of a step, ms; the one figure that differs from run to run.
        estimates_sha256: Hash of all estimates, as of a live run.
        measures: Those that the experiment declares and the run has a truth for, by name.
        reductions: What is kept of the series of tracker and experiment, by the reductions' names; None where no
            frame has a value.
    """

    success: bool | None
    mean_error: float | None
    lost_frames: int | None
    first_lost_frame: int | None
    labelled_frames: int
    step_ms: float
    estimates_sha256: str
    measures: Mapping[str, float | int]
    reductions: Mapping[str, float | int | None]


@dataclass(frozen=True, slots=True)
class Block:
    """Consecutive frames of a source.

    Attributes:
        first: Index of the first within the run.
        pictures_rgb: (L, height, width, 3), read-only.
        truths: (L, d) true positions, NaN where unknown.
        sizes: (L,) of the target.
        extents: (L, 2) of the box around it, NaN where unknown.
    """

    first: int
    pictures_rgb: NDArray[np.uint8]
    truths: Floats
    sizes: Floats
    extents: Floats


def outcomes(
    experiment: Experiment,
    setup: Setup,
    *,
    values: Mapping[str, Value],
    trackers: Sequence[str],
    seeds: Sequence[int],
    frames: int,
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
        loss_probability: Whether how probable it is that the target is lost is among the measures. It takes the rows of
            all frames, so that a tracker that has it takes them one by one.

    Returns:
        The outcomes by seed, and for each seed by tracker.

    Raises:
        ParameterError: A value is unknown, out of bounds or at odds with another.
    """
    parameters = revise(setup.parameters, values)
    source = setup.open_source(seeds[0], parameters)
    frames = min(frames, source.frame_count or frames)
    groups = [[seed] for seed in seeds] if source.noisy else [list(seeds)]
    known: dict[tuple[int, str], Outcome] = {}
    asked = {
        name for name in trackers if loss_probability and name in experiment.loss_probability.models_on(setup.footage)
    }
    for group in groups:
        known |= _fold(experiment, setup, parameters, [name for name in trackers if name not in asked], group, frames)

    def carry_out(seed: int, name: str) -> Outcome:
        return known.get((seed, name)) or _live(experiment, setup, values, name, seed, frames, measured=name in asked)

    return [[carry_out(seed, name) for name in trackers] for seed in seeds]


def _fold(
    experiment: Experiment,
    setup: Setup,
    parameters: Parameters,
    trackers: Sequence[str],
    seeds: Sequence[int],
    frames: int,
) -> dict[tuple[int, str], Outcome]:
    """Carry out the runs, by seed and tracker, that see the same pictures and can take many of them at once."""
    source = setup.open_source(seeds[0], parameters)
    # What an experiment keeps of its own series takes the states of all frames, and a fold has the last one only.
    # What a target is missed by takes states and targets, and a fold has estimates and places.
    # What a tracker says of itself, where there is no truth, takes the rows of all frames.
    by_truth = experiment.measures_on(setup.footage) == experiment.run_measures
    folds = by_truth and experiment.missed is None and not any(series.reductions for series in experiment.series)
    names = [name for name in trackers if folds and experiment.trackers[name].fold is not None]
    runs = {
        (seed, name): _begin(experiment.trackers[name], source, parameters, seed) for seed in seeds for name in names
    }
    blocks: list[Block] = []
    for block in _blocks(source, parameters, frames) if runs else ():
        for key in list(runs):
            if not runs[key].take(block, parameters):
                del runs[key]
        # The pictures are overwritten by the next block's; what is kept is the truth.
        blocks.append(block)
    if not runs:
        return {}
    truths, sizes, extents = (
        np.concatenate([getattr(block, name) for block in blocks]) for name in ("truths", "sizes", "extents")
    )
    known = _Truths(setup.success, truths, sizes, extents)
    return {key: run.outcome(experiment, parameters, known) for key, run in runs.items()}


@dataclass(frozen=True, slots=True)
class _Truths:
    """What is true of a run, frame by frame, and the name of the measure that decides on its success."""

    success: str
    positions: Floats
    sizes: Floats
    extents: Floats


def _blocks(source: Source[Any], parameters: Parameters, frames: int) -> Iterator[Block]:
    """Read the frames of a source, as many at a time as may be held; none if it shows no pictures."""
    history = History(((0, parameters),))
    first = source.frame(0, history)
    if first.image_rgb is None:
        return
    held = min(max(BLOCK_BYTES // first.image_rgb.nbytes, 1), frames)
    pictures = np.empty((held, *first.image_rgb.shape), np.uint8)
    for start in range(0, frames, held):
        length = min(held, frames - start)
        truths = np.full((length, len(source.start.position)), np.nan)
        sizes, extents = np.zeros(length), np.full((length, 2), np.nan)
        for place in range(length):
            frame = source.frame(start + place, history)
            pictures[place] = frame.image_rgb
            if frame.target is not None:
                truths[place], sizes[place] = frame.target.position, frame.target.size
                extents[place] = frame.target.extent or np.nan
        yield Block(start, pictures[:length], truths, sizes, extents)


def _begin(tracker: Tracker, source: Source[Any], parameters: Parameters, seed: int) -> "_Folding":
    first = source.frame(0, History(((0, parameters),)))
    state = tracker.start(source.start, first, parameters, Stream(seed, 0, Purpose.START))
    return _Folding(tracker, seed, state)


class _Folding:
    """A run under way: its newest state, and what is kept of the frames behind it."""

    def __init__(self, tracker: Tracker, seed: int, state: TrackState) -> None:
        self._tracker = tracker
        self._seed = seed
        self._state = state
        self._estimates = [state.estimate[None]]
        self._series: dict[str, list[Floats]] = {}
        self._extent = extent_series(tracker.series)
        begun = tracker.measure(state).get(self._extent) if self._extent else None
        self._first_extent = np.array([begun], np.float64) if begun else np.full((1, 2), np.nan)
        self._seconds = 0.0

    def take(self, block: Block, parameters: Parameters) -> bool:
        """Track through a block; return False if the tracker cannot with these parameters."""
        skipped = 1 if block.first == 0 else 0
        if len(block.pictures_rgb) == skipped:
            return True
        begun = perf_counter()
        fold = self._tracker.fold and self._tracker.fold(
            self._state, block.pictures_rgb[skipped:], parameters, self._seed, block.first + skipped
        )
        if fold is None:
            return False
        self._seconds += perf_counter() - begun
        self._state = fold.state
        self._estimates.append(fold.estimates)
        for name, column in fold.series.items():
            self._series.setdefault(name, []).append(column)
        return True

    def outcome(self, experiment: Experiment, parameters: Parameters, known: _Truths) -> Outcome:
        """Judge the finished run."""
        estimates = np.concatenate(self._estimates)
        errors = experiment.error(estimates, known.positions)
        errors = np.where(np.isnan(errors) & np.isfinite(known.positions).all(axis=1), np.inf, errors)
        lost = experiment.lost(errors, known.sizes, parameters) if experiment.lost else None
        scale = experiment.scale
        course = EvaluatedRun(
            scale * estimates, scale * known.positions, errors, lost, known.extents, self._believed_sizes()
        )
        verdict = judge(course, experiment.measure_named(known.success), allowed_loss(parameters))
        steps = len(estimates) - 1
        return Outcome(
            verdict.success,
            verdict.mean_error,
            verdict.lost_frames,
            verdict.first_lost_frame,
            verdict.labelled_frames,
            1e3 * self._seconds / steps if steps else 0.0,
            estimates_hash(course.estimates),
            evaluate(experiment.run_measures, course),
            self._reductions(),
        )

    def _believed_sizes(self) -> Floats:
        """Return the sizes that the tracker believes in, (L, 2) px; NaN for one that does not say."""
        later = self._series.get(self._extent, []) if self._extent else []
        known = np.concatenate([self._first_extent, *later])
        return known if later else np.resize(known, (sum(map(len, self._estimates)), 2))

    def _reductions(self) -> Mapping[str, float | int | None]:
        kept: dict[str, float | int | None] = {}
        for series in self._tracker.series:
            if series.reductions:
                blocks = self._series.get(series.name)
                kept |= reduce(series, np.concatenate(blocks) if blocks else np.zeros(0))
        return kept


def _live(
    experiment: Experiment,
    setup: Setup,
    values: Mapping[str, Value],
    tracker: str,
    seed: int,
    frames: int,
    *,
    measured: bool,
) -> Outcome:
    """Carry out a run frame by frame, measured by the probability that its target is lost as well or not."""
    timeline = (Change(0, values),)
    run = Run(experiment, setup, tracker=tracker, seed=seed, frames=frames, timeline=timeline)
    run.finish()
    summary = run.summary()
    verdict = summary.verdict
    rows = run.diagnostics[1:]
    return Outcome(
        verdict.success,
        verdict.mean_error,
        verdict.lost_frames,
        verdict.first_lost_frame,
        verdict.labelled_frames,
        float(np.mean([row.step_ms for row in rows])) if rows else 0.0,
        summary.estimates_sha256,
        {**summary.measures, **measure_loss_probability(run)} if measured else summary.measures,
        reductions(experiment.all_series(tracker), rows),
    )
