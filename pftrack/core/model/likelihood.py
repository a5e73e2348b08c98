"""What a likelihood says of any state, for people who want to look into it; the particles of a state, and their lines.

A filter asks its likelihood p(z_t | x_t) at its particles alone. A person who wants to know why a target was lost asks
it elsewhere: at the target, at a look-alike, all over the picture (`pftrack.core.model.model.Model`). The answer is a
number, and the parts that it is made of, such as the histogram of a window beside the model's.
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

# A likelihood compares what it expects with what it finds; each kind of comparison is a kind of part, which a page or a
# notebook knows how to draw.


@dataclass(frozen=True, slots=True)
class Amount:
    """A number.

    Attributes:
        title: What it is, a few words.
        value: NaN where it is not known.
        unit: Of it; empty for a pure number.
        limit: What it should not be above; None where there is no such limit.
    """

    title: str
    value: Known
    unit: str = ""
    limit: Known | None = None
    kind: Literal["amount"] = "amount"


@dataclass(frozen=True, slots=True)
class Residual:
    """A number found beside the one expected.

    Attributes:
        title: What it is, a few words.
        found: NaN where nothing is found.
        expected: Of it.
        sd: Standard deviation of the difference.
        unit: Of all three; empty for a pure number.
    """

    title: str
    found: Known
    expected: Known
    sd: Known
    unit: str = ""
    kind: Literal["residual"] = "residual"


@dataclass(frozen=True, slots=True)
class Histograms:
    """Shares found beside shares expected.

    Attributes:
        title: What is counted, a few words.
        expected: (B,) of the model.
        found: (B,), as many.
        colours: (B,) RGB of what is counted, 0..255, "#rrggbb" in JSON; empty where it has no colour.
    """

    title: str
    expected: tuple[float, ...]
    found: tuple[float, ...]
    colours: tuple[Annotated[tuple[int, int, int], PlainSerializer(hexadecimal)], ...] = ()
    kind: Literal["histograms"] = "histograms"


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """A piece of a picture beside the one expected.

    Attributes:
        title: What they show, a few words.
        expected_rgb: (h, w, 3).
        found_rgb: (h', w', 3); empty where it lies outside the picture.
    """

    title: str
    expected_rgb: NDArray[np.uint8]
    found_rgb: NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Contributions:
    """What several things had their share in.

    Attributes:
        title: What they contributed to, a few words.
        columns: What is said of each; a unit stands in brackets.
        names: Of the F things.
        rows: (F, len(columns)) numbers; NaN where one is not known.
        arrows: (F, 4) where each stands in the picture and where it pulls to, x, y, x, y, px; empty without, not in
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
"""Of the logarithm of a likelihood beside the greatest on a map: what is less probable is as good as impossible."""


@dataclass(frozen=True, slots=True)
class Component:
    """One coordinate of a state.

    Attributes:
        name: As an array's column is called.
        unit: "px", "rad"; empty for a pure number.
    """

    name: str
    unit: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class LikelihoodMap:
    """A likelihood all over a picture.

    Attributes:
        log_likelihoods: (rows, columns), the first in the middle of the first cell.
        step_px: Sides of a cell, px.
    """

    log_likelihoods: Floats
    step_px: int

    @property
    def range(self) -> tuple[float, float]:
        """The lowest and the highest number that colours tell apart; equal where all are the same or impossible."""
        finite = self.log_likelihoods[np.isfinite(self.log_likelihoods)]
        if not len(finite):
            return 0.0, 0.0
        high = float(finite.max())
        return max(float(finite.min()), high + LOWEST), high

    @property
    def levels(self) -> Floats:
        """(rows, columns) from 0 for the lowest of the range and below to 1 for the highest."""
        low, high = self.range
        spread = high - low if high > low else 1.0
        return np.clip((self.log_likelihoods - low) / spread, 0.0, 1.0)


