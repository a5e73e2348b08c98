"""Bootstrap filter of mine.

Every function may be left out; pftrack's own then takes its place. Each gets those of its arguments that it names.
Save this file while a session runs: it goes on with the new code from the frame where it stands.
"""

from dataclasses import dataclass

import numpy as np

EXPERIMENT = "histogram"  # whose target it follows


@dataclass
class Parameters:
    """Sliders; those with the name of one of the window's parameters, such as sample_count, are these."""

    sample_count: int = 500
    step_px: float = 4.0  # how far a particle moves beyond its velocity, as a standard deviation
    turn_px: float = 1.0  # how much its velocity changes in a frame, as a standard deviation


def propagate(states, parameters, rng):
    """Move states (N, 5), whose columns are u, v, px, the velocity of both, px/frame, and the logarithm of the size."""
    places, velocities, size = states[:, :2], states[:, 2:4], states[:, 4:]
    places = places + velocities + parameters.step_px * rng.standard_normal(places.shape)
    velocities = velocities + parameters.turn_px * rng.standard_normal(velocities.shape)
    return np.hstack([places, velocities, size])


# The likelihood is pftrack's: how like the model the colours of the window are. Write log_likelihood(states, frame,
# parameters) to weigh by something else that you see in frame.image_rgb, (height, width, 3), 0 to 255.


def should_resample(log_weights):
    """Return whether parents are drawn in this frame: if the effective sample size is below half of all particles."""
    weights = np.exp(log_weights)
    return 1.0 / np.sum(weights**2) < 0.5 * len(weights)


def resample(log_weights, count, rng):
    """Return the places (count,) of the parents, particle n on average count times its weight."""
    reached = np.cumsum(np.exp(log_weights))
    return np.searchsorted(reached / reached[-1], (rng.random() + np.arange(count)) / count)
