"""Checks of a tracker's reports and of its model: finite, as declared, and consistent with the filter's weights."""

import atexit
import itertools
import json
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import cycle, islice
from pathlib import Path
from typing import Any

import numpy as np

from pftrack.analysis.diagnosis import diagnose_course
from pftrack.analysis.diagnosis.course import course_of
from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Cloud, Contributions, Histograms
from pftrack.core.model.model import LinearChain, Model
from pftrack.core.model.parameters import Value, declarations, flat, revise, with_role
from pftrack.core.model.series import check_value, columns
from pftrack.core.model.source import Frame, History
from pftrack.core.model.tracker import Step, Tracker
from pftrack.core.refusal import RefusedError
from pftrack.experiments.experiment import Experiment
from pftrack.filters.disturbances import smooth_disturbances
from pftrack.filters.particles import normalise
from pftrack.process import UNLIMITED, BlockingPool, CallError, ForkServer, WorkerLostError
from pftrack.runs import many
from pftrack.runs.record import save
from pftrack.runs.reproduction import load
from pftrack.runs.run import Run
from pftrack.runs.scoring import estimates_hash, evaluated_run, reductions
from pftrack.testing.check import (
    FRAMES,
    SEED,
    CheckError,
    begin_run,
    copy_arrays,
    demand,
    each_tracker,
    straight,
    whole,
)

UNKNOWN: Mapping[str, Any] = {"truth": None, "error": None, "lost": None, "hidden": None, "extent": None}
"""Columns of a row without a known truth."""


@each_tracker("estimates are finite and as long as positions are")
def _estimates_are_finite(experiment: Experiment, tracker: str) -> None:
    course = straight(experiment, tracker)
    length = len(course.run.source.start.position)
    for step in course.steps:
        frame, state = step.diagnostics.frame, step.state
        for name, values in (("estimate", state.estimate), ("sigma", state.sigma)):
            shape = np.shape(values)
            demand(shape == (length,), f"the {name} of frame {frame} must have the shape ({length},), got {shape}")
        finite, sigma = np.isfinite(state.estimate).all(), state.sigma
        demand(finite, f"the estimate of frame {frame} must be finite, got {state.estimate}")
        known = sigma[~np.isnan(sigma)]
        demand(
            len(known), f"the sigma of frame {frame} must be known of a number in the experiment's unit, got {sigma}"
        )
        demand(np.isfinite(known).all(), f"the sigma of frame {frame} must be finite or NaN, got {sigma}")
        demand((known >= 0).all(), f"the sigma of frame {frame} must not be negative, got {sigma}")
        evidence = state.log_evidence
        demand(evidence < np.inf, f"the log evidence of frame {frame} must be a number or -inf, got {evidence}")


@each_tracker("its states are values")
def _states_are_values(experiment: Experiment, tracker: str) -> None:
    known = straight(experiment, tracker)
    first = known.steps[0]
    for name, array in copy_arrays(first).items():
        same = np.array_equal(array, known.begun[name], equal_nan=array.dtype.kind == "f")
        demand(same, f"{name} of the state of frame 0 changed while later frames were computed; states must not change")


@each_tracker("series are as declared")
def _series_are_declared(experiment: Experiment, tracker: str) -> None:
    declared = {series.name: series for series in experiment.all_series(tracker)}
    for step in straight(experiment, tracker).steps:
        frame = step.diagnostics.frame
        # A run leaves out what cannot be used, so they are asked directly.
        reported = dict(experiment.trackers[tracker].measure(step.state))
        if experiment.measured.measure:
            reported |= experiment.measured.measure(step.frame, step.state)
        for name, value in reported.items():
            demand(name in declared, f"frame {frame} has a series {name!r}, which {tracker} does not declare")
            try:
                check_value(declared[name], value)
            except ValueError as error:
                raise CheckError(f"frame {frame}: {error}") from None
            for column in columns(declared[name], [value]).values():
                demand(not np.isinf(column).any(), f"{name} of frame {frame} must be finite or NaN, got {value}")
    _demand_explanations(experiment, tracker)