def lattice(size: tuple[int, int], most: int) -> tuple[Floats, tuple[int, int], int]:
    """Return places all over a picture, in the middles of equal cells.

    Args:
        size: Width and height of the picture, px.
        most: How many places at the most.

    Returns:
        The places (rows * columns, 2), px, row after row; how many rows and columns; and the sides of a cell, px.
    """
    width, height = size
    step = max(math.isqrt(max(width * height // most, 1)), 1)
    while math.ceil(width / step) * math.ceil(height / step) > most:
        step += 1
    rows, columns = np.arange(step // 2, height, step), np.arange(step // 2, width, step)
    across, down = np.meshgrid(columns.astype(np.float64), rows.astype(np.float64))
    return np.column_stack([across.ravel(), down.ravel()]), (len(rows), len(columns)), step


# A state keeps its particles in a form of its own; its tracker says how to see them (`Tracker.cloud`). General code
# asks little of them: how probable each is, which particle of the frame before it descends from, and which sampler has
# drawn it. Where several targets or parts of one have a filter each, their particles lie in one cloud, filter by
# filter.


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


# Genealogies: each resampling lets some particles have many children and others none, so the further one looks back,
# the fewer ancestors the present generation has, until all descend from one: there their lines coalesce, and the cloud
# knows nothing of the past but one path (Kitagawa 1996; Jacob, Murray, Rubenthaler 2015, "Path storage in the particle
# filter"). How soon that happens is impoverishment, made visible.
#
# A particle that is drawn without a parent, as from an observation or by another tracker, begins a line of its own: its
# parent is -1, and so is its ancestor in all frames before.


@dataclass(frozen=True)
class Genealogy:
    """The ancestors of N particles over L frames.

    Attributes:
        last: The frame of the present generation.
        places: (L, N) for each frame, the oldest first, which of its particles the ancestor of each present one is, -1
            before its line began; the last row counts the present ones themselves.
    """

    last: int
    places: Ints

    @property
    def frames(self) -> range:
        """The frames, the oldest first."""
        return range(self.last + 1 - len(self.places), self.last + 1)

    @cached_property
    def counts(self) -> Ints:
        """(L,) how many different ancestors the present generation has in each frame."""
        return np.array([len(np.unique(row[row >= 0])) for row in self.places], np.int64)

    @property
    def coalesced(self) -> int | None:
        """The newest frame in which one particle is the ancestor of all; None if they do not go back so far."""
        alone = np.flatnonzero((self.counts == 1) & (self.places >= 0).all(axis=1))
        return None if not len(alone) or len(self.places[0]) == 1 else self.frames[int(alone[-1])]

    @cached_property
    def heights(self) -> Floats:
        """(L, N) where the line of each particle is drawn in each frame, 0..1, so that lines meet and never cross.

        NaN before it began. The present ones are in the order of their ancestors, equally far apart; an ancestor is in
        the middle of those that descend from it.
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
        """Return the heights (L, K) of at most so many of the lines, evenly chosen from the lowest to the highest."""
        count = self.places.shape[1]
        chosen = np.argsort(self.heights[-1], kind="stable")
        return self.heights[:, chosen[:: -(-count // most)]]


def trace(last: int, ancestors: Sequence[Ints], count: int, among: slice = slice(None)) -> Genealogy:
    """Trace particles back.

    Args:
        last: The frame of the present generation.
        ancestors: (N_t,) of the frames that end with it, the oldest first: the place of each particle's parent in the
            frame before, -1 without one. It is followed no further back than to where the oldest line begins.
        count: How many present particles there are.
        among: Which of the present particles are traced, as those of one of several filters; all if not given.

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
    """Return how many particles of each further frame descend from one.

    Args:
        particle: Its place.
        ancestors: (N_t,) of the frames after it, in order.
    """
    counts, family = [], np.array([particle])
    for parents in ancestors:
        family = np.flatnonzero(np.isin(parents, family))
        counts.append(len(family))
    return counts
