"""The trackers of a fish by name: the ordinary filter, constant velocity, and the filter guided by learned changes."""

from collections.abc import Mapping
from functools import lru_cache, partial

import numpy as np
from typing_extensions import override

from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Amount, Component, Part
from pftrack.core.model.model import Model, State, Values
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.random import Stream
from pftrack.experiments.fish.model import (
    CAP_PX,
    Edges,
    FishShape,
    Foreground,
    edges_of,
    largest_distances,
    log_likelihoods,
)
from pftrack.experiments.fish.parameters import FishTrackerParameters
from pftrack.experiments.fish.scene import FishTarget
from pftrack.experiments.fish.trackers import (
    COORDINATES,
    GUIDANCE,
    LEARNED_HALF_LENGTH_PX,
    ORDINARY,
    UNITS,
    VELOCITY,
    Drawn,
    FishState,
    Weighing,
    frame_step,
)
from pftrack.experiments.shared import reports
from pftrack.filters.learning.charts import WAYS, body_velocity
from pftrack.filters.particles import ParticleSet


@lru_cache(maxsize=64)
def draw(motion: int | None, parameters: FishTrackerParameters) -> Drawn:
    """Return how a tracker moves its particles.

    The random walk takes mean and standard deviation of the learned steps (eq. 8). With constant velocity it is the
    velocity that walks: its steps are the learned accelerations, the same along both axes of the picture. The guided
    filter draws all four changes together (eq. 18), without their mean.

    Args:
        motion: ORDINARY, VELOCITY, or None for the guided filter, whose motion is that of its reading.
        parameters: In force.
    """
    learned = GUIDANCE.parse(parameters.learned)
    scale, count = float(parameters.diffusion_scale), parameters.sample_count
    lengths = np.array([shape(parameters).half_length / LEARNED_HALF_LENGTH_PX] * 2 + [1.0, 1.0])
    guided = learned.diffusion(parameters.motion_reading, scale=scale, correlated=parameters.correlated_changes)
    if motion is None:
        return Drawn(WAYS[parameters.motion_reading], lengths * guided.mean, lengths[:, None] * guided.root, count)
    mean, sd = np.zeros(4), scale * np.array(learned.step_sd)
    if motion == VELOCITY:
        sd[:2] = np.sqrt(np.square(guided.sd[:2]).mean())
    elif parameters.walk_steps == "wide":
        turn = np.deg2rad(parameters.wide_deg)
        sd = scale * np.array([parameters.wide_px, parameters.wide_px, turn, turn])
    else:
        mean = np.array(learned.step_mean)
    return Drawn(motion, lengths * mean, np.diag(lengths * sd), count)


def shape(parameters: FishTrackerParameters) -> FishShape:
    """Return the shape of the fish that is followed."""
    lengths = (parameters.half_length_px, parameters.half_width_px, parameters.tail_length_px)
    return FishShape(*map(float, lengths))


def weighing(parameters: FishTrackerParameters) -> Weighing:
    """Return how particles are weighed."""
    return Weighing(shape(parameters), float(parameters.sigma_d_px2), parameters.bend_limited)


def foreground(parameters: FishTrackerParameters) -> Foreground:
    """Return how the fish is told from the rest."""
    return Foreground(
        parameters.foreground,
        parameters.lowest_hue,
        parameters.highest_hue,
        parameters.saturation_low,
        parameters.value_low,
        parameters.least_contrast,
        parameters.contrast_radius_px,
    )


SERIES = (
    *reports.CLOUD,
    Series("body", "place, heading and bend", shape="vector", components=("a", "b", "theta", "phi")),
    Series("heading", "heading", "°"),
    Series("bend", "bend of the tail", "°"),
    Series("heading_sd", "deviation of the heading", "°"),
    Series("bend_sd", "deviation of the bend", "°"),
    Series("velocity", "velocity along and across the body", "px/frame", "vector", components=("along", "across")),
    Series("d_max", "farthest point from an edge", "px"),
)
"""What all of them report. `body` is what is learned from: px, px, rad, rad; the heading is within half a turn of 0."""


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


