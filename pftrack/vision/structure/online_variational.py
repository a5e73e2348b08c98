"""Variational factorization frame by frame, over a sliding window and with forgetting (Bando 2007, ch. 4 section 5.2).

As printed the method averages the cameras of different frames, which a moving camera forbids. Here a window of 90
frames slides on by one, and only the second moments of the shape are averaged over time (docs/methods/heads.md). A
step drops the oldest frame, finds the camera of the new one from the averaged shape, finds the shape from the
window, averages, and finds all cameras of the window from the average:

    <<G>> <- (1 - eta) <<G>> + eta G,   eta <- 1 / (1 + lambda / eta).

**Forgetting by how well a point is seen.** With one eta for all, a point that is hidden throughout the window loses
what was known of it, and through the cameras it spoils the others; Bando closes with the proposal to control the
forgetting (section 5.5). With `forgetting` = "by-information" each point has its own average, in which a frame counts
by how much it told of the point: with w the information in the window about it (the trace of the precision that the
positions add),

    W <- lambda W + w,   eta_n = w / W,

which is the same eta for a point that is always seen alike.
"""

from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.vision.structure.passes import free_energy, moments, posterior_points, posterior_rows
from pftrack.vision.structure.positive import invert
from pftrack.vision.structure.tracks import FEWEST_POINTS, Tracks, check_view
from pftrack.vision.structure.variational import GAMMA, initial_motion, iterate

__all__ = ["Forgetting", "Online", "Settings", "begin", "run", "step"]

Forgetting: TypeAlias = Literal["common", "by-information"]


@dataclass(frozen=True, slots=True)
class Settings:
    """How to go on.

    Attributes:
        window: Frames, at least two.
        memory: lambda, 0..1: how much of what was known is kept with each frame. Small values forget fast.
        forgetting: Whether all points forget alike, or each by how much was seen of it.
        iterations: Passes over the first full window.
        gamma: Precision of the prior of the motion, 1/px^2.
    """

    window: int = 90
    memory: float = 0.5
    forgetting: Forgetting = "common"
    iterations: int = 10
    gamma: float = GAMMA

    def __post_init__(self) -> None:
        """Refuse what is no window and no memory."""
        if self.window < 2 or not 0.0 <= self.memory <= 1.0 or self.iterations < 1 or not self.gamma > 0.0:
            raise ValueError(
                "expected a window of at least 2, a memory of 0 to 1, at least one iteration and gamma above 0, "
                f"got {self.window}, {self.memory:g}, {self.iterations} and {self.gamma:g}"
            )


@dataclass(frozen=True, eq=False)
class Online:
    """What is known after a frame, immutable.

    Attributes:
        settings: How to go on.
        rows: (2 W, n) positions in the window, W at most its length.
        precisions: (2 W, n).
        frames: How many have been taken.
        second: (n, 4, 4) averaged second moments of (s; 1); zero until the window is full.
        eta: (n,) weight of the last frame in the average; 0 until the window is full.
        totals: (n,) discounted information, W above.
        motion: (2 W, 4) means of the rows.
        motion_covariances: (2 W, 4, 4).
        common_eta: The eta of the average as printed, the same for all points.
        free_energy: F of the window; NaN until it is full.
        average_energy: F^lambda, its average with forgetting (Bando 2007, eq. 4.16).
        best_energy: The greatest average so far.
        published: (n, 3) the shape at that time, as Bando publishes it.
    """

    settings: Settings
    rows: NDArray[np.float64]
    precisions: NDArray[np.float64]
    frames: int
    second: NDArray[np.float64]
    eta: NDArray[np.float64]
    totals: NDArray[np.float64]
    motion: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 4)))
    motion_covariances: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 4, 4)))
    common_eta: float = 1.0
    free_energy: float = float("nan")
    average_energy: float = float("nan")
    best_energy: float = -float("inf")
    published: NDArray[np.float64] | None = None

    @property
    def full(self) -> bool:
        """Whether the window is full, so that there is a shape."""
        return self.frames >= self.settings.window

    @property
    def shape(self) -> NDArray[np.float64]:
        """(n, 3) the averaged shape, up to an affine map."""
        return self.second[:, :3, 3].copy()

    @property
    def shape_covariances(self) -> NDArray[np.float64]:
        """(n, 3, 3) spread of the points within the average."""
        means = self.shape
        return np.asarray(self.second[:, :3, :3] - means[:, :, None] * means[:, None])


def begin(count: int, settings: Settings | None = None) -> Online:
    """Begin with `count` points, of which nothing is known.

    Raises:
        ValueError: There are fewer than four points.
    """
    if count < FEWEST_POINTS:
        raise ValueError(f"expected at least {FEWEST_POINTS} points, got {count}")
    nothing, none = np.zeros((0, count)), np.zeros(count)
    return Online(settings or Settings(), nothing, nothing, 0, np.zeros((count, 4, 4)), none, none)


