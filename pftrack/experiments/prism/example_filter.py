"""Bootstrap filter of mine.

Every function may be left out; pftrack's own then takes its place. Each gets those of its arguments that it names.
Save this file while a session runs: it goes on with the new code from the frame where it stands.
"""

from dataclasses import dataclass

import numpy as np

EXPERIMENT = "prism"  # whose target it follows


@dataclass
class Parameters:
    """Sliders; those with the name of one of the prism's parameters, such as joint_sample_count, are these."""

    joint_sample_count: int = 25000
    turn_deg: float = 2.0  # how far each angle may turn in a frame, as a standard deviation
    move_mm: float = 0.3  # how far the prism may move along each axis in a frame, as a standard deviation


def propagate(states, parameters, rng):
    """Move states (N, 6): theta x, y and z, rad, and where the prism is in the camera's frame, x, y and z, mm."""
    spread = np.repeat([np.deg2rad(parameters.turn_deg), parameters.move_mm], 3)
    return states + spread * rng.standard_normal(states.shape)


def log_likelihood(states, frame, project):
    """Return log p(vertices | state), (N,), up to a constant; project(states) is where they are seen, (8, N, 2) px."""
    measured = frame.measurements  # points_px (8, 2), and sd_px (8,), large while a vertex is hidden
    off = (project(states) - measured.points_px[:, None]) / measured.sd_px[:, None, None]
    return -0.5 * np.sum(off**2, axis=(0, 2))


def resample(log_weights, count, rng):
    """Return the places (count,) of the parents, particle n on average count times its weight."""
    reached = np.cumsum(np.exp(log_weights))
    return np.searchsorted(reached / reached[-1], (rng.random() + np.arange(count)) / count)
