"""What the camera sees of the simulated hand: a silhouette whose edge is a little off, before a dark background.

The distance of each pixel from the silhouette's edge, positive inside, is taken together with smooth noise, and where
the sum is above 0 the hand is seen. So the edge moves by the noise, and what is thin stays whole.
"""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.elementary import exponential
from pftrack.core.numerics.random import Purpose, Stream

__all__ = ["paint_silhouette", "with_noisy_edge"]

HAND, BACKGROUND = (224, 172, 138), (16, 20, 24)
"""RGB. Any threshold of brightness between 25 and 175 tells them apart."""

SMOOTH_PX = 2.0
"""Standard deviation of the Gaussian by which the edge's noise is smoothed."""
REACH_PX = 6

EDGE, PIXELS = 0, 1
"""Draws of a frame."""


def with_noisy_edge(mask: NDArray[np.bool_], noise_px: float, seed: int, frame: int) -> NDArray[np.bool_]:
    """Return a silhouette (height, width) whose edge has moved.

    Args:
        mask: (height, width).
        noise_px: Standard deviation of how far it moves.
        seed: Of the run.
        frame: Of the frame.
    """
    if noise_px <= 0.0:
        return mask
    inside, outside = (
        cv2.distanceTransform(side.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE) for side in (mask, ~mask)
    )
    # The edge runs between the pixels, half a pixel from the centres on either side.
    distance = np.where(mask, inside - np.float32(0.5), np.float32(0.5) - outside)
    near = np.abs(distance) < 5.0 * noise_px
    return np.asarray(np.where(near, distance + noise_px * _smooth_noise(mask.shape, seed, frame), distance) > 0.0)


def paint_silhouette(mask: NDArray[np.bool_], noise_sd: float, seed: int, frame: int) -> NDArray[np.uint8]:
    """Return the picture (height, width, 3) of a silhouette, RGB.

    Args:
        mask: (height, width).
        noise_sd: Standard deviation of the noise of every pixel, grey levels; the same in all channels.
        seed: Of the run.
        frame: Of the frame.
    """
    image = np.where(mask[:, :, None], np.array(HAND, np.uint8), np.array(BACKGROUND, np.uint8))
    if noise_sd > 0.0:
        noise = noise_sd * _normals(mask.shape, seed, frame, PIXELS)[:, :, None]
        image = np.clip(np.rint(image + noise), 0, 255).astype(np.uint8)
    return image


def _normals(shape: tuple[int, ...], seed: int, frame: int, draw: int) -> NDArray[np.float64]:
    """Return N(0, 1) numbers (height, width) of one of a frame's draws."""
    # The first draws of frame 0 make the hand.
    return np.asarray(Stream(seed, 2 * frame + draw + 1, Purpose.SCENE).standard_normal(shape))


def _smooth_noise(shape: tuple[int, ...], seed: int, frame: int) -> NDArray[np.float64]:
    """Return smooth noise (height, width) of unit variance: sums in an order of their own, not by OpenCV's."""
    weights, (height, width) = _weights(), shape
    noise = _normals((height + 2 * REACH_PX, width + 2 * REACH_PX), seed, frame, EDGE)
    across = weights[0] * noise[:, :width]
    for step in range(1, len(weights)):
        across += weights[step] * noise[:, step : step + width]
    smooth = weights[0] * across[:height]
    for step in range(1, len(weights)):
        smooth += weights[step] * across[step : step + height]
    return np.asarray(smooth)


@lru_cache(maxsize=1)
def _weights() -> tuple[float, ...]:
    """Return the Gaussian's weights; the sum of their squares is 1, so that the variance stays."""
    steps = np.arange(-REACH_PX, REACH_PX + 1)
    weights = exponential(-0.5 * np.square(steps / SMOOTH_PX))
    return tuple((weights / np.sqrt(sum(np.square(weights).tolist()))).tolist())
