"""An auxiliary particle filter for a signal in noise."""

import numpy as np

EXERCISE = "auxiliary-filter"


def log_normal(off, variance):
    return -0.5 * off**2 / variance - 0.5 * np.log(2 * np.pi * variance)


def step(states, log_weights, count, frame, parameters, rng):
    moving, measuring = parameters.process_noise_sd**2, parameters.assumed_noise_sd**2
    predicted = 2 * states[:, 0] - states[:, 1]
    fits = log_normal(frame.signal[0] - predicted, moving + measuring)
    first = log_weights + fits
    top = first.max()
    reached = np.cumsum(np.exp(first - top))
    log_sum = top + np.log(reached[-1])
    parents = np.searchsorted(reached / reached[-1], (rng.random() + np.arange(count)) / count)
    variance = 1 / (1 / moving + 1 / measuring)
    mean = variance * (predicted[parents] / moving + frame.signal[0] / measuring)
    moved = mean + np.sqrt(variance) * rng.standard_normal(count)
    return np.stack([moved, states[parents, 0]], axis=1), np.full(count, log_sum - np.log(count)), parents
