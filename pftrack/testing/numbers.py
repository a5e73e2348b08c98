"""Checks of what a tracker says of every frame and of its model: finite, as declared, and what the filter weighs by."""

import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pftrack.analysis.diagnosis.course import course_of
from pftrack.analysis.diagnosis.diagnosis import diagnose_course
from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Cloud, Contributions, Histograms
from pftrack.core.model.model import LinearChain, Model
from pftrack.core.model.parameters import Value, flat, revise
from pftrack.core.model.series import check_value, columns
from pftrack.core.model.tracker import Step, Tracker
from pftrack.experiments.experiment import Experiment
from pftrack.filters.disturbances import smooth_disturbances
from pftrack.filters.particles import normalise
from pftrack.runs.scoring import evaluated_run
from pftrack.testing.check import CheckError, copy_arrays, demand, each_tracker, straight

UNKNOWN: Mapping[str, Any] = {"truth": None, "error": None, "lost": None, "hidden": None, "extent": None}
"""Of a row, where no truth is known."""


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
    demand(first.state.nbytes > 0, f"a state must say how much memory it takes, got {first.state.nbytes} bytes")
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
        if experiment.measure:
            reported |= experiment.measure(step.frame, step.state)
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
        course = course_of(rows, experiment.all_series(tracker), unit=experiment.unit)
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
"""By which each number is multiplied, or divided where its bound is near."""


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