def step(
    motion: int | None, state: FishState, frame: Frame, parameters: FishTrackerParameters, rng: Stream
) -> FishState:
    """Take one frame."""
    return step_frame(motion, state, find_edges(frame, parameters), parameters, rng.seed, rng.frame)


def find_edges(frame: Frame, parameters: FishTrackerParameters) -> Edges:
    """Return the edges of what has the fish's colour in a frame.

    Raises:
        ValueError: The frame has no picture.
    """
    return edges_of(frame.picture, foreground(parameters))


def step_frame(
    motion: int | None, state: FishState, edges: Edges, parameters: FishTrackerParameters, seed: int, frame: int
) -> FishState:
    """Take one frame of which the edges are known.

    Args:
        motion: ORDINARY, VELOCITY, or None for the guided filter.
        state: Of the frame before.
        edges: Of the frame.
        parameters: In force.
        seed: Of the run.
        frame: Index of the frame.
    """
    particles = state.particles
    cloud = frame_step(
        edges.distances,
        np.asfortranarray(particles.states),
        particles.log_weights,
        draw(motion, parameters),
        weighing(parameters),
        seed,
        frame,
    )
    following = ParticleSet(cloud.states, cloud.log_weights, cloud.ancestors)
    return FishState(following, cloud.changes, cloud.mean, cloud.sigma, cloud.distance, cloud.log_evidence)


def measure(state: FishState) -> Mapping[str, SeriesValue]:
    """Report particles, pose, velocity and fit; a fit at the cap means that there is no edge anywhere near."""
    a, b, along, across, theta, phi = state.mean.tolist()
    return {
        **reports.cloud(state.particles, resampled=True),
        "body": (a, b, theta, phi),
        "heading": float(np.rad2deg(theta)),
        "bend": float(np.rad2deg(phi)),
        "heading_sd": float(np.rad2deg(state.spread[2])),
        "bend_sd": float(np.rad2deg(state.spread[3])),
        "velocity": (along, across),
        "d_max": min(state.distance, float(CAP_PX)),
    }


class Outline(Model):
    """How well the outline of a fish lies on the edges of the picture."""

    title = "outline beside the edges"
    evidence = "relative"

    @override
    def components(self, parameters: Values) -> tuple[Component, ...]:
        return tuple(map(Component, COORDINATES, UNITS))

    @override
    def log_likelihood(self, states: Floats, frame: Frame, parameters: FishTrackerParameters, known: State) -> Floats:
        weighed, laid = weighing(parameters), np.asfortranarray(states)
        largest = largest_distances(find_edges(frame, parameters).distances, laid, weighed.shape)
        return np.asarray(log_likelihoods(largest, laid, weighed.sigma_d, weighed.limited))

    @override
    def centre(self, state: FishState) -> Floats:
        return state.mean

    @override
    def parts(self, one: Floats, frame: Frame, parameters: FishTrackerParameters, known: State) -> tuple[Part, ...]:
        """Return how far the worst point of the outline is from an edge."""
        laid = np.asfortranarray(one[None])
        (largest,) = largest_distances(find_edges(frame, parameters).distances, laid, weighing(parameters).shape)
        return (Amount("farthest point from an edge", float(largest) / 4.0, "px"),)


MODEL = Outline()


def _tracker(name: str, title: str, description: str, motion: int | None) -> Tracker:
    return Tracker(
        name,
        title,
        description,
        start,
        partial(step, motion),
        series=SERIES,
        measure=measure,
        model=MODEL,
        sampling="prior",
    )


TRACKERS = {
    tracker.id: tracker
    for tracker in (
        _tracker(
            "guided",
            "Guided diffusion",
            "Carries the velocity in the body's frame, and changes motion and shape together, as was learned.",
            None,
        ),
        _tracker(
            "ordinary",
            "Ordinary filter",
            "Moves every number of the state by a random step of its own.",
            ORDINARY,
        ),
        _tracker(
            "constant-velocity",
            "Constant velocity",
            "Keeps the velocity in the picture, and changes every number by itself.",
            VELOCITY,
        ),
    )
}
"""All trackers by name, in the order in which they are shown."""

MOTIONS: dict[str, int | None] = {"guided": None, "ordinary": ORDINARY, "constant-velocity": VELOCITY}
"""Their motions, as `step_frame` takes them."""