def step(state: Online, positions: NDArray[np.float64], variances: NDArray[np.float64]) -> Online:
    """Take a frame.

    Args:
        state: As it was.
        positions: (n, 2) px.
        variances: (n, 2) px^2, infinite where a point was not seen.

    Raises:
        ValueError: The shapes differ, a variance is not above 0, or a position that was seen is not finite.
    """
    row, precision = check_view(positions, variances, state.rows.shape[1])
    frames = state.frames + 1
    dropped = max(0, len(state.rows) + 2 - 2 * state.settings.window)
    rows = np.concatenate([state.rows[dropped:], row])
    precisions = np.concatenate([state.precisions[dropped:], precision])
    taken = replace(state, rows=rows, precisions=precisions, frames=frames)
    if frames < state.settings.window:
        return taken
    return _first(taken) if frames == state.settings.window else _next(taken)


def run(tracks: Tracks, settings: Settings | None = None) -> list[Online]:
    """Return the states after every frame of tracks."""
    state = begin(tracks.positions.shape[1], settings)
    states = []
    for positions, variances in zip(tracks.positions, tracks.variances, strict=True):
        state = step(state, positions, variances)
        states.append(state)
    return states


def _first(state: Online) -> Online:
    """Return the state after the batch method on the first full window."""
    gamma = state.settings.gamma
    start = initial_motion(state.rows, state.precisions, "svd", gamma)
    found = iterate(state.rows, state.precisions, *start, state.settings.iterations, gamma)
    energy = float(found.free_energies[-1])
    return replace(
        state,
        second=moments(found.shape, found.shape_covariances),
        eta=np.ones(len(state.second)),
        totals=_information(found.shape_covariances),
        motion=found.motion,
        motion_covariances=found.motion_covariances,
        free_energy=energy,
        average_energy=energy,
        best_energy=energy,
        published=found.shape,
    )


def _next(state: Online) -> Online:
    """Return the state after a further frame."""
    settings = state.settings
    first = 2 * (state.frames - settings.window)
    memory = float(settings.memory)
    second, eta, totals, motion, spreads, energy = _slide(
        state.rows,
        state.precisions,
        state.second,
        state.eta,
        state.totals,
        state.motion,
        state.motion_covariances,
        memory,
        settings.forgetting == "common",
        float(settings.gamma),
        first,
    )
    # The average of free energies has the eta of all points together, as printed.
    common = 1.0 / (1.0 + memory / state.common_eta)
    average = state.average_energy + common * (energy - state.average_energy)
    better = average > state.best_energy
    return replace(
        state,
        second=second,
        eta=eta,
        totals=totals,
        motion=motion,
        motion_covariances=spreads,
        common_eta=common,
        free_energy=energy,
        average_energy=average,
        best_energy=max(average, state.best_energy),
        published=second[:, :3, 3].copy() if better else state.published,
    )


@compiled
def _slide(
    rows: NDArray[np.float64],
    precisions: NDArray[np.float64],
    second: NDArray[np.float64],
    eta: NDArray[np.float64],
    totals: NDArray[np.float64],
    motion: NDArray[np.float64],
    spreads: NDArray[np.float64],
    memory: float,
    common: bool,
    gamma: float,
    first: int,
) -> tuple[
    NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], float
]:
    """Return averaged moments, eta, totals, motion, its covariances, and the free energy of the window.

    The window has slid on already; motion and spreads are those of before.
    """
    height, count = rows.shape
    newest, newest_spreads, _ = posterior_rows(
        rows[height - 2 :].copy(), precisions[height - 2 :].copy(), second, gamma, first + height - 2
    )
    cameras, camera_spreads = np.empty((height, 4)), np.empty((height, 4, 4))
    for frame in range(height):
        kept = frame < height - 2
        for i in range(4):
            cameras[frame, i] = motion[frame + 2, i] if kept else newest[frame - height + 2, i]
            for j in range(4):
                camera_spreads[frame, i, j] = (
                    spreads[frame + 2, i, j] if kept else newest_spreads[frame - height + 2, i, j]
                )
    shape, covariances = posterior_points(rows, precisions, cameras, camera_spreads)
    seen = _information(covariances)
    fresh = moments(shape, covariances)
    averaged, weights, sums = np.empty_like(second), np.empty(count), np.empty(count)
    for n in range(count):
        weights[n] = 1.0 / (1.0 + memory / eta[n])
        sums[n] = memory * totals[n] + seen[n]
        if not common:
            weights[n] = seen[n] / sums[n] if sums[n] > 0.0 else 0.0
        for i in range(4):
            for j in range(4):
                averaged[n, i, j] = second[n, i, j] + weights[n] * (fresh[n, i, j] - second[n, i, j])
    cameras, camera_spreads, logs = posterior_rows(rows, precisions, averaged, gamma, first)
    energy = free_energy(rows, precisions, shape, covariances, cameras, camera_spreads, logs, gamma, first)
    return averaged, weights, sums, cameras, camera_spreads, energy


@compiled
def _information(covariances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how much the positions tell of each point (n,): the trace of the precision beyond the prior's identity."""
    count = covariances.shape[0]
    told = np.empty(count)
    precision = np.empty((3, 3))
    for n in range(count):
        invert(covariances[n], precision)
        told[n] = max(precision[0, 0] + precision[1, 1] + precision[2, 2] - 3.0, 0.0)
    return told