@each_tracker("measures are a number a frame")
def _measures_are_numbers(experiment: Experiment, tracker: str) -> None:
    run = straight(experiment, tracker).run
    course = evaluated_run(experiment, run.diagnostics)
    for measure in experiment.run_measures:
        values = measure.frames(course)
        shape, kind = np.shape(values), np.asarray(values).dtype
        wanted = (len(run.diagnostics),)
        fits = shape == wanted and kind.kind in "fiub"
        demand(fits, f"the measure {measure.name} must give numbers {wanted}, one a frame, got {kind} {shape}")


def _demand_explanations(experiment: Experiment, tracker: str) -> None:
    """Demand that a loss can be explained from the series.

    The later half of the run is taken for lost, by the truth, and by the tracker's own account without a truth.
    """
    run = straight(experiment, tracker).run
    half = len(run.diagnostics) // 2
    by_truth = [replace(row, lost=row.frame >= half) for row in run.diagnostics]
    by_account = [replace(row, **UNKNOWN, searching=row.frame >= half) for row in run.diagnostics]
    for rows in (by_truth, by_account):
        course = course_of(rows, experiment.all_series(tracker), unit=experiment.judge.unit)
        found = diagnose_course(course)
        demand(found.lost and found.frame == half, f"the loss in frame {half} must be explained, got: {found.sentence}")
        for sign in found.signs:
            demand(0 <= sign.since < len(rows), f"{sign.cause} must begin in a frame of the run, got {sign.since}")
            demand(0 <= sign.strength <= 1, f"the strength of {sign.cause} must be 0 to 1, got {sign.strength}")
            demand(bool(sign.words), f"{sign.cause} must be said in words")
        json.dumps(found.as_dict(), allow_nan=False)


SMALL = 1e-9


@each_tracker("particles can be laid open")
def _clouds_are_whole(experiment: Experiment, tracker: str) -> None:
    steps = straight(experiment, tracker).steps
    for before, step in itertools.pairwise(steps):
        cloud, parents = _cloud(experiment, before), _cloud(experiment, step)
        if parents is None:
            continue
        where = f"in frame {step.frame.index}"
        sums = np.exp(parents.log_weights).reshape(max(len(parents.filters), 1), -1).sum(axis=1)
        demand((np.abs(sums - 1.0) < 1e-6).all(), f"weights of particles must sum to 1 {where}")
        demand(len(parents.states) == len(parents), f"there must be a weight for each particle {where}")
        demand(sum(parents.counts) in {0, len(parents)}, f"samplers must have drawn all particles {where}")
        if parents.ancestors is not None and cloud is not None:
            within = parents.ancestors.min() >= -1 and parents.ancestors.max() < len(cloud)
            demand(within, f"ancestors must be particles of the frame before, or -1, {where}")


@each_tracker("a likelihood can be asked at any state, and says what the filter weighs by")
def _likelihoods_agree(experiment: Experiment, tracker: str) -> None:
    chosen = experiment.trackers[tracker]
    model = chosen.model
    if model is None or not model.title:
        return
    steps = straight(experiment, tracker).steps
    for before, step in itertools.pairwise(steps):
        held = copy_arrays(before), copy_arrays(step)
        cloud, centre = _cloud(experiment, step), model.centre(step.state)
        names = model.components(step.parameters)
        demand(centre.shape == (len(names),), f"a state has {len(names)} coordinates, and its centre {centre.shape}")
        if cloud is not None and cloud.components:
            demand(cloud.states.shape[1] == len(cloud.components), "particles must have the coordinates that they name")
            said = cloud.log_likelihoods
            demand(said is None or said.shape == (len(cloud),), "each particle must have a likelihood, or none")
            cloud = None  # they are none of those that the likelihood is asked of
        states = centre[None] if cloud is None else cloud.states
        found = model.evaluate(before.state, states, step.frame, step.parameters)
        where = f"in frame {step.frame.index}"
        demand(found.shape == (len(states),) and (found < np.inf).all(), f"a likelihood must be a number {where}")
        if cloud is not None and model.weighs and _by_prediction(chosen, cloud):
            passed_on = 0.0 if cloud.resampled else _weights_before(experiment, before, cloud)
            off = np.abs(np.exp(normalise(found + passed_on)[0]) - np.exp(cloud.log_weights)).max()
            demand(off < SMALL, f"the likelihood differs from the weights that the filter gave {where} by {off:.2g}")
            if chosen.evidence == "relative":
                prior = np.full(len(cloud), -np.log(len(cloud))) if cloud.resampled else passed_on
                apart = abs(normalise(found + prior)[1] - step.state.log_evidence)
                demand(apart < SMALL, f"the log evidence differs from the mean likelihood {where} by {apart:.2g}")
        _demand_whole_parts(model, before, step)
        for kept, each in zip(held, (before, step), strict=True):
            same = all(np.array_equal(kept[name], array, equal_nan=True) for name, array in copy_arrays(each).items())
            demand(same, f"asking a likelihood must leave states as they are, and does not {where}")


