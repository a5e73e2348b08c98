"""Clouds: the particles of a state, laid open for whoever wants to look at one of them.

A state keeps its particles in a form of its own; its tracker says how to see them (`Tracker.cloud`). What general code
asks of them is little: how probable each is, which particle of the frame before it descends from, and which sampler has
drawn it.

Where several targets or parts of one have a filter each, their particles lie in one cloud, filter by filter.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.likelihood import Component

__all__ = ["Cloud"]


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """N particles of one frame.

    Attributes:
        states: (N, d) in the units of the model.
        log_weights: (N,) logarithms of weights that sum to one, in each filter.
        ancestors: (N,) place of each particle's parent in the cloud of the frame before, -1 of one that has none; None
            where that is not known.
        counts: How many of them each sampler has drawn, those of the first sampler first, and so in each filter; empty
            where there is but one sampler.
        samplers: Names of these samplers.
        components: Coordinates of the states, in order, where they are not those of which the tracker's likelihood is
            asked, as of particles of points below a pose; such particles are not asked.
        places: (N, 2) where these are in the picture, px; None of all others.
        resampled: Whether parents were drawn in this frame; else weights are those of the frame before, times what the
            frame says.
        filters: Names of the filters that have drawn them, equally many each, in order; empty where there is but one.
        log_likelihoods: (N,) what the frame says of each, where that is not known from the tracker's likelihood.
    """

    states: NDArray[np.float64]
    log_weights: NDArray[np.float64]
    ancestors: NDArray[np.int64] | None = None
    counts: tuple[int, ...] = ()
    samplers: tuple[str, ...] = ()
    resampled: bool = True
    components: tuple[Component, ...] = ()
    places: NDArray[np.float64] | None = None
    filters: tuple[str, ...] = ()
    log_likelihoods: NDArray[np.float64] | None = None

    def __len__(self) -> int:
        """Return the number of particles N, of all filters."""
        return len(self.log_weights)

    def siblings(self, particle: int) -> slice:
        """Return where the particles are that the same filter has drawn as this one, itself among them."""
        count = len(self) // max(len(self.filters), 1)
        first = particle // count * count
        return slice(first, first + count)

    def filter(self, particle: int) -> str:
        """Return the name of the filter that has drawn a particle; empty where there is but one."""
        return self.filters[self.siblings(particle).start * len(self.filters) // len(self)] if self.filters else ""

    def rank(self, particle: int) -> int:
        """Return the place of a particle in its filter, from 1, the heaviest; equal ones share the first place."""
        return 1 + int(np.count_nonzero(self.log_weights[self.siblings(particle)] > self.log_weights[particle]))

    def sampler(self, particle: int) -> str:
        """Return the name of the sampler that has drawn a particle; empty where there is but one."""
        if not self.samplers:
            return ""
        return self.samplers[int(np.searchsorted(np.cumsum(self.counts), particle, "right")) % len(self.samplers)]
