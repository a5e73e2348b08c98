"""Trackers of a hand's pose by its silhouette: a beam of hands, and a particle filter with the same likelihood.

A frame of the beam is in `beams`. While no hand can be followed, both report the reason and keep their last hands. A
single frame without a hand, as after a flash, is skipped, and the kept hands continue from there. After several such
frames, or when no hand fits the silhouette any more, the trackers wait for an open hand and find it as at the beginning
of a recording.

Source: Shimada 1997, chapter 2.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from operator import attrgetter
from typing import NamedTuple, TypeAlias

import numpy as np
from typing_extensions import override

from pftrack.core.arrays import Floats, Ints
from pftrack.core.geometry import convex_hull, fill
from pftrack.core.model.likelihood import Cloud, Contributions, Part
from pftrack.core.model.model import Model, Values
from pftrack.core.model.series import Series
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponential, exponentials, logarithms
from pftrack.core.numerics.random import Stream, standard_normals, uniforms
from pftrack.core.refusal import RefusedError
from pftrack.experiments.hand import likelihood, model
from pftrack.experiments.hand.beams import alike, differences, differing, follow, predictions
from pftrack.experiments.hand.candidates import HIGHEST, LOWEST, assign, flexion_limits
from pftrack.experiments.hand.fingers import HandFeatures, features_of
from pftrack.experiments.hand.first_pose import find_open_hand
from pftrack.experiments.hand.scene import HandTarget
from pftrack.experiments.hand.shape import ANGLES, joints, palm_points, parts
from pftrack.experiments.shared.reports import CLOUD, hypotheses_cloud
from pftrack.filters.beam import Beam, select_best
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.filters.resampling import parents


def waiting(state: model.HandState, found: HandFeatures, reason: str) -> model.HandState:
    """Return an unchanged state with the reason."""
    count = len(state.beam)
    beam = Beam(state.beam.members, state.beam.log_weights, np.arange(count))
    return replace(
        state,
        beam=beam,
        origins=np.array(beam.members),
        fit=np.full(count, np.nan),
        protrusions=len(found.protrusions),
        finding=reason,
        waited=state.waited + 1,
        searching=True,
        particles=None,
        log_evidence=0.0,
    )


def judge(before: model.HandState, state: model.HandState, parameters: model.HandTrackerParameters) -> model.HandState:
    """Return a state with a finding if its best hand does not fit, and lost if none has fitted for some frames."""
    share = float(state.fit[state.beam.best])
    if share <= parameters.highest_misfit:
        return state
    misfits = before.misfits + 1
    reason = f"the best hand differs from the silhouette by {100.0 * share:.0f} % of its area"
    lost = misfits >= parameters.lost_after_frames
    return replace(state, misfits=misfits, finding=reason, lost=lost, searching=lost)


def restart(state: model.HandState, found: HandFeatures) -> model.HandState:
    """Return the state that begins with the open hand of a frame; or a waiting one with the reason."""
    try:
        hand = find_open_hand(found)
    except RefusedError as reason:
        return replace(waiting(state, found, str(reason)), lost=True)
    return model.HandState(
        Beam.of(hand.pose),
        hand.pose[None],
        hand.shape,
        hand.scale,
        likelihood.wrist_offset(hand.pose, found),
        np.full(1, hand.misfit),
        protrusions=len(found.protrusions),
    )


# A frame of the particle filter, with the likelihood of the beam: in partitions, the palm first and then the fingers.
#
# A hand has 25 numbers, and particles that are drawn in all of them at once would need to be millions. Fingers hang on
# the palm but not on one another, so they are drawn in partitions (J. MacCormick and M. Isard, 2000): many palms; those
# that fit the silhouette are drawn again; for each of these some candidates of every finger are drawn, and one of them
# is chosen by its fit. The mean fit of a finger's candidates is its factor in the particle's weight, so all of them
# count. A share of the candidates is drawn from the finger's whole range, since fingers move fast.
#
# A particle holds its pose and that of its parent: it continues its motion or stands still, like the beam's
# predictions.

TRACK = 1
"""Purpose.TRACK, as compiled code needs it."""

PALMS_EACH = 8
"""Palms that are drawn for each particle that is kept."""
CANDIDATES = 12
"""Candidates of each finger."""
ANYWHERE = 0.25
"""Share of the candidates that are drawn from all that a finger can do."""


class Drawn(NamedTuple):
    """The result of a frame.

    Attributes:
        states: (N, 50) poses, and those of their parents.
        log_weights: (N,) normalised.
        ancestors: (N,).
        log_evidence: Log of the mean of the weights.
    """

    states: Floats
    log_weights: Floats
    ancestors: Ints
    log_evidence: float


@compiled
def sample(
    states: Floats,
    log_weights: Floats,
    wrists: Floats,
    count: int,
    still_share: float,
    seen: likelihood.PictureTables,
    task: model.Task,
    seed: int,
    frame: int,
) -> Drawn:
    """Return the particles of a frame.

    Args:
        states: (N, 50) of the frame before.
        log_weights: (N,) of these.
        wrists: (N, 2) where each one's wrist is expected.
        count: Number of particles.
        still_share: Probability that a hand stands still rather than continues its motion.
        seen: The picture.
        task: The hand, and the settings of the search.
        seed: Seed of the run.
        frame: Index of the frame.
    """
    expected, ancestors, first = _palms(states, log_weights, wrists, count, still_share, seen, task, seed, frame)
    following, weights = np.empty((count, 2 * ANGLES)), np.empty(count)
    costs = np.empty(seen.lengths.shape[0])
    for p in range(costs.shape[0]):
        costs[p] = likelihood.unexplained_cost(seen.lengths[p], task.settings.unit)
    for n in range(count):
        pose, fit = _with_fingers(expected[n], costs, seen, task, seed, frame, n)
        corners, counts = parts(pose, task.scale, task.shape)
        drawn = fill(corners, counts, seen.silhouette.shape[0], seen.silhouette.shape[1])
        share = differing(drawn, seen.silhouette) / (task.settings.cover_sd * seen.area)
        weights[n] = fit - share * share
        for i in range(ANGLES):
            following[n, i], following[n, ANGLES + i] = pose[i], states[ancestors[n], i]
    normalised, log_sum = normalise(weights)
    return Drawn(following, normalised, ancestors, first + log_sum - np.log(float(count)))


@compiled
def _palms(
    states: Floats,
    log_weights: Floats,
    wrists: Floats,
    count: int,
    still_share: float,
    seen: likelihood.PictureTables,
    task: model.Task,
    seed: int,
    frame: int,
) -> tuple[Floats, Ints, float]:
    """Return poses (count, 25) whose palms fit, with fingers as expected, their ancestors, and the log of the mean."""
    many = PALMS_EACH * count
    settings = task.settings
    chosen = parents(0, log_weights, many, seed, frame, TRACK, 0)
    normals = standard_normals(seed, frame, TRACK, 1, 5 * many).reshape(5, many)
    still = uniforms(seed, frame, TRACK, 2, many)
    poses, weights = np.empty((many, ANGLES)), np.empty(many)
    sds = np.array([settings.wrist_sd, settings.wrist_sd, model.TURN_SD, model.TILT_SD, model.TURN_SD])
    for n in range(many):
        state, pose = states[chosen[n]], poses[n]
        for i in range(ANGLES):
            pose[i] = state[i] if still[n] < still_share else 2.0 * state[i] - state[ANGLES + i]
            if i < 2:
                pose[i] = wrists[chosen[n], i]
            if i < 5:
                pose[i] += sds[i] * normals[i, n]
            pose[i] = min(max(pose[i], LOWEST[i]), HIGHEST[i])
        misfit = (
            likelihood.x_p(convex_hull(palm_points(pose, task.scale, task.shape)), seen, task.scale) / model.PALM_FIT_SD
        )
        bent = pose[4] / settings.straight_sd
        weights[n] = -0.5 * (misfit * misfit + bent * bent)
    normalised, log_sum = normalise(weights)
    drawn = parents(0, normalised, count, seed, frame, TRACK, 3)
    kept, ancestors = np.empty((count, ANGLES)), np.empty(count, np.int64)
    for n in range(count):
        ancestors[n] = chosen[drawn[n]]
        for i in range(ANGLES):
            kept[n, i] = poses[drawn[n], i]
    return kept, ancestors, log_sum - np.log(float(many))


@compiled
def _with_fingers(
    expected: Floats,
    costs: Floats,
    seen: likelihood.PictureTables,
    task: model.Task,
    seed: int,
    frame: int,
    n: int,
) -> tuple[Floats, float]:
    """Return a pose (25,) with fingers drawn by their fit, and the log of their mean fits."""
    settings, protrusions = task.settings, costs.shape[0]
    normals = standard_normals(seed, frame, TRACK, 4 + 2 * n, 10 * CANDIDATES).reshape(2, 5, CANDIDATES)
    numbers = uniforms(seed, frame, TRACK, 5 + 2 * n, 10 * CANDIDATES + 5)
    anywhere = numbers[: 10 * CANDIDATES].reshape(2, 5, CANDIDATES)
    no_moves, no_ideals = np.empty((0, 4, 2)), np.empty(0)
    poses, log_fits = np.empty((CANDIDATES, ANGLES)), np.empty((5, protrusions + 1, CANDIDATES))
    bends, uniform = np.empty(5 * CANDIDATES), np.empty(5 * CANDIDATES)
    for k in range(CANDIDATES):
        poses[k] = expected
        for finger in range(5):
            at = finger * CANDIDATES + k
            bends[at], uniform[at] = _draw_finger(
                poses[k], finger, normals[:, finger, k], anywhere[:, finger, k], settings
            )
    gains = _gains(bends, uniform)
    for k in range(CANDIDATES):
        places = joints(poses[k], task.scale, task.shape)
        for finger in range(5):
            at = finger * CANDIDATES + k
            for p in range(protrusions + 1):
                radii = task.shape.radii[finger]
                fit = likelihood.finger_fit(places[finger], no_moves, no_ideals, radii, p, seen, task, -np.inf)
                log_fits[finger, p, k] = fit + gains[at]
    means = np.empty((5, protrusions + 1))
    for finger in range(5):
        for p in range(protrusions + 1):
            means[finger, p] = normalise(log_fits[finger, p])[1] - np.log(float(CANDIDATES))
    fit, assignment = assign(means, costs)
    pose = expected.copy()
    for finger in range(5):
        at = 5 + 4 * finger
        shares = exponentials(normalise(log_fits[finger, assignment[finger]])[0])
        left, k = numbers[10 * CANDIDATES + finger], 0
        while k < CANDIDATES - 1 and left >= shares[k]:
            left -= shares[k]
            k += 1
        pose[at : at + 4] = poses[k, at : at + 4]
    return pose, fit


@compiled
def _gains(bends: Floats, uniform: Floats) -> Floats:
    """Return logs (n,) of the prior of bends by the density of drawing them, a mixture of the prior and of anywhere."""
    log_priors = np.empty(bends.shape[0])
    for n in range(bends.shape[0]):
        log_priors[n] = -0.5 * bends[n] * bends[n] - 0.5 * np.log(2.0 * np.pi)
    densities = exponentials(log_priors)
    for n in range(bends.shape[0]):
        densities[n] = ANYWHERE * uniform[n] + (1.0 - ANYWHERE) * densities[n]
    densities = logarithms(densities)
    for n in range(bends.shape[0]):
        log_priors[n] -= densities[n]
    return log_priors


@compiled
def _draw_finger(
    pose: Floats,
    finger: int,
    normals: Floats,
    numbers: Floats,
    settings: model.Settings,
) -> tuple[float, float]:
    """Draw a finger of a pose in place; return its bend and the density of drawing it from anywhere, in flexion_sd."""
    at = 5 + 4 * finger
    middle = (pose[at + 1] + pose[at + 2] + pose[at + 3]) / 3.0
    lowest, highest = flexion_limits(finger)
    turn, bend = normals[0], normals[1]
    if numbers[0] < ANYWHERE:
        bend = (lowest + numbers[1] * (highest - lowest) - middle) / settings.flexion_sd
    pose[at] = min(max(pose[at] + model.SPREAD_SD * turn, LOWEST[at]), HIGHEST[at])
    for j in range(1, 4):
        pose[at + j] = min(max(pose[at + j] + settings.flexion_sd * bend, LOWEST[at + j]), HIGHEST[at + j])
    return bend, settings.flexion_sd / (highest - lowest)


Follow: TypeAlias = Callable[[model.HandState, HandFeatures, model.HandTrackerParameters, Stream], model.HandState]

SHOWN = 4
"""Hands that are shown of a cloud of particles."""


def features(frame: Frame, parameters: model.HandTrackerParameters) -> HandFeatures:
    """Return silhouette and protrusions of a frame; those of the last frames are cached.

    Raises:
        ValueError: The frame has no picture.
    """
    return features_of(frame.picture, parameters, frame.backdrop)


def start(target: Target, frame: Frame, parameters: model.HandTrackerParameters, rng: Stream) -> model.HandState:
    """Begin with the pose of an open hand, and measure the offset of the visible wrist from the model's."""
    del rng
    if not isinstance(target, HandTarget):
        raise TypeError(f"a tracker of hands begins at the pose of one, got {type(target).__name__}")
    found = features(frame, parameters)
    return model.HandState(
        Beam.of(target.pose),
        target.pose[None],
        target.model,
        target.scale,
        likelihood.wrist_offset(target.pose, found),
        np.full(1, np.nan),
        protrusions=len(found.protrusions),
        finding=found.finding.value,
    )


