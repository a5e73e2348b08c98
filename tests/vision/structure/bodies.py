"""Bodies that turn before an affine camera, for tests of the structure found from them."""

import numpy as np

from pftrack.core.geometry import rotation
from pftrack.vision.structure.factorization import Tracks


def body(points: int = 9, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(points, 3)) * [20.0, 30.0, 10.0]


def cameras(frames: int = 20, *, turn: float = 1.0) -> np.ndarray:
    """(2 T, 4) rows of cameras that look at a body from all sides, first from the front."""
    rows = []
    for index in range(frames):
        theta = turn * np.array([0.5 * np.sin(0.4 * index), 0.7 * np.sin(0.25 * index), 0.2 * np.sin(0.1 * index)])
        rows.append(np.column_stack([rotation(theta)[:2], [5.0 + index, 3.0 - 0.5 * index]]))
    return np.concatenate(rows)


def seen(shape: np.ndarray, motion: np.ndarray, sd: np.ndarray | float = 1e-4, *, noise: float = 0.0) -> Tracks:
    """Tracks of a shape; sd (T, n) is told, and `noise` times it is there."""
    rows = motion @ np.column_stack([shape, np.ones(len(shape))]).T
    true = rows.reshape(-1, 2, len(shape)).transpose(0, 2, 1)
    told = np.broadcast_to(np.asarray(sd)[..., None] if np.ndim(sd) else sd, true.shape)
    finite = np.where(np.isfinite(told), told, 0.0)
    return Tracks(true + noise * finite * np.random.default_rng(1).normal(size=true.shape), told**2)
