"""Guided dynamics: particles that move as was learned, for any filter that takes `pftrack.filters.dynamics`."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.random import Generator
from pftrack.filters.learning.charts import Chart, Reading, advance_states
from pftrack.filters.learning.diffusion import Diffusion

__all__ = ["GuidedDynamics"]


@dataclass(frozen=True, eq=False)
class GuidedDynamics:
    """p(x' | x) by which motion and shape change as they did in recorded tracks.

    Attributes:
        diffusion: The changes.
        chart: What they change; a state is the place, its velocity, then heading, angles and numbers.
        reading: In which frame a place changes.
    """

    diffusion: Diffusion
    chart: Chart
    reading: Reading

    def predict(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the states (N, D) as they are: the drawn turn decides which way the velocity moves them."""
        return states

    def diffuse(self, rng: Generator, means: NDArray[np.float64], ancestors: NDArray[np.int64]) -> NDArray[np.float64]:
        """Draw next states (n, D) of the ancestors (n,) chosen among the states (N, D)."""
        normals = rng.standard_normal((len(self.diffusion.mean), len(ancestors)))
        return advance_states(
            means, ancestors, normals, self.diffusion.root, self.diffusion.mean, self.chart, self.reading
        )
