"""Bootstrap filter of mine.

Every function may be left out; pftrack's own then takes its place. Each gets those of its arguments that it names.
Save this file while a session runs: it goes on with the new code from the frame where it stands.
"""

from dataclasses import dataclass

import numpy as np

EXPERIMENT = "ball"  # whose target it follows


@dataclass
class Parameters:
    """Sliders; those with the name of one of the ball's parameters, such as sample_count, are these."""

    sample_count: int = 800
    noise_px: float = 3.0  # how far a particle moves beyond its velocity, as a standard deviation
    redness: float = 0.67  # share of red in the colour of the ball
    tolerance: float = 0.05  # by how much the share of red may be off


def propagate(states, parameters, rng):
    """Move states (N, 4), whose columns are u, v, u before and v before, px; return the new ones."""
    now, before = states[:, :2], states[:, 2:]
    moved = now + (now - before) + parameters.noise_px * rng.standard_normal(now.shape)
    return np.hstack([moved, now])


def log_likelihood(states, frame, parameters):
    """Return log p(picture | state), (N,), up to a constant: is the pixel under the particle as red as the ball?"""
    image = frame.image_rgb  # (height, width, 3), 0 to 255; u counts its columns, v its rows
    height, width, _ = image.shape
    columns, rows = np.rint(states[:, 0]).astype(int), np.rint(states[:, 1]).astype(int)
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    colour = image[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)].astype(float)
    red = colour[:, 0] / np.maximum(colour.sum(axis=1), 1.0)
    match = np.exp(-0.5 * ((red - parameters.redness) / parameters.tolerance) ** 2)
    return np.log(0.02 + 0.98 * np.where(inside, match, 0.0))  # any pixel may be the ball's, but hardly


def resample(log_weights, rng):
    """Return the places (N,) of the parents, particle n on average N times its weight, which sum to one."""
    count = len(log_weights)
    reached = np.cumsum(np.exp(log_weights))
    return np.searchsorted(reached / reached[-1], (rng.random() + np.arange(count)) / count)