def _by_prediction(tracker: Tracker, cloud: Cloud) -> bool:
    """Return whether all particles were drawn from the dynamics."""
    return tracker.sampling == "prior" or (bool(cloud.counts) and sum(cloud.counts[1:]) == 0)


def _weights_before(experiment: Experiment, before: Step, cloud: Cloud) -> Floats:
    """Return the log weights (N,) of the particles' parents, which they keep where none were drawn."""
    parents = _cloud(experiment, before)
    if parents is None or cloud.ancestors is None:
        return np.zeros(len(cloud))
    return np.where(cloud.ancestors < 0, 0.0, parents.log_weights[cloud.ancestors])


def _demand_whole_parts(model: Model, before: Step, step: Step) -> None:
    known = model.prepare(before.state, step.frame, step.parameters)
    for part in model.parts(model.centre(step.state), step.frame, step.parameters, known):
        demand(part.title, "each part of a likelihood must have a title")
        if isinstance(part, Histograms):
            demand(len(part.expected) == len(part.found), f"{part.title}: both histograms must have the same bins")
            demand(len(part.colours) in {0, len(part.found)}, f"{part.title}: each bin must have a colour, or none")
        if isinstance(part, Contributions):
            demand(len(part.names) == len(part.rows), f"{part.title}: each row must have a name")


@each_tracker("a likelihood covers the picture")
def _maps_cover_the_picture(experiment: Experiment, tracker: str) -> None:
    model = experiment.trackers[tracker].model
    if model is None or not model.has_place:
        return
    made = straight(experiment, tracker)
    before, step = made.steps[-2:]
    size = made.drawings[-1].width, made.drawings[-1].height
    found = model.map(before.state, step.state, step.frame, step.parameters, size)
    demand(np.isfinite(found.log_likelihoods).any(), "a likelihood must be possible somewhere in the picture")
    rows, columns = found.log_likelihoods.shape
    demand(
        rows * columns <= model.most_places,
        f"a map must have {model.most_places} places at most, got {rows} x {columns}",
    )


def _cloud(experiment: Experiment, step: Step) -> Cloud | None:
    return experiment.trackers[step.tracker].cloud(step.state)


CLOSE = 1e-8
LARGER = 1.25
"""Factor of each number, or its divisor near a bound."""


