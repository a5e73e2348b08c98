"""Resampling when the effective sample size calls for it; by residuals, for a change."""

import numpy as np

EXERCISE = "adaptive-resampling"


def should_resample(log_weights):
    return 1 / np.sum(np.exp(log_weights) ** 2) < len(log_weights) / 2


def resample(log_weights, count, rng):
    weights = np.exp(log_weights)
    expected = count * weights / weights.sum()
    whole = np.floor(expected + 1e-12).astype(int)
    sure = np.repeat(np.arange(len(weights)), whole)
    rest = np.maximum(expected - whole, 0)
    left = count - len(sure)
    if left == 0:
        return sure
    reached = np.cumsum(rest)
    return np.append(sure, np.searchsorted(reached / reached[-1], rng.random(left), side="right"))