def step(
    follow: Follow, state: model.HandState, frame: Frame, parameters: model.HandTrackerParameters, rng: Stream
) -> model.HandState:
    """Take one frame; or wait, if its silhouette cannot be that of a hand, or the hand was lost and is not yet open."""
    found = features(frame, parameters)
    if not found.finding.ok:
        return waiting(state, found, found.finding.value)
    if state.lost or state.waited > parameters.patience_frames:
        return restart(state, found)
    if not likelihood.fingers(found, state.scale):
        return waiting(state, found, model.NO_FINGER)
    fresh = replace(state, protrusions=len(found.protrusions), finding="", waited=0, misfits=0, searching=False)
    return judge(state, follow(fresh, found, parameters, rng), parameters)


def _by_beam(
    state: model.HandState, found: HandFeatures, parameters: model.HandTrackerParameters, rng: Stream
) -> model.HandState:
    """Take a frame in which a hand may be, with a beam."""
    del rng
    view, before = likelihood.View(state, found, parameters), np.array(state.beam.members)
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
        particles=None,
        log_evidence=hands.log_evidence,
    )


def _by_particles(
    state: model.HandState, found: HandFeatures, parameters: model.HandTrackerParameters, rng: Stream
) -> model.HandState:
    """Take a frame in which a hand may be, with particles, which begin from a beam."""
    view = likelihood.View(state, found, parameters)
    particles = state.particles
    if particles is None:
        poses = np.hstack([np.array(state.beam.members), state.origins])
        particles = ParticleSet(poses, state.beam.log_weights, np.arange(len(poses)))
    members = view.into(particles.states[:, :ANGLES])
    states = np.hstack([members, view.into(particles.states[:, ANGLES:])])
    still = float(exponential(-model.STILL_COST))
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
        particles=ParticleSet(back, cloud.log_weights, cloud.ancestors),
        log_evidence=cloud.log_evidence,
    )


