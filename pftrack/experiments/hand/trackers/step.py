"""The trackers of a hand by name: a beam of hands, and a particle filter with the same likelihood."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np

from pftrack.core.model.cloud import Cloud
from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.part import Contributions, Part
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.elementary import exponential
from pftrack.core.numerics.random import Stream
from pftrack.experiments.hand.detection.protrusions import HandFeatures, features_of
from pftrack.experiments.hand.scene import HandTarget
from pftrack.experiments.hand.shape import ANGLES
from pftrack.experiments.hand.trackers.beams import alike, follow, predictions
from pftrack.experiments.hand.trackers.parameters import HandTrackerParameters
from pftrack.experiments.hand.trackers.particles import sample
from pftrack.experiments.hand.trackers.ranking import differences
from pftrack.experiments.hand.trackers.reports import PARTICLES, SERIES, measure, measure_particles
from pftrack.experiments.hand.trackers.state import HandState
from pftrack.experiments.hand.trackers.view import View, fingers, wrist_offset
from pftrack.experiments.hand.trackers.waiting import NO_FINGER, judge, restart, waiting
from pftrack.experiments.shared.reports import hypotheses_cloud
from pftrack.filters.beam import Beam, select_best
from pftrack.filters.particles import ParticleSet

__all__ = ["TRACKERS", "features"]

Follow: TypeAlias = Callable[[HandState, HandFeatures, HandTrackerParameters, Stream], HandState]

SHOWN = 4
"""Hands that are shown of a cloud of particles."""


def features(frame: Frame, parameters: HandTrackerParameters) -> HandFeatures:
    """Return silhouette and protrusions of a frame; those of the last frames are kept.

    Raises:
        ValueError: The frame has no picture.
    """
    if frame.image_rgb is None:
        raise ValueError("a tracker of hands needs pictures, got a signal")
    return features_of(frame.image_rgb, parameters.silhouette, frame.backdrop)


def start(target: Target, frame: Frame, parameters: HandTrackerParameters, rng: Stream) -> HandState:
    """Begin with the pose of an open hand; how far the wrist that is seen is from the model's is measured then."""
    del rng
    if not isinstance(target, HandTarget):
        raise TypeError(f"a tracker of hands begins at the pose of one, got {type(target).__name__}")
    found = features(frame, parameters)
    return HandState(
        Beam.of(target.pose),
        target.pose[None],
        target.model,
        target.scale,
        wrist_offset(target.pose, found),
        np.full(1, np.nan),
        protrusions=len(found.protrusions),
        finding=found.finding.value,
    )


def step(follow: Follow, state: HandState, frame: Frame, parameters: HandTrackerParameters, rng: Stream) -> HandState:
    """Take one frame; or wait, if its silhouette cannot be that of a hand, or the hand was lost and is not yet open."""
    found = features(frame, parameters)
    if not found.finding.ok:
        return waiting(state, found, found.finding.value)
    if state.lost or state.waited > parameters.patience_frames:
        return restart(state, found)
    if not fingers(found, state.scale):
        return waiting(state, found, NO_FINGER)
    return judge(state, follow(state, found, parameters, rng), parameters)


def _by_beam(state: HandState, found: HandFeatures, parameters: HandTrackerParameters, rng: Stream) -> HandState:
    """Take a frame in which a hand may be, with a beam."""
    del rng
    view, before = View(state, found, parameters), np.array(state.beam.members)
    members = view.into(before)
    expected = view.with_wrists(predictions(members, view.into(state.origins)))
    hands = follow(state.beam, expected, parameters.still_penalty, view.seen, view.task, parameters.beam_width)
    poses = view.back(np.array(hands.beam.members))
    return replace(
        state,
        beam=Beam(tuple(poses), hands.beam.log_weights, hands.beam.parents),
        origins=before[hands.beam.parents],
        fit=hands.fit,
        scale=hands.growth * state.scale,
        protrusions=len(found.protrusions),
        tried=hands.tried,
        finding="",
        waited=0,
        misfits=0,
        searching=False,
        particles=None,
        log_evidence=hands.log_evidence,
    )


def _by_particles(state: HandState, found: HandFeatures, parameters: HandTrackerParameters, rng: Stream) -> HandState:
    """Take a frame in which a hand may be, with particles; a beam is where they begin."""
    view = View(state, found, parameters)
    particles = state.particles
    if particles is None:
        poses = np.hstack([np.array(state.beam.members), state.origins])
        particles = ParticleSet(poses, state.beam.log_weights, np.arange(len(poses)))
    members = view.into(particles.states[:, :ANGLES])
    states = np.hstack([members, view.into(particles.states[:, ANGLES:])])
    still = float(exponential(-parameters.still_penalty))
    cloud = sample(
        states,
        particles.log_weights,
        np.ascontiguousarray(view.with_wrists(members)[:, :2]),
        parameters.sample_count,
        still / (1.0 + still),
        view.seen,
        view.task,
        rng.seed,
        rng.frame,
    )
    hands = select_best(list(cloud.states[:, :ANGLES]), cloud.log_weights, np.full(len(cloud.states), -1), SHOWN, alike)
    chosen = np.array(hands.members)
    back = np.hstack([view.back(cloud.states[:, :ANGLES]), view.back(cloud.states[:, ANGLES:])])
    return replace(
        state,
        beam=Beam(tuple(view.back(chosen)), hands.log_weights, hands.parents),
        origins=view.back(chosen),
        fit=differences(chosen, view.seen, view.task) / view.seen.area,
        protrusions=len(found.protrusions),
        tried=len(cloud.states),
        finding="",
        waited=0,
        misfits=0,
        searching=False,
        particles=ParticleSet(back, cloud.log_weights, cloud.ancestors),
        log_evidence=cloud.log_evidence,
    )


def _searching(state: HandState) -> bool:
    return state.searching


def _cloud(state: HandState) -> Cloud:
    """Return the particles, or the poses that are kept, laid open."""
    if state.particles is not None:
        return Cloud(state.particles.states, state.particles.log_weights, state.particles.ancestors)
    return hypotheses_cloud(np.array(state.beam.members), state.beam.log_weights, state.beam.parents)


def _fits(before: HandState, state: HandState, frame: object, parameters: object) -> tuple[Part, ...]:
    """Return how each pose that is kept fits the silhouette."""
    del before, frame, parameters
    rows = np.column_stack([100.0 * state.beam.weights, 100.0 * state.fit])
    names = tuple(str(place) for place in range(1, len(rows) + 1))
    columns = ("weight (%)", "differs from the silhouette (%)")
    return (Contributions("poses that are kept", columns, names, tuple(map(tuple, rows.tolist()))),)


def _tracker(
    name: str,
    title: str,
    description: str,
    follow: Follow,
    series: tuple[Series, ...],
    measures: Callable[[HandState], Mapping[str, SeriesValue]],
) -> Tracker:
    return Tracker(
        name,
        title,
        description,
        start,
        partial(step, follow),
        series=series,
        measure=measures,
        searching=_searching,
        cloud=_cloud,
        update_parts=_fits,
    )


TRACKERS = {
    tracker.id: tracker
    for tracker in (
        _tracker(
            "beam",
            "Beam of hands",
            "Keeps the best hands that differ, looks near the predictions of each by adaptive steps, palms first.",
            _by_beam,
            SERIES,
            measure,
        ),
        _tracker(
            "particles",
            "Particle filter",
            "Draws palms, then fingers for those that fit, and weighs whole hands with the likelihood of the beam.",
            _by_particles,
            (*SERIES, *PARTICLES),
            measure_particles,
        ),
    )
}
"""All trackers by name, in the order in which they are shown."""
