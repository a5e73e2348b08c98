"""Views of a body before a pinhole, for tests of the shapes that are learned from them."""

from collections.abc import Iterator

import numpy as np

from pftrack.core.geometry import rotation

FOCAL_PX = 1000.0
SPREAD_MM = 3.0


def usual(points: int = 8) -> np.ndarray:
    """The mean of other bodies, mm."""
    return np.random.default_rng(0).normal(size=(points, 3)) * [30.0, 40.0, 15.0]


def own(seed: int = 1, spread_mm: float = SPREAD_MM) -> np.ndarray:
    """A body of the kind, mm."""
    return usual() + spread_mm * np.random.default_rng(seed).normal(size=usual().shape)


def covariance() -> np.ndarray:
    return np.tile(SPREAD_MM**2 * np.eye(3), (len(usual()), 1, 1))


def angles(index: int, turn: float) -> np.ndarray:
    return turn * np.array([0.4 * np.sin(0.2 * index), 0.6 * np.sin(0.13 * index), 0.2 * np.sin(0.1 * index)])


def views(
    shape: np.ndarray, frames: int, *, turn: float = 1.0, approach: float = 1.0, sd: float = 1.0, seed: int = 0
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Positions and variances, frame by frame; the first is from the front."""
    rng = np.random.default_rng(seed)
    for index in range(frames):
        placed = shape @ rotation(angles(index, turn)).T + [5.0, 3.0, 500.0 + approach * index]
        pixels = FOCAL_PX * placed[:, :2] / placed[:, 2:]
        yield pixels + sd * rng.normal(size=pixels.shape), np.full(pixels.shape, sd**2)
