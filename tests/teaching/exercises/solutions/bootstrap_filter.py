"""A bootstrap filter for a signal in noise."""

import numpy as np

EXERCISE = "bootstrap-filter"


def propagate(states, parameters, rng):
    newest, before = np.split(states, 2, axis=1)
    moved = 2 * newest - before + parameters.process_noise_sd * rng.standard_normal(newest.shape)
    return np.hstack([moved, newest])


def log_likelihood(states, frame, parameters):
    noise = parameters.assumed_noise_sd
    off = (frame.signal - states[:, : len(frame.signal)]) / noise
    return np.sum(-0.5 * off**2 - np.log(noise * np.sqrt(2 * np.pi)), axis=1)
