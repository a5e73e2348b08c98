"""Inspecting likelihoods: their value and parts for any state; the particles of a state, and their genealogies.

A filter evaluates its likelihood p(z_t | x_t) only at its particles. To see why a target was lost, people evaluate it
elsewhere: at the target, at a look-alike, all over the picture (`pftrack.core.model.model.Model`). The result is a
number and its parts, such as the histogram of a window with that of the model.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PlainSerializer

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.drawing import hexadecimal
from pftrack.core.model.series import Known

# A likelihood compares expected with found quantities. Each kind of comparison is a kind of part, which pages and
# notebooks can draw.


@dataclass(frozen=True, slots=True)
class Amount:
    """A number.

    Attributes:
        title: Title in a few words.
        value: The number; NaN where unknown.
        unit: Unit; empty for a pure number.
        limit: Upper limit; None without one.
    """

    title: str
    value: Known
    unit: str = ""
    limit: Known | None = None
    kind: Literal["amount"] = "amount"


@dataclass(frozen=True, slots=True)
class Residual:
    """A found and an expected number.

    Attributes:
        title: Title in a few words.
        found: The found number; NaN if nothing was found.
        expected: The expected number.
        sd: Standard deviation of the difference.
        unit: Unit of all three; empty for a pure number.
    """

    title: str
    found: Known
    expected: Known
    sd: Known
    unit: str = ""
    kind: Literal["residual"] = "residual"


@dataclass(frozen=True, slots=True)
class Histograms:
    """Found and expected shares of bins.

    Attributes:
        title: Title in a few words.
        expected: (B,) shares of the model.
        found: (B,) found shares.
        colours: (B,) RGB of the bins, 0..255, "#rrggbb" in JSON; empty for bins without colours.
    """

    title: str
    expected: tuple[float, ...]
    found: tuple[float, ...]
    colours: tuple[Annotated[tuple[int, int, int], PlainSerializer(hexadecimal)], ...] = ()
    kind: Literal["histograms"] = "histograms"


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """A found and an expected piece of a picture.

    Attributes:
        title: Title in a few words.
        expected_rgb: (h, w, 3) expected piece.
        found_rgb: (h', w', 3) found piece; empty outside the picture.
    """

    title: str
    expected_rgb: NDArray[np.uint8]
    found_rgb: NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Contributions:
    """Contributions of several items.

    Attributes:
        title: Title in a few words.
        columns: Titles of the columns, with units in brackets.
        names: Names of the F items.
        rows: (F, len(columns)) numbers; NaN where unknown.
        arrows: (F, 4) position of each item in the picture and end of its pull, x, y, x, y, px; may be empty; not in
            JSON.
    """

    title: str
    columns: tuple[str, ...]
    names: tuple[str, ...]
    rows: tuple[tuple[Known, ...], ...]
    arrows: Annotated[tuple[tuple[float, float, float, float], ...], Field(exclude=True)] = ()
    kind: Literal["contributions"] = "contributions"


Part: TypeAlias = Amount | Residual | Histograms | Patches | Contributions

LOWEST = -20.0
"""Lowest log likelihood on a map, relative to its maximum; lower values count as impossible."""


@dataclass(frozen=True, slots=True)
class Component:
    """One coordinate of a state.

    Attributes:
        name: Name of the array's column.
        unit: "px", "rad"; empty for a pure number.
    """

    name: str
    unit: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class LikelihoodMap:
    """A likelihood over a picture.

    Attributes:
        log_likelihoods: (rows, columns) values at the centres of the cells.
        step_px: Side of a cell, px.
    """

    log_likelihoods: Floats
    step_px: int

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest value of the colour scale; equal if all values are equal or impossible."""
        finite = self.log_likelihoods[np.isfinite(self.log_likelihoods)]
        if not len(finite):
            return 0.0, 0.0
        high = float(finite.max())
        return max(float(finite.min()), high + LOWEST), high

    @property
    def levels(self) -> Floats:
        """(rows, columns) levels from 0 (lowest of the range or below) to 1 (highest)."""
        low, high = self.range
        spread = high - low if high > low else 1.0
        return np.clip((self.log_likelihoods - low) / spread, 0.0, 1.0)