@each_tracker("a linear model is that of the filter, and its noises are scaled as declared")
def _model_is_the_filters(experiment: Experiment, tracker: str) -> None:
    model = experiment.trackers[tracker].model
    if model is None or experiment.trackers[tracker].sampling != "exact":
        return
    steps = straight(experiment, tracker).steps
    frames = [step.frame for step in steps]
    state, parameters = steps[0].state, steps[1].parameters
    chains = model.chains(state, frames, parameters)
    if chains is None:
        return
    told = sum(step.state.log_evidence for step in steps)
    found = float(sum(smooth_disturbances(chain).log_evidence.sum() for chain in chains))
    demand(abs(found - told) < CLOSE * max(abs(told), 1.0), f"the model has a log evidence of {found:g}, not {told:g}")
    declared = {it.name: it for it in experiment.declarations(type(parameters))}
    kinds = [scale.kind for scale in model.scales.values()]
    demand(len(set(kinds)) == len(kinds), f"one number may scale each kind of noise, got {kinds}")
    for name, scale in model.scales.items():
        before = float(flat(parameters)[name])
        after = before * LARGER
        if declared[name].maximum is not None and after > float(declared[name].maximum or 0):
            after = before / LARGER
        factor = scale.factor(before, after)
        demand(abs(scale.scale(before, factor) - after) < CLOSE * after, f"{name}: the factor must lead to the number")
        values: Mapping[str, Value] = {name: after}
        changed = model.chains(state, frames, revise(parameters, values)) or ()
        scales = {kind: factor if kind == scale.kind else 1.0 for kind in ("process", "observation")}
        demand(_are_scaled(chains, changed, scales), f"{name} must scale the {scale.kind} noise, and nothing else")


def _are_scaled(before: Sequence[LinearChain], after: Sequence[LinearChain], scales: Mapping[str, float]) -> bool:
    def alike(one: Floats, other: Floats) -> bool:
        return np.allclose(one, other, rtol=CLOSE, atol=0.0, equal_nan=True)

    return len(before) == len(after) and all(
        alike(scales["process"] * _square(one.noises), _square(other.noises))
        and alike(scales["observation"] * one.covariances, other.covariances)
        and all(
            alike(getattr(one, name), getattr(other, name))
            for name in ("mean", "covariance", "transitions", "offsets", "measurements", "observations")
        )
        for one, other in zip(before, after, strict=True)
    )


def _square(noises: Floats) -> Floats:
    return np.asarray(np.einsum("tij,tkj->tik", noises, noises))


# Checks that a run has the same numbers whichever way leads to them.

MIDDLE = FRAMES // 2
LATE = FRAMES - 3
TO_AND_FRO = (MIDDLE, 1, FRAMES - 2, MIDDLE - 1, FRAMES - 1)
FEW = FRAMES // 6
"""The last frame that is recomputed from a file; each frame follows from the file's content."""

SEEKING = (2, 1, FRAMES - 2, FRAMES - 3)
"""Forward, back to a frame that is computed again from the first state, and from one that was kept on the way."""


@whole("frames are the same when asked for again")
def _frames_are_the_same(experiment: Experiment) -> None:
    setup = experiment.simulate()
    history = History(((0, setup.parameters),))
    one, other = (setup.open_source(SEED, setup.parameters) for _ in range(2))
    known = [one.frame(index, history) for index in range(FRAMES)]
    for index in TO_AND_FRO:
        same = _look_alike(known[index], other.frame(index, history))
        demand(same, f"frame {index} of the source depends on which frames were asked for before")


@whole("only a noisy source depends on the seed")
def _only_noise_depends_on_the_seed(experiment: Experiment) -> None:
    setup = experiment.simulate()
    history = History(((0, setup.parameters),))
    one, other = (setup.open_source(seed, setup.parameters) for seed in (SEED, SEED + 1))
    if not one.noisy:
        for index in range(FRAMES):
            same = _look_alike(one.frame(index, history), other.frame(index, history))
            demand(same, f"the source says that it is not noisy, and frame {index} depends on the seed")


def _look_alike(one: Frame, other: Frame) -> bool:
    """Return whether two frames show the same, to the bit."""
    pairs = ((one.image_rgb, other.image_rgb), (one.signal, other.signal))
    return all((a is None and b is None) or np.array_equal(a, b) for a, b in pairs)  # type: ignore[arg-type]  # not None


@each_tracker("seeking gives the same numbers")
def _seeking_agrees(experiment: Experiment, tracker: str) -> None:
    known, wandering = straight(experiment, tracker), begin_run(experiment, tracker)
    for frame in SEEKING:
        again, first = copy_arrays(wandering.seek(frame)), copy_arrays(known.steps[frame])
        for name, array in first.items():
            same = np.array_equal(again[name], array, equal_nan=array.dtype.kind == "f")
            what = "estimates" if name == "estimate" else f"states: {name}"
            demand(same, f"a run that seeks to and fro must reach the same {what} in frame {frame}, and does not")
    demand_equal(known.run, wandering, "a run that seeks to and fro", max(SEEKING) + 1)


