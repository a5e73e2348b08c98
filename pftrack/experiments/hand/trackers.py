"""Trackers of a hand's pose by its silhouette: a beam of hands, and a particle filter with the same likelihood.

A frame of the beam is in `beams`, one of the particle filter in `particles`. While no hand can be followed both say
why, keep what they knew, and wait for an open hand: one frame without a hand, as after a flash, is passed over, and the
hands that were kept go on from there. After some such frames, or when no hand that is found fits the silhouette any
more, only an open hand tells where the hand is, and that is found as at the beginning of a recording.

Source: Shimada 1997, chapter 2.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np
from typing_extensions import override

from pftrack.core.model.likelihood import Cloud, Contributions, Part
from pftrack.core.model.model import Model, Values
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.elementary import exponential
from pftrack.core.numerics.random import Stream
from pftrack.experiments.hand.beams import alike, differences, follow, predictions
from pftrack.experiments.hand.fingers import HandFeatures, features_of
from pftrack.experiments.hand.first_pose import NoOpenHandError, find_open_hand
from pftrack.experiments.hand.likelihood import View, fingers, wrist_offset
from pftrack.experiments.hand.parameters import STILL_COST, HandTrackerParameters
from pftrack.experiments.hand.particles import sample
from pftrack.experiments.hand.scene import HandTarget
from pftrack.experiments.hand.shape import ANGLES
from pftrack.experiments.hand.state import PARTICLES, SERIES, HandState, measure, measure_particles
from pftrack.experiments.shared.reports import hypotheses_cloud
from pftrack.filters.beam import Beam, select_best
from pftrack.filters.particles import ParticleSet

NO_FINGER = "no finger is seen beside the palm, as of a fist"


def waiting(state: HandState, found: HandFeatures, reason: str) -> HandState:
    """Return a state that stays as it is, and says why."""
    count = len(state.beam)
    beam = Beam(state.beam.members, state.beam.log_weights, np.arange(count))
    return replace(
        state,
        beam=beam,
        origins=np.array(beam.members),
        fit=np.full(count, np.nan),
        protrusions=len(found.protrusions),
        tried=0,
        finding=reason,
        waited=state.waited + 1,
        searching=True,
        particles=None,
        log_evidence=0.0,
    )


def judge(before: HandState, state: HandState, parameters: HandTrackerParameters) -> HandState:
    """Return a state that says so if its best hand does not fit, and that is lost if none has for some frames."""
    share = float(state.fit[state.beam.best])
    if share <= parameters.highest_misfit:
        return state
    misfits = before.misfits + 1
    reason = f"the best hand differs from the silhouette by {100.0 * share:.0f} % of its area"
    lost = misfits >= parameters.lost_after_frames
    return replace(state, misfits=misfits, finding=reason, lost=lost, searching=lost)


def restart(state: HandState, found: HandFeatures) -> HandState:
    """Return the state that begins with the open hand of a frame; or one that waits, and says why there is none."""
    try:
        hand = find_open_hand(found)
    except NoOpenHandError as reason:
        return replace(waiting(state, found, str(reason)), lost=True)
    return HandState(
        Beam.of(hand.pose),
        hand.pose[None],
        hand.shape,
        hand.scale,
        wrist_offset(hand.pose, found),
        np.full(1, hand.misfit),
        protrusions=len(found.protrusions),
    )


Follow: TypeAlias = Callable[[HandState, HandFeatures, HandTrackerParameters, Stream], HandState]

SHOWN = 4
"""Hands that are shown of a cloud of particles."""


def features(frame: Frame, parameters: HandTrackerParameters) -> HandFeatures:
    """Return silhouette and protrusions of a frame; those of the last frames are kept.

    Raises:
        ValueError: The frame has no picture.
    """
    return features_of(frame.picture, parameters.silhouette, frame.backdrop)


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
    fresh = replace(state, protrusions=len(found.protrusions), finding="", waited=0, misfits=0, searching=False)
    return judge(state, follow(fresh, found, parameters, rng), parameters)


def _by_beam(state: HandState, found: HandFeatures, parameters: HandTrackerParameters, rng: Stream) -> HandState:
    """Take a frame in which a hand may be, with a beam."""
    del rng
    view, before = View(state, found, parameters), np.array(state.beam.members)
    members = view.into(before)
    expected = view.with_wrists(predictions(members, view.into(state.origins)))
    hands = follow(state.beam, expected, view.seen, view.task, parameters.beam_width)
    poses = view.back(np.array(hands.beam.members))
    return replace(
        state,
        beam=Beam(tuple(poses), hands.beam.log_weights, hands.beam.parents),
        origins=before[hands.beam.parents],
        fit=hands.fit,
        scale=hands.growth * state.scale,
        tried=hands.tried,
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
    still = float(exponential(-STILL_COST))
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
        tried=len(cloud.states),
        particles=ParticleSet(back, cloud.log_weights, cloud.ancestors),
        log_evidence=cloud.log_evidence,
    )


def _searching(state: HandState) -> bool:
    return state.searching


class Hands(Model):
    """What is believed of a hand: particles, or the poses that are kept."""

    @override
    def cloud(self, state: HandState) -> Cloud:
        if state.particles is not None:
            return Cloud(state.particles.states, state.particles.log_weights, state.particles.ancestors)
        return hypotheses_cloud(np.array(state.beam.members), state.beam.log_weights, state.beam.parents)

    @override
    def update_parts(self, before: HandState, state: HandState, frame: Frame, parameters: Values) -> tuple[Part, ...]:
        """Return how each pose that is kept fits the silhouette."""
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
        model=Hands(),
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