def lattice(size: tuple[int, int], most: int) -> tuple[Floats, tuple[int, int], int]:
    """Return the centres of equal cells that cover a picture.

    Args:
        size: Width and height of the picture, px.
        most: Largest number of cells.

    Returns:
        The centres (rows * columns, 2), px, row by row; the numbers of rows and columns; and the side of a cell, px.
    """
    width, height = size
    step = max(math.isqrt(max(width * height // most, 1)), 1)
    while math.ceil(width / step) * math.ceil(height / step) > most:
        step += 1
    rows, columns = np.arange(step // 2, height, step), np.arange(step // 2, width, step)
    across, down = np.meshgrid(columns.astype(np.float64), rows.astype(np.float64))
    return np.column_stack([across.ravel(), down.ravel()]), (len(rows), len(columns)), step


# Each state stores its particles in its own form; `Tracker.cloud` returns them in a common one. General code needs only
# the weight of each particle, its parent in the frame before, and the proposal that drew it. If several targets or
# parts have a filter each, one cloud holds the particles of all filters in order.


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """N particles of one frame.

    Attributes:
        states: (N, d) states in the units of the model.
        log_weights: (N,) logarithms of weights that sum to one in each filter.
        ancestors: (N,) index of each particle's parent in the cloud of the frame before, -1 without a parent; None if
            unknown.
        counts: Number of particles from each proposal, in the order of the particles of each filter; empty if there is
            only one proposal.
        samplers: Names of these proposals.
        components: Coordinates of the states in order, if they differ from those of the tracker's likelihood, such as
            points below a pose; the likelihood cannot be evaluated at such particles.
        places: (N, 2) places of such particles in the picture, px; otherwise None.
        resampled: Whether resampling took place in this frame; if not, weights are those of the frame before times the
            likelihood.
        filters: Names of the filters in order, each with the same number of particles; empty if there is only one.
        log_likelihoods: (N,) log likelihoods, if the tracker's likelihood does not give them.
    """

    states: Floats
    log_weights: Floats
    ancestors: Ints | None = None
    counts: tuple[int, ...] = ()
    samplers: tuple[str, ...] = ()
    resampled: bool = True
    components: tuple[Component, ...] = ()
    places: Floats | None = None
    filters: tuple[str, ...] = ()
    log_likelihoods: Floats | None = None

    def __len__(self) -> int:
        """Return the number of particles N of all filters."""
        return len(self.log_weights)

    def siblings(self, particle: int) -> slice:
        """Return the range of particles of the same filter."""
        count = len(self) // max(len(self.filters), 1)
        first = particle // count * count
        return slice(first, first + count)

    def filter(self, particle: int) -> str:
        """Return the name of the filter of a particle; empty if there is only one."""
        return self.filters[self.siblings(particle).start * len(self.filters) // len(self)] if self.filters else ""

    def rank(self, particle: int) -> int:
        """Return the rank of a particle in its filter by weight; the heaviest has 1, equal ones share the best."""
        return 1 + int(np.count_nonzero(self.log_weights[self.siblings(particle)] > self.log_weights[particle]))

    def sampler(self, particle: int) -> str:
        """Return the name of the proposal that drew a particle; empty if there is only one."""
        if not self.samplers:
            return ""
        return self.samplers[int(np.searchsorted(np.cumsum(self.counts), particle, "right")) % len(self.samplers)]


# Genealogies: in each resampling some particles have many children and others none, so the present generation has ever
# fewer ancestors in earlier frames, until all descend from one. There the lines coalesce, and the cloud has one path of
# the past (Kitagawa 1996; Jacob, Murray, Rubenthaler 2015, "Path storage in the particle filter"). The number of
# frames until then shows impoverishment.
#
# A particle without a parent, drawn from an observation or by another tracker, begins a new line: its parent is -1, and
# so is its ancestor in all earlier frames.


@dataclass(frozen=True)
class Genealogy:
    """The ancestors of N particles over L frames.

    Attributes:
        last: Frame of the present generation.
        places: (L, N) for each frame, oldest first, the index of the ancestor of each present particle, -1 before its
            line began; the last row holds the present particles themselves.
    """

    last: int
    places: Ints

    @property
    def frames(self) -> range:
        """The frames, oldest first."""
        return range(self.last + 1 - len(self.places), self.last + 1)

    @cached_property
    def counts(self) -> Ints:
        """(L,) number of different ancestors of the present generation in each frame."""
        return np.array([len(np.unique(row[row >= 0])) for row in self.places], np.int64)

    @property
    def coalesced(self) -> int | None:
        """Newest frame in which one particle is the ancestor of all; None if there is none."""
        alone = np.flatnonzero((self.counts == 1) & (self.places >= 0).all(axis=1))
        return None if not len(alone) or len(self.places[0]) == 1 else self.frames[int(alone[-1])]

    @cached_property
    def heights(self) -> Floats:
        """(L, N) height of the line of each particle in each frame, 0..1, so that lines meet and never cross.

        NaN before the line began. Present particles are in the order of their ancestors at equal distances; an ancestor
        is in the middle of its descendants.
        """
        length, count = self.places.shape
        rows = np.empty(count)
        rows[np.lexsort(self.places[::-1])] = (np.arange(count) + 0.5) / count
        heights = np.empty((length, count))
        for row, places in zip(heights, self.places, strict=True):
            _, families = np.unique(places, return_inverse=True)
            row[:] = (np.bincount(families, rows) / np.bincount(families))[families]
            row[places < 0] = np.nan
        return heights

    def lines(self, most: int) -> Floats:
        """Return the heights (L, K) of at most `most` lines, chosen evenly from the lowest to the highest."""
        count = self.places.shape[1]
        chosen = np.argsort(self.heights[-1], kind="stable")
        return self.heights[:, chosen[:: -(-count // most)]]


def trace(last: int, ancestors: Sequence[Ints], count: int, among: slice = slice(None)) -> Genealogy:
    """Trace particles back to their ancestors.

    Args:
        last: Frame of the present generation.
        ancestors: (N_t,) for the frames up to it, oldest first: index of each particle's parent in the frame before, -1
            without one. Tracing ends where the oldest line begins.
        count: Number of present particles.
        among: Present particles to trace, such as those of one of several filters (default: all).

    Raises:
        ValueError: The last frame has another number of particles.
    """
    if ancestors and len(ancestors[-1]) != count:
        raise ValueError(f"expected the parents of {count} particles, got {len(ancestors[-1])}")
    rows = [np.arange(count)[among]]
    for parents in reversed(ancestors):
        before = np.append(parents, -1)[rows[-1]]
        if (before < 0).all():
            break
        rows.append(before)
    return Genealogy(last, np.stack(rows[::-1]).astype(np.int64))


def count_descendants(particle: int, ancestors: Sequence[Ints]) -> list[int]:
    """Return the number of descendants of a particle in each later frame.

    Args:
        particle: Index of the particle.
        ancestors: (N_t,) parents in the later frames, in order.
    """
    counts, family = [], np.array([particle])
    for parents in ancestors:
        family = np.flatnonzero(np.isin(parents, family))
        counts.append(len(family))
    return counts