@each_tracker("a branch shares the past and gives the same numbers")
def _a_branch_agrees(experiment: Experiment, tracker: str) -> None:
    trunk = straight(experiment, tracker).run
    before = trunk.estimates_sha256
    twin = trunk.branch(LATE)
    twin.finish()
    demand_equal(trunk, twin, "a branch that changes nothing")
    changed = trunk.branch(LATE, dict(islice(_other_values(experiment, tracker), 1)))
    changed.finish()
    shared = [row.estimate for row in changed.diagnostics[: LATE + 1]]
    past = [row.estimate for row in trunk.diagnostics[: LATE + 1]]
    demand(shared == past, "a branch that changes a parameter must share the past, and its past differs")
    demand(trunk.estimates_sha256 == before, "computing a branch changed the run that it left")
    replayed = begin_run(experiment, tracker, timeline=changed.timeline.changes)
    replayed.finish()
    demand_equal(changed, replayed, "a run with the branch's timeline")


@each_tracker("what only smooths changes no estimate")
def _smoothing_changes_no_estimate(experiment: Experiment, tracker: str) -> None:
    trunk = straight(experiment, tracker).run
    for declared in with_role(type(trunk.parameters_at(LATE)), "smoothing"):
        if not declared.trackers or tracker in declared.trackers:
            for bound in (it for it in (declared.minimum, declared.maximum) if it is not None):
                smoothed = trunk.branch(LATE, {declared.name: bound})
                smoothed.finish()
                demand_equal(trunk, smoothed, f"a branch in which {declared.title}, which only smooths, is {bound:g}")


def _other_values(experiment: Experiment, tracker: str) -> Iterator[tuple[str, Value]]:
    """Yield live numbers that a tracker reads, each a step away from its default, or at one of its bounds."""
    parameters = experiment.simulate().parameters
    values = flat(parameters)
    for declared in declarations(type(parameters)):
        read = not declared.trackers or tracker in declared.trackers
        low, high, step = declared.minimum, declared.maximum, declared.step
        if declared.live and read and declared.kind in {"integer", "number"} and low is not None and high is not None:
            kind, value = (int if declared.kind == "integer" else float), float(values[declared.name])
            for other in (value + (step or 0.0), value - (step or 0.0), high, low):
                if low <= other <= high and other != value:
                    yield declared.name, kind(other)
                    break


