"""Trackers of a chain whose belief is a Gaussian, or a beam of them.

- `ekf`: the extended Kalman filter without constraints;
- `ekf-truncated`: the same, cut by them after each update;
- `ekf-mirrors`: several of these, one for each side on which a link may lie (`linearised`);
- `ukf`: the unscented filter with the same cut. The most common alternative moves sigma points to the nearest allowed
  points; it makes spreads too small wherever several points meet at a bound. Cutting the posterior is as good as any in
  comparisons (Teixeira et al. 2010, Simon 2010) and lets `ukf` differ from `ekf-truncated` only in its treatment of
  nonlinearity.

An observation too far from all predictions is left out, as is one whose candidates are all refuted: the prediction is
kept, and the event is counted.
"""

from functools import lru_cache

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.source import Frame, Target
from pftrack.core.numerics.matrices import contiguous_copy, solve_system
from pftrack.core.numerics.random import Gaussian, Stream
from pftrack.experiments.linkage import model
from pftrack.experiments.linkage.linearised import Candidates, Filtering, candidates, predict
from pftrack.experiments.linkage.scene import LinkageTarget
from pftrack.experiments.linkage.state import NOTHING, Events, LinkageState, LinkageTrackerParameters
from pftrack.filters import unscented
from pftrack.filters.beam import Beam, select_best
from pftrack.filters.kalman import NormalisedInnovation
from pftrack.filters.particles import ParticleSet
from pftrack.filters.truncation import truncate

# A Gaussian is made of particles by their moments, and of any other belief by its box, as if everything in it were
# equally probable: the centre, and a twelfth of the squared width as the variance. A belief that has no velocities gets
# those of the first frame, zero with their variances.

ROOT_RATE_VARIANCE_PX2 = 1.0
"""Variance of the root's velocity in the first frame, (px/frame)^2."""

LEAST_WIDTH = 1e-3
"""Least half width of a box, rad or px, so its Gaussian has an inverse."""


def chains(state: LinkageState, parameters: LinkageTrackerParameters) -> Beam[model.Chain]:
    """Return the Gaussians of a state: its own, or one made of what it believes in."""
    if isinstance(state.belief, ParticleSet):
        mean, covariance = state.belief.moments
        return Beam.of(from_moments(mean, covariance, model.reference_attitude(state.reference)))
    own = tuple(member for member in state.belief.members if isinstance(member, model.Chain))
    if len(own) == len(state.belief.members):
        return Beam(own, state.belief.log_weights, state.belief.parents)
    return Beam.of(box(state.low, state.high, state.reference, parameters))


def box(
    low: Floats,
    high: Floats,
    reference: Floats | None,
    parameters: LinkageTrackerParameters,
) -> model.Chain:
    """Return the Gaussian of a box (d,) of estimates whose centre does not move yet."""
    width = np.maximum(high - low, LEAST_WIDTH)
    return gaussian(0.5 * (low + high), width * width / 12.0, reference, parameters)


def gaussian(
    mean: Floats,
    variances: Floats,
    reference: Floats | None,
    parameters: LinkageTrackerParameters,
) -> model.Chain:
    """Return a Gaussian that does not move yet, given mean and variances (d,) of an estimate."""
    rate = parameters.start_rate_variance_rad2
    if reference is None:
        state = np.concatenate([mean[: model.LINKS], np.zeros(model.LINKS), mean[model.LINKS :]])
        spread = np.concatenate([variances[: model.LINKS], np.full(model.LINKS, rate), variances[model.LINKS :]])
        return model.Chain(state, np.diag(spread), model.reference_attitude(None))
    kept = [0, 1, 2, 3, 4, 6, 7]
    rates = np.array([rate, rate, rate, ROOT_RATE_VARIANCE_PX2, ROOT_RATE_VARIANCE_PX2, rate, rate])
    state = np.concatenate([mean[kept], np.zeros(len(kept)), mean[-model.LINKS :]])
    spread = np.concatenate([variances[kept], rates, variances[-model.LINKS :]])
    return from_moments(state, np.diag(spread), model.reference_attitude(reference))


def from_moments(mean: Floats, covariance: Floats, reference: Floats) -> model.Chain:
    """Return the Gaussian of moments (n,) and (n, n) in which omega is relative to the reference, a quaternion (4,).

    In space its own attitude takes omega over.
    """
    state, spread = contiguous_copy(mean), contiguous_copy(covariance)
    attitude = model.recentre(state, spread, contiguous_copy(reference))
    return model.Chain(state, spread, attitude)


SAME_ANGLE_RAD, SAME_LENGTH_PX = 0.05, 2.0
"""Hypotheses closer than this in all directions and lengths are one."""

LN_100 = 4.605170185988092

NO_MIRRORS = -1.0
DEVIATIONS_SHOWN = 2.0
"""Half the width of the box of what a Gaussian holds possible."""


