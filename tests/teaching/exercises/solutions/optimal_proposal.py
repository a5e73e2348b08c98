"""A particle filter whose proposal sees the measurement."""

import numpy as np

EXERCISE = "optimal-proposal"


def log_normal(off, variance):
    return -0.5 * off**2 / variance - 0.5 * np.log(2 * np.pi * variance)


def propose(states, frame, parameters, rng):
    moving, measuring = parameters.process_noise_sd**2, parameters.assumed_noise_sd**2
    predicted = 2 * states[:, 0] - states[:, 1]
    variance = 1 / (1 / moving + 1 / measuring)
    mean = variance * (predicted / moving + frame.signal[0] / measuring)
    moved = mean + np.sqrt(variance) * rng.standard_normal(len(states))
    correction = log_normal(moved - predicted, moving) - log_normal(moved - mean, variance)
    return np.stack([moved, states[:, 0]], axis=1), correction


def log_likelihood(states, frame, parameters):
    return log_normal(frame.signal[0] - states[:, 0], parameters.assumed_noise_sd**2)
