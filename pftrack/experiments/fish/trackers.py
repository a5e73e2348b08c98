"""The trackers of a fish by name: the ordinary filter, constant velocity, and the filter guided by learned changes.

A frame draws parents, moves them, weighs them and estimates, compiled as a whole. The trackers differ only in a few
lines on motion, so a comparison of two of them compares only that.

Source: Mitsugami et al. 2009.
"""

from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import circular_mean, exponentials, less_turns, sines_cosines
from pftrack.core.numerics.matrices import inner_product
from pftrack.core.numerics.random import Stream, standard_normals
from pftrack.experiments.fish.model import (
    GOLDFISH,
    MODEL,
    SERIES,
    Edges,
    FishState,
    Weighing,
    find_edges,
    largest_distances,
    log_likelihoods,
    shape,
    weighing,
)
from pftrack.experiments.fish.parameters import GUIDANCE, FishTrackerParameters
from pftrack.experiments.fish.scene import FishTarget
from pftrack.filters.learning.charts import HEADING, WAYS, WORLD, advance, body_velocity
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.filters.resampling import parents

ORDINARY, VELOCITY = 100, 101
"""Motions in addition to those of `pftrack.filters.learning.charts`: a random walk (eq. 8), and constant velocity (eq.
9)."""

TRACK = 1
"""Purpose.TRACK, as compiled code needs it."""


class Drawn(NamedTuple):
    """How particles are moved.

    Attributes:
        motion: ORDINARY, VELOCITY, or one of the ways of `pftrack.filters.learning.charts`.
        mean: (4,) mean of the drawn steps or accelerations of the place, then of heading and bend.
        root: (4, 4) lower triangular root of its covariance.
        sample_count: How many particles.
    """

    motion: int
    mean: Floats
    root: Floats
    sample_count: int


class Cloud(NamedTuple):
    """The result of a frame.

    Attributes:
        states: (N, 6), each coordinate together in memory.
        log_weights: (N,) normalised.
        ancestors: (N,).
        changes: (N, 3) of the velocity across the body, the heading and the bend since the parent.
        mean: (6,).
        sigma: (4,) of the pose, px and rad.
        distance: d_max of the heaviest particle, px.
        log_evidence: Log of the mean of the weights.
    """

    states: Floats
    log_weights: Floats
    ancestors: Ints
    changes: Floats
    mean: Floats
    sigma: Floats
    distance: float
    log_evidence: float


@compiled
def frame_step(
    distances: NDArray[np.uint8],
    states: Floats,
    log_weights: Floats,
    drawn: Drawn,
    weighing: Weighing,
    seed: int,
    frame: int,
) -> Cloud:
    """Return the particles of a frame and their estimate.

    Args:
        distances: As in `Edges`.
        states: (N, 6) of the frame before, each coordinate together in memory.
        log_weights: (N,) of the frame before.
        drawn: How they are moved.
        weighing: How they are weighed.
        seed: Seed of the run.
        frame: Index of the frame.
    """
    count = drawn.sample_count
    ancestors = parents(0, log_weights, count, seed, frame, TRACK, 0)
    normals = standard_normals(seed, frame, TRACK, 1, 4 * count).reshape(4, count)
    if drawn.motion in (HEADING, WORLD):
        moved = advance(states, ancestors, normals, drawn.root, drawn.mean, 2, drawn.motion)
    else:
        moved = _walk(states, ancestors, normals, drawn)
    changes = np.empty((3, count))
    for n in range(count):
        for i in range(3):
            changes[i, n] = moved[n, 3 + i] - states[ancestors[n], 3 + i]
    largest = largest_distances(distances, moved, weighing.shape)
    likelihoods = log_likelihoods(largest, moved, weighing.sigma_d, weighing.limited)
    weights, log_sum = normalise(likelihoods)
    mean, sigma = _mean(moved, exponentials(weights))
    distance = largest[np.argmax(weights)] / 4.0
    return Cloud(moved, weights, ancestors, changes.T, mean, sigma, distance, log_sum - np.log(count))


@compiled
def _walk(states: Floats, ancestors: Ints, normals: Floats, drawn: Drawn) -> Floats:
    """Return the ancestors moved in the picture's frame: by a step that is drawn, or by a velocity that is changed."""
    count = drawn.sample_count
    moved = np.empty((6, count))
    for n in range(count):
        parent = ancestors[n]
        theta = states[parent, 4]
        x, y = drawn.mean[0] + drawn.root[0, 0] * normals[0, n], drawn.mean[1] + drawn.root[1, 1] * normals[1, n]
        if drawn.motion == VELOCITY:
            cosine, sine = np.cos(theta), np.sin(theta)
            along, across = states[parent, 2], states[parent, 3]
            x, y = x + cosine * along - sine * across, y + sine * along + cosine * across
        moved[0, n], moved[1, n] = states[parent, 0] + x, states[parent, 1] + y
        moved[4, n] = theta + drawn.mean[2] + drawn.root[2, 2] * normals[2, n]
        moved[5, n] = states[parent, 5] + drawn.mean[3] + drawn.root[3, 3] * normals[3, n]
        moved[2, n], moved[3, n] = x, y
    # The velocity is kept in the body's frame, for trackers that continue with another motion.
    sines, cosines = sines_cosines(moved[4])
    for n in range(count):
        x, y = moved[2, n], moved[3, n]
        moved[2, n], moved[3, n] = cosines[n] * x + sines[n] * y, cosines[n] * y - sines[n] * x
    return moved.T