@lru_cache(maxsize=64)
def constraints(parameters: LinkageTrackerParameters, in_space: bool) -> model.Constraints:
    """Return what is known of joints and lengths, on the coordinates of a state."""
    return model.in_coordinates(parameters.bounds.constraints(in_space=in_space), 17 if in_space else 9)


@lru_cache(maxsize=64)
def noise(parameters: LinkageTrackerParameters, in_space: bool) -> Floats:
    """Return the standard deviations (p,) of the accelerations of a pose, rad or px per frame^2."""
    turning, moving = float(parameters.acceleration_rad), float(parameters.root_acceleration_px)
    return np.array(
        [turning, turning, turning, moving, moving, turning, turning] if in_space else [turning] * model.LINKS
    )


def start(target: Target, frame: Frame, parameters: LinkageTrackerParameters, rng: Stream) -> LinkageState:
    """Begin at a pose and lengths that are roughly known; the next frame is the first one observed."""
    del frame, rng
    chain_there = LinkageTarget.of(target)
    angle, length = [parameters.start_angle_variance_rad2] * 3, [parameters.start_length_variance_px2] * 3
    moved = [*angle, *[parameters.start_root_variance_px2] * 2] if chain_there.is_spatial else []
    variances = np.array([*moved, *angle, *length])
    chain = gaussian(chain_there.numbers, variances, chain_there.reference, parameters)
    return state_of(Beam.of(chain), chain_there.reference, chain_there.origin_px)


def state_of(
    beam: Beam[model.Chain],
    reference: Floats | None,
    origin_px: Floats,
    log_evidence: float = 0.0,
    events: Events = NOTHING,
    innovation: NormalisedInnovation | None = None,
    seen_px: tuple[float, ...] = (),
) -> LinkageState:
    """Return the state of a beam.

    The estimate is the best member's. The box holds two deviations of all members that are at least a hundredth as
    probable; less probable ones may stay in a beam that has room, but do not count.
    """
    attitude = model.reference_attitude(reference)
    told = [model.describe(member.mean, member.covariance, member.attitude, attitude) for member in beam.members]
    mean, spread, directions, directions_sd = told[beam.best]
    believed = [told[k] for k in np.flatnonzero(beam.log_weights >= beam.log_weights.max() - LN_100)]
    lows = [estimate - DEVIATIONS_SHOWN * deviations for estimate, deviations, _, _ in believed]
    highs = [estimate + DEVIATIONS_SHOWN * deviations for estimate, deviations, _, _ in believed]
    low, high = np.min(lows, axis=0), np.max(highs, axis=0)
    return LinkageState(
        beam,
        mean,
        spread,
        low,
        high,
        directions,
        directions_sd,
        origin_px,
        reference,
        log_evidence,
        events,
        innovation,
        seen_px,
    )


def filter_step(
    method: str, state: LinkageState, frame: Frame, parameters: LinkageTrackerParameters, rng: Stream
) -> LinkageState:
    """Take one frame with a beam of extended filters.

    Args:
        method: "ekf", "ekf-truncated" or "ekf-mirrors".
        state: State of the frame before, from any tracker.
        frame: The observation.
        parameters: In force.
        rng: Not used.
    """
    del rng
    beam = chains(state, parameters)
    mirrors = method == "ekf-mirrors"
    places = list(range(len(beam))) if mirrors else [beam.best]
    members = [beam.members[place] for place in places]
    bounds = constraints(parameters, state.in_space)
    given = Filtering(
        model.read_observation(frame, state.origin_px, in_space=state.in_space),
        float(parameters.observation_variance_px2),
        noise(parameters, state.in_space),
        *bounds,
        constrained=method != "ekf",
        mirrors=float(parameters.mirror_tau) if mirrors else NO_MIRRORS,
        rejection=float(parameters.rejection_sd),
        rounds=int(parameters.linearisations),
    )
    found = candidates(
        np.stack([member.mean for member in members]),
        np.stack([member.covariance for member in members]),
        np.stack([member.attitude for member in members]),
        beam.log_weights[places],
        given,
    )
    count, last = len(members), len(found.scores)
    outlier = last > count and bool(found.distances[count:].min() > parameters.outlier_limit_sd)
    pool = range(count, last)
    if outlier or not np.any(found.scores[count:] > -np.inf):
        pool = range(count)
    poses = [tuple(pose) for pose in found.poses.tolist()]
    best = select_best(
        pool,
        found.scores[pool.start : pool.stop],
        found.parents[pool.start : pool.stop],
        parameters.beam_width if mirrors else 1,
        lambda one, other: _same(poses[one], poses[other]),
    )
    chosen = best.members
    following = tuple(model.Chain(found.means[k], found.covariances[k], found.attitudes[k]) for k in chosen)
    parents = np.array(places)[best.parents] if _has_chains(state) else np.full(len(chosen), -1)
    events = _events(found, chosen, poses, beam.log_weights[places], outlier=outlier)
    # If all leave an observation out, its distance from the nearest.
    told = chosen[0] if chosen[0] >= count else count + int(np.argmin(found.distances[count:])) if last > count else 0
    return state_of(
        Beam(following, best.log_weights, parents),
        state.reference,
        state.origin_px,
        float(found.log_evidences[chosen[0]]),
        events,
        NormalisedInnovation(float(found.distances[told]) ** 2, len(model.observed_rows(given.seen))) if told else None,
        tuple(given.seen[:, 0].tolist()),
    )


