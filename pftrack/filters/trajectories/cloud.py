"""The Monte Carlo filter of K tracks at once, and its smoother with a fixed lag.

In each frame every particle of a track moves by the dynamics, is weighed by how well it explains the measurement, and
the particles are drawn again by their weights. The smoother needs only those of the last L positions from which the
current particles come. After a few draws these are few, since most earlier positions have no descendants. So the past
is kept as a tree: for each age the positions with descendants, the number of descendants, and the parent position in
the frame before. Current particles that are equal share one node, too. A ring of L + 1 positions for each particle
holds the same information in ten times the memory and time.

Random numbers are functions of the seed, the frame and the track's number alone, so the order and the choice of other
tracks change nothing.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints, check, check_count
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials, logarithms
from pftrack.core.numerics.matrices import inner_product, total
from pftrack.core.numerics.random import standard_normals, uniforms
from pftrack.filters.resampling import systematic_parents
from pftrack.filters.trajectories.gaussian import locate
from pftrack.filters.trajectories.tree import Tree, came_from, copy, grow, positions_of, sample_positions, sprout

MOST_PARTICLES = 20_000
"""Limit for one track: a tree numbers its nodes with 16 bits."""

LOG_PI = 1.1447298858494002
LOG_2_PI = 1.8378770664093453
LEAST_LOG, MOST_LOG = -20.0, 20.0
"""Between which log sigma^2 and log tau^2 stay: beyond, no number of px is meant."""

DRAWS = 8
"""Draws of a track in a frame; not all are used."""
MOVE, OFFSET, PLACE, LAW = range(4)


class Stored(NamedTuple):
    """The arrays of a `Cloud`, for compiled code."""

    offsets: Ints
    nodes: NDArray[np.float32]
    parents: NDArray[np.uint16]
    counts: NDArray[np.uint16]
    logs: NDArray[np.float32]
    known: Ints


@dataclass(frozen=True, eq=False)
class Cloud:
    """Belief in K tracks: one tree of positions for each, flat, by track and then by age, the newest first.

    Attributes:
        offsets: (K, A + 1) at which node each age of a track begins and the last one ends.
        nodes: (n, 2) px.
        parents: (n,) which node of the next age of the track each came from.
        counts: (n,) number of current particles that descend from each.
        logs: (m, 2) log sigma^2 and log tau^2 of the nodes of age 0, px^2, by track; (0, 2) where both are given.
        known: (K,) number of ages that are positions in frames; a track that has begun has one more, for the frame
            before.
    """

    offsets: Ints
    nodes: NDArray[np.float32]
    parents: NDArray[np.uint16]
    counts: NDArray[np.uint16]
    logs: NDArray[np.float32]
    known: Ints

    def __post_init__(self) -> None:
        """Refuse arrays that do not fit together, which a compiled loop would read beyond their ends.

        Raises:
            ValueError: The arrays differ in length, or a track has nodes beyond the last one.
        """
        nodes = len(self.nodes)
        fits = self.nodes.shape == (nodes, 2) and self.parents.shape == self.counts.shape == (nodes,)
        fits = fits and self.offsets.ndim == 2 and self.known.shape == self.offsets.shape[:1]
        if not fits or self.offsets.max(initial=0) > nodes or self.offsets.min(initial=0) < 0:
            raise ValueError(
                "a cloud needs nodes (n, 2), as many parents and counts, and offsets (K, A) up to n and ages (K,), got "
                f"{self.nodes.shape}, {self.parents.shape}, {self.counts.shape}, {self.offsets.shape} up to "
                f"{self.offsets.max(initial=0)} and {self.known.shape}"
            )

    @property
    def arrays(self) -> Stored:
        """The arrays."""
        return Stored(self.offsets, self.nodes, self.parents, self.counts, self.logs, self.known)

    def age(self, track: int, age: int) -> tuple[Floats, Floats]:
        """Return the positions (n, 2) of a track some frames ago, px, and their shares (n,) of current particles."""
        first, last = self.offsets[track, age : age + 2]
        counts = self.counts[first:last].astype(np.float64)
        return self.nodes[first:last].astype(np.float64), counts / max(counts.sum(), 1.0)

    def laws(self, track: int) -> tuple[Floats, Floats] | None:
        """Return log sigma^2 and log tau^2 (n, 2) of a track and what share (n,) each has; None without any."""
        sizes = self.offsets[:, 1] - self.offsets[:, 0]
        if not len(self.logs) or not sizes[track]:
            return None
        first = int(sizes[:track].sum())
        return self.logs[first : first + sizes[track]].astype(np.float64), self.age(track, 0)[1]

    def moments(self) -> tuple[Floats, Floats]:
        """Return means (K, 2, 2) and covariances (K, 3) as `gaussian` has them; NaN where a track has not begun.

        The covariance is the mean of those of the axes.
        """
        count = len(self.offsets)
        means, covariances = np.full((count, 2, 2), np.nan), np.full((count, 3), np.nan)
        for track in range(count):
            here, shares = self.age(track, 0)
            if not len(here):
                continue
            first, last = self.offsets[track, :2]
            both = np.stack([here, self.age(track, 1)[0][self.parents[first:last]]], axis=2)
            means[track] = (shares[:, None, None] * both).sum(axis=0)
            off = both - means[track]
            pairs = ((0, 0), (0, 1), (1, 1))
            covariances[track] = [(shares[:, None] * off[:, :, i] * off[:, :, j]).sum() / 2.0 for i, j in pairs]
        return means, covariances


class Law(NamedTuple):
    """The noise that is taken for true.

    Attributes:
        noise: (K,) sigma^2, px^2; where it is learned, the initial value.
        drive: (K,) tau^2, px^2; likewise.
        heavy: Whether the measurements' noise is Cauchy; otherwise it is Gaussian.
        learned: Whether each particle has its own sigma^2 and tau^2.
        drift: Standard deviation of the noise added to a learned logarithm in each frame.
    """

    noise: Floats
    drive: Floats
    heavy: bool = True
    learned: bool = False
    drift: float = 0.0


class Moments(NamedTuple):
    """The result of a step for K tracks; NaN where a track has not begun.

    Attributes:
        estimates: (K, 2) positions of this frame, px.
        sds: (K, 2) their standard deviations, px, of the particles with their weights.
        past: (A, K, 2) positions of this frame and of those before it, given everything up to now, the newest first.
        densities: (K,) log p(y_t | Y_{t-1}), 0 where a measurement is missing.
        sizes: (K,) effective numbers of particles.
    """

    estimates: Floats
    sds: Floats
    past: Floats
    densities: Floats
    sizes: Floats


def nothing(count: int) -> Cloud:
    """Return the belief in `count` tracks before their first frame."""
    return Cloud(
        np.zeros((count, 3), np.int64),
        np.zeros((0, 2), np.float32),
        np.zeros(0, np.uint16),
        np.zeros(0, np.uint16),
        np.zeros((0, 2), np.float32),
        np.zeros(count, np.int64),
    )


def without(belief: Cloud, gone: Bools) -> Cloud:
    """Return the belief with some of the tracks (K,) as if they had not begun."""
    sizes = belief.offsets[:, 1] - belief.offsets[:, 0]
    logs = belief.logs[np.repeat(~gone, sizes)] if len(belief.logs) else belief.logs
    # Their nodes stay until the next step, which takes over only what it finds by the offsets.
    offsets = np.where(gone[:, None], 0, belief.offsets)
    return replace(belief, offsets=offsets, logs=logs, known=np.where(gone, 0, belief.known))


def select(belief: Cloud, tracks: Ints) -> Cloud:
    """Return the belief of some of the tracks, given by their numbers (M,), in that order; any may be there again."""
    rows = belief.offsets[tracks]
    lengths = rows[:, -1] - rows[:, 0]
    nodes = _pieces(rows[:, 0], lengths)
    sizes = belief.offsets[:, 1] - belief.offsets[:, 0]
    logs = belief.logs
    if len(logs):
        logs = logs[_pieces((np.cumsum(sizes) - sizes)[tracks], sizes[tracks])]
    offsets = rows + (np.cumsum(lengths) - lengths - rows[:, 0])[:, None]
    return Cloud(offsets, belief.nodes[nodes], belief.parents[nodes], belief.counts[nodes], logs, belief.known[tracks])


def _pieces(begins: Ints, lengths: Ints) -> Ints:
    """Return the indices of consecutive places (sum of lengths,), given the first index of each piece."""
    numbers = [np.arange(begin, begin + length) for begin, length in zip(begins, lengths, strict=True)]
    return np.concatenate([np.zeros(0, np.int64), *numbers])


def step(
    before: Cloud,
    observed: Floats,
    law: Law,
    start: tuple[Floats, Floats, Ints],
    *,
    count: int,
    lag: int,
    by_mode: bool,
    numbers: Ints,
    stream: tuple[int | Ints, int, int],
) -> tuple[Cloud, Moments]:
    """Predict all tracks by one frame and weigh them by their measurements.

    Args:
        before: Belief of the frame before.
        observed: (K, 2) px, NaN where a track has no measurement.
        law: The noise.
        start: For tracks that have no particles yet, means (K, 2, 2) and covariances (K, 3) of the frame before, as
            `gaussian` has them, NaN for those that do not begin; and (K,) 1 if the track was followed in that frame, 0
            if it begins now.
        count: Particles of a track, up to `MOST_PARTICLES`.
        lag: Number of earlier frames to keep.
        by_mode: Whether estimates are modes of histograms; otherwise they are means.
        numbers: (K,) by which the tracks draw their random numbers.
        stream: Seed, frame and purpose of the random numbers; one seed for all, or (K,) one for each track.

    Raises:
        TypeError: An argument is not an array of real numbers, or the count is not a whole number.
        ValueError: An array's length differs from the number of tracks, or the count is not between 1 and
            `MOST_PARTICLES`.
    """
    check_count("count", count)
    if count > MOST_PARTICLES:
        raise ValueError(f"count must be at most {MOST_PARTICLES}, got {count}")
    if len(observed) or len(before.known):  # without any track there is nothing to do
        check(
            missing=True,
            known=(before.known, "K"),
            observed=(observed, "K 2"),
            noise=(law.noise, "K"),
            drive=(law.drive, "K"),
            means=(start[0], "K 2 2"),
            covariances=(start[1], "K 3"),
            followed=(start[2], "K", "whole"),
            numbers=(numbers, "K", "whole"),
        )
    seeds, frame, purpose = stream
    own_seeds = np.ascontiguousarray(np.broadcast_to(np.asarray(seeds, np.int64), len(observed)))
    stored, moments = _step_particles(
        before.arrays,
        np.ascontiguousarray(observed),
        law,
        start,
        (count, max(lag, 1) + 1, by_mode),
        (numbers, own_seeds, frame, purpose),
    )
    return Cloud(*stored), moments


@compiled
def _weigh(here: Floats, measured: Floats, squares: Floats, logs: Floats, heavy: bool) -> tuple[Floats, float]:
    """Return weights (n,) that sum to 1, and the log of the mean density.

    Args:
        here: (2, n) positions, px.
        measured: (2,) px.
        squares: (n,) or (1,) sigma^2, px^2.
        logs: Their logarithms.
        heavy: Whether the noise is Cauchy.
    """
    count = here.shape[1]
    values = np.empty(count)
    several = squares.shape[0] > 1
    if heavy:
        # Far from a measurement the product of two Cauchy densities is still a number: no logarithms are needed.
        for n in range(count):
            square = squares[n] if several else squares[0]
            x, y = measured[0] - here[0, n], measured[1] - here[1, n]
            values[n] = square / ((x * x + square) * (y * y + square))
        top = -2.0 * LOG_PI
    else:
        top = -np.inf
        for n in range(count):
            square, log = (squares[n], logs[n]) if several else (squares[0], logs[0])
            x, y = measured[0] - here[0, n], measured[1] - here[1, n]
            values[n] = -LOG_2_PI - log - 0.5 * (x * x + y * y) / square
            top = max(top, values[n])
        for n in range(count):
            values[n] -= top
        values = exponentials(values)
    whole = total(values)
    for n in range(count):
        values[n] /= whole
    return values, top + logarithms(np.array([whole / count]))[0]


@compiled
def _laws(
    before: NDArray[np.float32], own: Ints, given: Floats, drift: float, stream: tuple[int, int, int, int]
) -> Floats:
    """Return log sigma^2 and log tau^2 (2, n) of particles.

    Args:
        before: (m, 2) of the nodes that they come from; (0, 2) where these have none.
        own: (n,) index of each particle's node.
        given: (2,) initial sigma^2 and tau^2, px^2.
        drift: Standard deviation of the added noise.
        stream: Seed, frame, purpose and first draw of the track.
    """
    seed, frame, purpose, draw = stream
    count = own.shape[0]
    logs = np.empty((2, count))
    begin = logarithms(given)
    fresh = before.shape[0] == 0
    shared = 0.0 if fresh else 1.0
    sd = 1.0 if fresh else drift
    normals = np.zeros(2 * count)
    if sd > 0.0:
        normals = standard_normals(seed, frame, purpose, draw + LAW, 2 * count)
    for kind in range(2):
        for n in range(count):
            middle = float(before[own[n], kind]) if shared else begin[kind]
            logs[kind, n] = min(max(middle + sd * normals[kind * count + n], LEAST_LOG), MOST_LOG)
    return logs


@compiled
def _move(at: Floats, earlier: Floats, deviations: Floats, normals: Floats) -> Floats:
    """Return positions (2, n), px, given the last two (n, 2), tau (n,) or (1,) and (2 n,) numbers."""
    count, several = at.shape[0], deviations.shape[0] > 1
    here = np.empty((2, count))
    for axis in range(2):
        for n in range(count):
            push = (deviations[n] if several else deviations[0]) * normals[axis * count + n]
            here[axis, n] = 2.0 * at[n, axis] - earlier[n, axis] + push
    return here


@compiled
def _moments(values: Floats, weights: Floats) -> tuple[float, float]:
    """Return mean and standard deviation of values (n,) with weights (n,) that sum to 1."""
    mean = inner_product(weights, values)
    squares = np.empty(values.shape[0])
    for n in range(values.shape[0]):
        squares[n] = (values[n] - mean) * (values[n] - mean)
    return mean, np.sqrt(inner_product(weights, squares))


@compiled
def _locate_ages(tree: Tree, row: Ints, by_mode: bool, past: Floats) -> None:
    """Write the positions of a track's ages (A, 2), given the offsets of these in the tree."""
    for age in range(past.shape[0]):
        first, last = row[age], row[age + 1]
        past[age] = locate(tree[0][first:last], tree[2][first:last], by_mode)