@compiled
def _mean(states: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Return the mean (6,), that of the heading on the circle, and standard deviations (4,) of place and angles."""
    count = states.shape[0]
    mean, sigma = np.empty(6), np.empty(4)
    for i in range(6):
        if i != 4:
            mean[i] = inner_product(weights, states[:, i].copy())
    mean[4] = circular_mean(states[:, 4].copy(), weights)
    off = np.empty(count)
    for i in range(4):
        column = i if i < 2 else i + 2
        for n in range(count):
            off[n] = states[n, column] - mean[column]
            if column == 4:
                off[n] = less_turns(off[n])
            off[n] *= off[n]
        sigma[i] = np.sqrt(inner_product(weights, off))
    return mean, sigma


@lru_cache(maxsize=64)
def draw(tracker: str, parameters: FishTrackerParameters) -> Drawn:
    """Return how a tracker moves its particles.

    The random walk takes mean and standard deviation of the learned steps (eq. 8). With constant velocity the velocity
    walks: its steps are the learned accelerations, the same along both axes of the picture. The guided filter draws all
    four changes together (eq. 18), without their mean.

    Args:
        tracker: Its name.
        parameters: In force.
    """
    learned = GUIDANCE.parse(parameters.learned)
    scale, count = float(parameters.diffusion_scale), parameters.sample_count
    lengths = np.array([shape(parameters).half_length / GOLDFISH.half_length] * 2 + [1.0, 1.0])
    guided = learned.diffusion(parameters.motion_reading, scale=scale, correlated=parameters.correlated_changes)
    if tracker == "guided":
        return Drawn(WAYS[parameters.motion_reading], lengths * guided.mean, lengths[:, None] * guided.root, count)
    mean, sd = np.zeros(4), scale * np.array(learned.step_sd)
    if tracker == "constant-velocity":
        sd[:2] = np.sqrt(np.square(guided.sd[:2]).mean())
    elif parameters.walk_steps == "wide":
        turn = np.deg2rad(parameters.wide_deg)
        sd = scale * np.array([parameters.wide_px, parameters.wide_px, turn, turn])
    else:
        mean = np.array(learned.step_mean)
    return Drawn(VELOCITY if tracker == "constant-velocity" else ORDINARY, lengths * mean, np.diag(lengths * sd), count)


def start(target: Target, frame: Frame, parameters: FishTrackerParameters, rng: Stream) -> FishState:
    """Begin at a known pose with a known velocity: all particles are there."""
    del frame, rng
    if not isinstance(target, FishTarget):
        raise TypeError(f"a tracker of fish begins at the pose of one, got {type(target).__name__}")
    return begin_at(target, parameters.sample_count)


def begin_at(target: FishTarget, count: int) -> FishState:
    """Return the state of frame 0: `count` particles, all of them at the truth."""
    heading = float(np.remainder(target.theta + np.pi, 2.0 * np.pi) - np.pi)
    one = np.concatenate([target.position, body_velocity(target.velocity, heading), (heading, target.phi)])
    particles = ParticleSet.uniform(np.asfortranarray(np.tile(one, (count, 1))))
    return FishState(particles, np.zeros((count, 3)), one, np.zeros(4), 0.0)


def _step(tracker: str, state: FishState, frame: Frame, parameters: FishTrackerParameters, rng: Stream) -> FishState:
    return step_frame(tracker, state, find_edges(frame, parameters), parameters, rng.seed, rng.frame)


def step_frame(
    tracker: str, state: FishState, edges: Edges, parameters: FishTrackerParameters, seed: int, frame: int
) -> FishState:
    """Take one frame, given its edges.

    Args:
        tracker: Its name.
        state: State of the frame before.
        edges: Edges of the frame.
        parameters: In force.
        seed: Seed of the run.
        frame: Index of the frame.
    """
    particles = state.particles
    cloud = frame_step(
        edges.distances,
        np.asfortranarray(particles.states),
        particles.log_weights,
        draw(tracker, parameters),
        weighing(parameters),
        seed,
        frame,
    )
    following = ParticleSet(cloud.states, cloud.log_weights, cloud.ancestors)
    return FishState(following, cloud.changes, cloud.mean, cloud.sigma, cloud.distance, cloud.log_evidence)


TRACKERS = {
    name: Tracker(
        name, start, partial(_step, name), series=SERIES, measure=MODEL.measure, model=MODEL, sampling="prior"
    )
    for name in ("guided", "ordinary", "constant-velocity")
}
"""All trackers by name, in the order in which they are shown."""