def _has_chains(state: LinkageState) -> bool:
    """Whether the members of a beam are Gaussians, which those of the next one can come from."""
    return isinstance(state.belief, Beam) and isinstance(state.belief.members[0], model.Chain)


def _same(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    """Whether two poses, directions and lengths, are one hypothesis."""
    return all(
        abs(a - b) < SAME_ANGLE_RAD for a, b in zip(one[: model.LINKS], other[: model.LINKS], strict=True)
    ) and all(abs(a - b) < SAME_LENGTH_PX for a, b in zip(one[model.LINKS :], other[model.LINKS :], strict=True))


def _events(
    found: Candidates,
    chosen: tuple[int, ...],
    poses: list[tuple[float, ...]],
    before: Floats,
    *,
    outlier: bool,
) -> Events:
    """Return the continuations of the previous frame's members, each as its first candidate.

    One was merged if that is not kept and is the same as one that is. It was refuted if it has become less than a
    hundredth as probable as the best, or is forbidden by bounds, and was not before: it may stay in the beam for a
    while, as long as there is room.

    Args:
        found: Predictions of the members, then candidates.
        chosen: Those that are kept, the best first.
        poses: Poses of all candidates.
        before: (K,) log weights of the members.
        outlier: Whether the observation was left out.
    """
    refuted = merges = 0
    best = found.scores[chosen[0]]
    for parent in range(len(before)) if chosen[0] >= len(before) else ():
        own = len(before) + int(np.argmax(found.parents[len(before) :] == parent))
        merged = own not in chosen and any(_same(poses[own], poses[k]) for k in chosen)
        merges += merged
        lost = found.scores[own] < best - LN_100 and before[parent] > before.max() - LN_100
        refuted += bool(lost) and not merged
    continued = {int(found.parents[k]) for k in chosen}
    cut = int(found.cuts[chosen[0]])
    return Events(len(chosen) - len(continued), merges, refuted, cut, outlier)


def unscented_step(
    state: LinkageState, frame: Frame, parameters: LinkageTrackerParameters, rng: Stream
) -> LinkageState:
    """Take one frame with an unscented filter, and cut what comes of it; arguments as for `filter_step`."""
    del rng
    beam = chains(state, parameters)
    chain = beam.members[beam.best]
    mean, covariance = predict(
        contiguous_copy(chain.mean), contiguous_copy(chain.covariance), noise(parameters, state.in_space)
    )
    seen = model.read_observation(frame, state.origin_px, in_space=state.in_space)
    rows = model.observed_rows(seen)
    log_evidence, cut, outlier, innovation = 0.0, 0, False, None
    if len(rows):
        spread, values = float(parameters.observation_variance_px2) * np.eye(len(rows)), seen[rows, 0]

        def observe(states: Floats) -> Floats:
            flat = model.project_all(contiguous_copy(states.reshape(-1, states.shape[-1])), chain.attitude, seen)
            return np.asarray(flat[:, rows].reshape(*states.shape[:-1], len(rows)))

        expected, covariances, _ = unscented.transform(mean[None], covariance[None], observe)
        whitened = solve_system(covariances[0] + spread, values - expected[0])
        innovation = NormalisedInnovation(float(((values - expected[0]) * whitened).sum()), len(rows))
        outlier = innovation.squared > parameters.outlier_limit_sd**2
        if not outlier:
            updated, log_evidence = unscented.update(Gaussian(mean, covariance), values, observe, spread)
            log_evidence += model.log_image_lengths(mean, chain.attitude, seen)
            mean, covariance = contiguous_copy(updated.mean), contiguous_copy(updated.covariance)
            cut = truncate(mean, covariance, (*constraints(parameters, state.in_space),))
    mean, covariance = contiguous_copy(mean), contiguous_copy(covariance)
    attitude = model.recentre(mean, covariance, chain.attitude)
    parents = np.full(1, beam.best if _has_chains(state) else -1)
    following = Beam((model.Chain(mean, covariance, attitude),), np.zeros(1), parents)
    events = Events(truncated=cut, outlier=outlier)
    return state_of(
        following,
        state.reference,
        state.origin_px,
        log_evidence,
        events,
        innovation,
        tuple(seen[:, 0].tolist()),
    )