@compiled
def _step_particles(
    before: Stored,
    observed: Floats,
    law: Law,
    start: tuple[Floats, Floats, Ints],
    settings: tuple[int, int, bool],
    streams: tuple[Ints, Ints, int, int],
) -> tuple[Stored, Moments]:
    """Return the arrays of the next cloud, and what the step came to; arguments as for `step`.

    Args:
        before: Arrays of the cloud.
        observed: (K, 2) px.
        law: The noise.
        start: State of tracks that begin.
        settings: Particles of a track, ages that are kept, and whether estimates are modes.
        streams: Numbers (K,) and seeds (K,) of the tracks, frame and purpose.
    """
    means, covariances, given_known = start
    count, ages, by_mode = settings
    numbers, seeds, frame, purpose = streams
    tracks, kept = before.offsets.shape[0], min(before.offsets.shape[1], ages)
    room = before.nodes.shape[0] + 2 * count * tracks
    new_offsets, new_known = np.zeros((tracks, kept + 1), np.int64), np.zeros(tracks, np.int64)
    tree = np.empty((room, 2), np.float32), np.zeros(room, np.uint16), np.empty(room, np.uint16)
    new_logs = np.empty((count * tracks if law.learned else 0, 2), np.float32)
    places, past = np.full((2, tracks, 2), np.nan), np.full((kept, tracks, 2), np.nan)
    found = Moments(places[0], places[1], past, np.zeros(tracks), np.full(tracks, np.nan))
    cursor, log_cursor, old_log = 0, 0, 0
    for track in range(tracks):
        row = before.offsets[track]
        standing = row[1] - row[0]
        if standing == 0 and np.isnan(means[track, 0, 0]):
            new_offsets[track] = cursor
            continue
        own_logs = before.logs[old_log : old_log + standing] if before.logs.shape[0] > 0 else before.logs
        old_log += standing
        seed, draw = seeds[track], DRAWS * numbers[track]
        old_nodes, old_parents = before.nodes, before.parents
        if standing > 0:
            own = came_from(before.counts[row[0] : row[1]], count)
            at, earlier = positions_of(own, row, before.nodes, before.parents)
        else:
            own, row = np.arange(count), np.array([0, count])
            at, earlier = sample_positions(
                means[track], covariances[track], standard_normals(seed, frame, purpose, draw + PLACE, 4 * count)
            )
            old_nodes, old_parents = at.astype(np.float32), np.zeros(count, np.uint16)
        new_known[track] = min((before.known[track] if standing > 0 else given_known[track]) + 1, kept)
        squares, deviations = np.array([law.noise[track]]), np.array([np.sqrt(law.drive[track])])
        particle_logs = logarithms(squares).reshape(1, 1)
        if law.learned:
            given = np.array([law.noise[track], law.drive[track]])
            particle_logs = _laws(own_logs, own, given, law.drift, (seed, frame, purpose, draw))
            squares, deviations = exponentials(particle_logs[0]), exponentials(0.5 * particle_logs[1])
        here = _move(at, earlier, deviations, standard_normals(seed, frame, purpose, draw + MOVE, 2 * count))
        weights, chosen = np.full(count, 1.0 / count), np.arange(count)
        if np.isfinite(observed[track, 0]) and np.isfinite(observed[track, 1]):
            weights, found.densities[track] = _weigh(here, observed[track], squares, particle_logs[0], law.heavy)
            chosen = systematic_parents(weights, uniforms(seed, frame, purpose, draw + OFFSET, 1)[0], count)
        found.sizes[track] = 1.0 / inner_product(weights, weights)
        for axis in range(2):
            found.estimates[track, axis], found.sds[track, axis] = _moments(here[axis], weights)
        new_offsets[track, 0] = cursor
        new_offsets[track, 1] = sprout(chosen, here, own, tree, cursor)
        if law.learned:
            log_cursor = copy(chosen, particle_logs, new_logs, log_cursor)
        cursor = grow(old_nodes, old_parents, row, tree, new_offsets[track])
        _locate_ages(tree, new_offsets[track], by_mode, past[: new_known[track], track])
        if by_mode:
            found.estimates[track] = past[0, track]
    return Stored(
        new_offsets,
        tree[0][:cursor].copy(),
        tree[1][:cursor].copy(),
        tree[2][:cursor].copy(),
        new_logs[:log_cursor].copy(),
        new_known,
    ), found