@each_tracker("a saved run gives the same numbers")
def _a_saved_run_agrees(experiment: Experiment, tracker: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        run = straight(experiment, tracker).run.branch(FEW)
        save(run, Path(folder, "run.pft"), states=True)
        again = _load(Path(folder, "run.pft"))
    again.seek(FEW)
    demand_equal(run, again, "the run from its file")


def _load(path: Path) -> Run:
    try:
        return load(path)
    except RefusedError as error:
        raise CheckError(f"a saved run must open again: {error}") from None


@whole("another process gives the same numbers")
def _another_process_agrees(experiment: Experiment) -> None:
    with tempfile.TemporaryDirectory() as folder:
        runs, files = [], []
        for tracker in experiment.trackers:
            runs.append(straight(experiment, tracker).run)
            files.append(str(Path(folder, f"{tracker}.pft")))
            save(runs[-1], Path(files[-1]))
        hashes = hashes_elsewhere(files)
    for tracker, run, found in zip(experiment.trackers, runs, hashes, strict=True):
        demand(found == run.estimates_sha256, f"another process gives other estimates with the tracker {tracker}")


@whole("a batch gives the numbers of live runs")
def _a_batch_agrees(experiment: Experiment) -> None:
    folding = [name for name, tracker in experiment.trackers.items() if tracker.fold]
    alone = [name for name in experiment.trackers if name not in folding]
    _demand_batch(experiment, folding, [SEED, SEED + 1])
    # Whatever takes no frames at once is carried out frame by frame, the one like the other.
    _demand_batch(experiment, alone[:1], [SEED])


def _demand_batch(experiment: Experiment, trackers: list[str], seeds: list[int]) -> None:
    rows = many.outcomes(experiment, experiment.simulate(), values={}, trackers=trackers, seeds=seeds, frames=FRAMES)
    for seed, row in zip(seeds, rows, strict=True):
        for tracker, outcome in zip(trackers, row, strict=True):
            live = straight(experiment, tracker).run if seed == SEED else begin_run(experiment, tracker, seed=seed)
            live.finish()
            where = f"than a live run with the tracker {tracker}, seed {seed}"
            same = outcome.estimates_sha256 == live.estimates_sha256
            demand(same, f"a batch gives other estimates {where}")
            summary = live.summary()
            names = ("success", "mean_error", "lost_frames", "first_lost_frame", "labelled_frames")
            of_batch = {**{name: getattr(outcome, name) for name in names}, **outcome.measures, **outcome.reductions}
            kept = reductions(experiment.all_series(tracker), live.diagnostics[1:])
            of_live = {**{name: getattr(summary.verdict, name) for name in names}, **summary.measures, **kept}
            for name in of_batch | of_live:
                pair = of_batch.get(name), of_live.get(name)
                demand(pair[0] == pair[1], f"a batch gives another {name} {where}: {pair[0]} for {pair[1]}")


@whole("any tracker takes over from any other")
def _trackers_take_over(experiment: Experiment) -> None:
    """Let each tracker follow each other one, and see that a run with all of them comes again from its timeline."""
    names = list(experiment.trackers)
    for shift in range(1, len(names)):
        run = begin_run(experiment, names[0])
        order = islice(cycle([*names[shift:], *names[:shift]]), FRAMES // 2 - 1)
        for place, tracker in enumerate(order, 1):
            run.seek(2 * place - 1)
            run.change({"tracker": tracker})
        run.finish()
        for row in run.diagnostics:
            finite = np.isfinite(row.estimate).all()
            demand(finite, f"the estimate of frame {row.frame} is {row.estimate} after the tracker changed")
        if shift == 1:
            again = begin_run(experiment, names[0], timeline=run.timeline.changes)
            again.finish()
            demand_equal(run, again, "a run with the same changes of tracker")


def demand_equal(run: Run, other: Run, what: str, frames: int | None = None) -> None:
    """Go on if two runs have the same estimates in all frames, or in so many at the beginning, to the bit.

    Raises:
        CheckError: They have not; the sentence names the first frame in which they differ.
    """
    one, two = (np.array([row.estimate for row in each.diagnostics[:frames]]) for each in (run, other))
    if estimates_hash(one) != estimates_hash(two):
        pairs = zip(run.diagnostics, other.diagnostics, strict=True)
        frame = next((one.frame for one, two in pairs if one.estimate != two.estimate), 0)
        raise CheckError(f"{what} must give the same estimates, and differs from frame {frame} on")


def hashes_elsewhere(paths: Sequence[str]) -> list[str]:
    """Return the hashes of the estimates of saved runs in another process.

    Args:
        paths: Paths of the files.

    Raises:
        CheckError: It cannot compute them.
    """
    try:
        hashes: list[str] = _pool(frozenset(os.environ.items())).submit(_hash_runs, tuple(paths)).result()
    except (CallError, WorkerLostError, MemoryError, OSError) as error:
        raise CheckError(f"another process cannot compute the run: {error}") from None
    return hashes


@cache
def _pool(environment: frozenset[tuple[str, str]]) -> BlockingPool:  # noqa: ARG001 - one for each environment
    """Start a process in the environment of now; it ends with this one."""
    pool = BlockingPool(ForkServer("pftrack.runs.reproduction"), processes=1, budget=UNLIMITED)
    atexit.register(pool.close)
    return pool


def _hash_runs(paths: Sequence[str]) -> list[str]:
    hashes = []
    for path in paths:
        run = load(Path(path))
        run.finish()
        hashes.append(run.estimates_sha256)
    return hashes
