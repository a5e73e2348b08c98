"""Which of many points are in regions."""

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.linkage.sets.regions import CENTRE, HIGH, LOW, SHAPE
from pftrack.reproduce.linkage_regions import values

Array = NDArray[np.float64]


def within(region: Array, points: Array, *, ellipsoids: bool = True) -> Array:
    """Whether points (m, n) are in a region, as `contains` would have it."""
    slack = 1e-6
    inside = ((points >= region[LOW] - slack) & (points <= region[HIGH] + slack)).all(axis=1)
    if ellipsoids:
        inside &= values(points, region[CENTRE], region[SHAPE:]) <= 1 + slack
    return np.asarray(inside)


def lost(regions: Array, points: Array, *, ellipsoids: bool) -> int:
    """How many points (m, n) are in none of some regions (K, n + 3, n)."""
    held = [within(region, points, ellipsoids=ellipsoids) for region in regions]
    return int((~np.any(held, axis=0)).sum()) if held else len(points)
