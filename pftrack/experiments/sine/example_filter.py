"""Bootstrap filter of mine.

Every function may be left out; pftrack's own then takes its place. Each gets those of its arguments that it names.
Save this file while a session runs: it goes on with the new code from the frame where it stands.
"""

from dataclasses import dataclass

import numpy as np

EXPERIMENT = "sine"  # whose target it follows


@dataclass
class Parameters:
    """Sliders; those with the name of one of the signal's parameters, such as sample_count, are these."""

    sample_count: int = 100
    step_sd: float = 0.001  # what the motion leaves out in a frame, as a standard deviation
    noise_sd: float = 0.1  # of what is measured, as a standard deviation


def propagate(states, parameters, rng):
    """Move states (N, 2 d): the d newest values, then the d values before; return the new ones."""
    newest, before = np.split(states, 2, axis=1)
    moved = 2 * newest - before + parameters.step_sd * rng.standard_normal(newest.shape)
    return np.hstack([moved, newest])


def log_likelihood(states, frame, parameters):
    """Return log p(signal | state), (N,), up to a constant; frame.signal is (d,), not finite where it is missing."""
    if not np.isfinite(frame.signal).all():
        return np.zeros(len(states))
    off = states[:, : len(frame.signal)] - frame.signal
    return -0.5 * np.sum((off / parameters.noise_sd) ** 2, axis=1)


def resample(log_weights, count, rng):
    """Return the places (count,) of the parents, particle n on average count times its weight."""
    reached = np.cumsum(np.exp(log_weights))
    return np.searchsorted(reached / reached[-1], (rng.random() + np.arange(count)) / count)
