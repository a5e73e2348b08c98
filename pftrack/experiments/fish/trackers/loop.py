"""One frame of a tracker of a fish, compiled: draw parents, move them, weigh them, estimate.

The motions differ in a few lines, and share everything else, so a comparison of two of them compares just that.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.angles import circular_mean, less_turns
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.random import standard_normals
from pftrack.core.numerics.sums import inner_product
from pftrack.core.numerics.trigonometry import sines_cosines
from pftrack.experiments.fish.scene.edge_distance import largest_distances, log_likelihoods
from pftrack.experiments.fish.shape import FishShape
from pftrack.filters.learning.charts import HEADING, WORLD, advance
from pftrack.filters.particles import normalise
from pftrack.filters.resampling import parents

__all__ = ["ORDINARY", "VELOCITY", "Cloud", "Drawn", "Weighing", "frame_step"]

ORDINARY, VELOCITY = 100, 101
"""Motions beside those of `pftrack.filters.learning.charts`: a random walk (eq. 8), and constant velocity (eq. 9)."""

TRACK = 1
"""Purpose.TRACK, as compiled code needs it."""


class Drawn(NamedTuple):
    """How particles are moved.

    Attributes:
        motion: ORDINARY, VELOCITY, or one of the ways of `pftrack.filters.learning.charts`.
        mean: (4,) of what is drawn: steps or accelerations of the place, then of heading and bend.
        root: (4, 4) lower triangular root of its covariance.
        sample_count: How many particles.
    """

    motion: int
    mean: NDArray[np.float64]
    root: NDArray[np.float64]
    sample_count: int


class Weighing(NamedTuple):
    """How particles are weighed: the shape, sigma_d in px^2, and whether the bend is limited."""

    shape: FishShape
    sigma_d: float
    limited: bool


class Cloud(NamedTuple):
    """What comes of a frame.

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

    states: NDArray[np.float64]
    log_weights: NDArray[np.float64]
    ancestors: NDArray[np.int64]
    changes: NDArray[np.float64]
    mean: NDArray[np.float64]
    sigma: NDArray[np.float64]
    distance: float
    log_evidence: float


@compiled
def frame_step(
    distances: NDArray[np.uint8],
    states: NDArray[np.float64],
    log_weights: NDArray[np.float64],
    drawn: Drawn,
    weighing: Weighing,
    seed: int,
    frame: int,
) -> Cloud:
    """Return the particles of a frame and what they come to.

    Args:
        distances: As of `pftrack.experiments.fish.scene.edge_distance.Edges`.
        states: (N, 6) of the frame before, each coordinate together in memory.
        log_weights: (N,) of the frame before.
        drawn: How they are moved.
        weighing: How they are weighed.
        seed: Of the run.
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
def _walk(
    states: NDArray[np.float64], ancestors: NDArray[np.int64], normals: NDArray[np.float64], drawn: Drawn
) -> NDArray[np.float64]:
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
    # The velocity is kept in the body's frame, for who goes on from here with another motion.
    sines, cosines = sines_cosines(moved[4])
    for n in range(count):
        x, y = moved[2, n], moved[3, n]
        moved[2, n], moved[3, n] = cosines[n] * x + sines[n] * y, cosines[n] * y - sines[n] * x
    return moved.T


@compiled
def _mean(states: NDArray[np.float64], weights: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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
