"""The state of trackers of a fish that bends, one compiled frame of them, and what they know of its motion.

A frame draws parents, moves them, weighs them and estimates. The motions of the trackers (`step`) differ in a few
lines, and share everything else, so a comparison of two of them compares just that.

Source: Mitsugami et al. 2009.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import circular_mean, exponentials, less_turns, sines_cosines
from pftrack.core.numerics.matrices import inner_product
from pftrack.core.numerics.random import standard_normals
from pftrack.experiments.fish.model import FishShape, largest_distances, log_likelihoods
from pftrack.filters.learning.charts import HEADING, WORLD, Chart, advance
from pftrack.filters.learning.guidance import Guidance
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.filters.resampling import parents

COORDINATES = ("a", "b", "along", "across", "theta", "phi")
"""Of a particle: place in px, velocity along and across the body in px/frame, heading and bend in rad."""

UNITS = ("px", "px", "px/frame", "px/frame", "rad", "rad")
"""Of them."""


@dataclass(frozen=True, slots=True)
class FishState:
    """The posterior of one frame, immutable; all trackers carry the same, so that they take over from each other.

    Attributes:
        particles: (N, 6) states, see `COORDINATES`.
        changes: (N, 3) since each one's parent: gain of the velocity across the body, px/frame, turn and bend, rad.
        mean: (6,) of the posterior; the mean heading is on the circle, within half a turn of 0.
        spread: (4,) standard deviations of the pose, px and rad.
        distance: d_max of the particle with the greatest weight, px.
        log_evidence: Up to the constant that the likelihood leaves out.
    """

    particles: ParticleSet
    changes: Floats
    mean: Floats
    spread: Floats
    distance: float
    log_evidence: float = 0.0

    @property
    def estimate(self) -> Floats:
        """(2,) posterior mean of the centre of the body, px."""
        return self.mean[:2]

    @property
    def sigma(self) -> Floats:
        """(2,) posterior standard deviations of the same, px."""
        return self.spread[:2]

    @property
    def pose(self) -> Floats:
        """(4,) posterior mean (a, b, theta, phi), px and rad."""
        return self.mean[[0, 1, 4, 5]]

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        particles = self.particles
        arrays = (particles.states, particles.ancestors, self.changes)
        return 1024 + 2 * particles.log_weights.nbytes + sum(array.nbytes for array in arrays)

    def arrays(self) -> Mapping[str, Floats]:
        """Return states and log weights of the particles."""
        return {"states": self.particles.states, "log_weights": self.particles.log_weights}


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
    mean: Floats
    root: Floats
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
    """Return the particles of a frame and what they come to.

    Args:
        distances: As of `pftrack.experiments.fish.model.Edges`.
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
    # The velocity is kept in the body's frame, for who goes on from here with another motion.
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


# `learned.json` is written by `pftrack reproduce fish-offline --full --figures FOLDER` from the twenty tracks of clips
# 100 to 109 that the ordinary filter followed with 3,000 particles and wide noise. It holds the estimates' noise along
# with the fish's motion, and that is meant: else there is no room for rare, violent turns.

FISH = Chart(place=("a", "b"), heading="theta", angles=("phi",))
"""Of a recorded state: the centre of the body, its heading, and the bend of the tail."""

LEARNED_HALF_LENGTH_PX = 40.0
"""Semi-axis of the fish that was learned from; lengths are scaled from it to the fish that is followed."""

GUIDANCE = Guidance(
    experiment="fish",
    chart=FISH,
    built_in=Path(__file__).with_name("learned.json").read_text(encoding="utf-8"),
    series="body",
)
