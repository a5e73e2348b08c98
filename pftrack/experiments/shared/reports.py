"""What particle filters report beside their estimate: the series that several families of trackers declare alike."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.cloud import Cloud
from pftrack.core.model.series import Reduction, Series, SeriesValue
from pftrack.filters.particles import ParticleSet

__all__ = ["ALERT", "CLOUD", "SAMPLERS", "cloud", "hypotheses_cloud"]

CLOUD = (
    Series("ess", "ESS", role="ess"),
    Series("particles", "particles", role="particles"),
    Series("resampled", "resampled", role="resampled"),
    Series("unique_ancestors", "different parents"),
)
"""Of every particle filter: effective sample size, number of particles, whether parents were drawn in this frame, and
how many different parents the particles have."""

SAMPLERS = Series(
    "samples",
    "proposals",
    shape="vector",
    role="share",
    components=("prediction", "observation"),
    colours=("prediction", "observation"),
    reductions=(Reduction("observation_share", "share of particles by observation", "share", "observation"),),
)
"""Of filters that draw by prediction or by observation: how many particles came from which."""

ALERT = Series(
    "switched",
    "switched",
    role="flag",
    reductions=(Reduction("switches", "switches between samplers or noises", "count"),),
)
"""Whether another sampler, or another process noise, was used than in the frame before."""


def cloud(particles: ParticleSet, *, resampled: bool) -> Mapping[str, SeriesValue]:
    """Return the values of `CLOUD`."""
    return {
        "ess": particles.effective_sample_size,
        "particles": float(len(particles)),
        "resampled": float(resampled),
        "unique_ancestors": float(particles.unique_ancestors),
    }


def hypotheses_cloud(
    states: NDArray[np.float64], log_weights: NDArray[np.float64], parents: NDArray[np.int64]
) -> Cloud:
    """Return the members of a beam, laid open like particles: states (K, d), log weights (K,), parents (K,).

    Where all begin, as when another tracker has come before, their ancestors are not known.
    """
    return Cloud(states, log_weights, None if (parents < 0).all() else parents)