class Hands(Model):
    """The belief in a hand: particles, or the kept poses."""

    @override
    def cloud(self, state: model.HandState) -> Cloud:
        if state.particles is not None:
            return Cloud(state.particles.states, state.particles.log_weights, state.particles.ancestors)
        return hypotheses_cloud(np.array(state.beam.members), state.beam.log_weights, state.beam.parents)

    @override
    def update_parts(
        self, before: model.HandState, state: model.HandState, frame: Frame, parameters: Values
    ) -> tuple[Part, ...]:
        """Return how each pose that is kept fits the silhouette."""
        rows = np.column_stack([100.0 * state.beam.weights, 100.0 * state.fit])
        names = tuple(str(place) for place in range(1, len(rows) + 1))
        columns = ("weight (%)", "differs from the silhouette (%)")
        return (Contributions("poses that are kept", columns, names, tuple(map(tuple, rows.tolist()))),)


def _tracker(name: str, follow: Follow, *series: Series) -> Tracker:
    return Tracker(
        name,
        start,
        partial(step, follow),
        series=(*model.SERIES, *series),
        measure=model.measure,
        searching=attrgetter("searching"),
        model=Hands(),
    )


TRACKERS = {
    tracker.id: tracker for tracker in (_tracker("beam", _by_beam), _tracker("particles", _by_particles, *CLOUD))
}
"""All trackers by name, in the order in which they are shown; `experiment.yaml` has their titles."""
