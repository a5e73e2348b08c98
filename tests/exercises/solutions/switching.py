"""A particle filter that switches between two noises."""

import numpy as np

EXERCISE = "switching"


def propagate(states, frame, parameters, rng):
    image = frame.image_rgb.astype(float)
    red = image[:, :, 0] > 0.5 * image.sum(axis=2)
    now, before = states[:, :2], states[:, 2:]
    columns, rows = np.rint(now[:, 0]).astype(int), np.rint(now[:, 1]).astype(int)
    height, width = red.shape
    reach = 30
    u, v = np.median(columns).astype(int), np.median(rows).astype(int)
    near = red[max(v - reach, 0) : max(v + reach, 0), max(u - reach, 0) : max(u + reach, 0)]
    noise = parameters.process_noise_px if near.any() else parameters.large_process_noise_px
    moved = now + (now - before) + noise * rng.standard_normal(now.shape)
    return np.hstack([moved, now])
