"""Checks that a model that is declared as linear is the one that the tracker computes with."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.model import LinearChain
from pftrack.core.model.parameters import Value, flat, revise
from pftrack.experiments.experiment import Experiment
from pftrack.filters.disturbances import smooth_disturbances
from pftrack.testing.check import Check, demand, each_tracker, straight

SMALL = 1e-8
LARGER = 1.25
"""By which each number is multiplied, or divided where its bound is near."""


def checks(experiment: Experiment) -> Iterator[Check]:
    """Yield the checks of this module."""
    yield from each_tracker(
        experiment,
        [("a linear model is that of the filter, and its noises are scaled as declared", _model_is_the_filters)],
    )


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
    demand(abs(found - told) < SMALL * max(abs(told), 1.0), f"the model has a log evidence of {found:g}, not {told:g}")
    declared = {it.name: it for it in experiment.declarations(type(parameters))}
    kinds = [scale.kind for scale in model.scales.values()]
    demand(len(set(kinds)) == len(kinds), f"one number may scale each kind of noise, got {kinds}")
    for name, scale in model.scales.items():
        before = float(flat(parameters)[name])
        after = before * LARGER
        if declared[name].maximum is not None and after > float(declared[name].maximum or 0):
            after = before / LARGER
        factor = scale.factor(before, after)
        demand(abs(scale.scale(before, factor) - after) < SMALL * after, f"{name}: the factor must lead to the number")
        values: Mapping[str, Value] = {name: after}
        changed = model.chains(state, frames, revise(parameters, values)) or ()
        scales = {kind: factor if kind == scale.kind else 1.0 for kind in ("process", "observation")}
        demand(_are_scaled(chains, changed, scales), f"{name} must scale the {scale.kind} noise, and nothing else")


def _are_scaled(before: Sequence[LinearChain], after: Sequence[LinearChain], scales: Mapping[str, float]) -> bool:
    def alike(one: Floats, other: Floats) -> bool:
        return np.allclose(one, other, rtol=SMALL, atol=0.0, equal_nan=True)

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
