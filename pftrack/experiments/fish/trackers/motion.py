"""With which numbers particles are moved, by tracker and parameters."""

from functools import lru_cache

import numpy as np

from pftrack.experiments.fish.scene.edge_distance import Foreground
from pftrack.experiments.fish.shape import FishShape
from pftrack.experiments.fish.trackers.learned import GUIDANCE, LEARNED_HALF_LENGTH_PX
from pftrack.experiments.fish.trackers.loop import VELOCITY, Drawn, Weighing
from pftrack.experiments.fish.trackers.parameters import FishTrackerParameters
from pftrack.filters.learning.charts import WAYS

__all__ = ["draw", "foreground", "shape", "weighing"]


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
