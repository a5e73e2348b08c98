"""Factorization by variational Bayes: each position counts by its own noise (Bando 2007, ch. 4 section 5.2).

`factorize` of `factorization` weighs all positions alike. Here each position has a variance, which is large or infinite
for a hidden point; no column need be deleted. Shape and motion have Gaussian priors, and their posterior is taken as a
product of Gaussians, one per point and one per row of motion, which are improved alternately (`passes`). Each pass
raises the free energy, a lower bound on the log evidence of the tracks.

The result is affine: `metric` makes it a shape in px. The covariances are those of a product of independent beliefs.
They ignore joint maps of shape and motion, which no track determines, and are too small for errors common to all
points. `strengths` shows instead whether a whole direction of the shape was not seen.
"""

from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import product, singular_values, solve_system
from pftrack.core.numerics.random import Generator
from pftrack.vision.structure.factorization import FEWEST_POINTS, Tracks, check_view, invert, metric_transform

# The passes of variational Bayes, compiled: beliefs in the shape given the motion, and in the motion given the shape.
#
# The model (Bando 2007, ch. 4 section 5.2): position d of point n is theta_d . (s_n; 1) + noise of
# variance sigma_dn^2, s_n ~ N(0, I), theta_d ~ N(e_d, I / gamma). The posterior is taken as a product of beliefs in
# each point, N(shat_n, Sig_n), and in each row of the motion, N(thhat_d, Vd^-1). Each is found given the moments of the
# other:
#
# - `posterior_points`: Sig_n^-1 = I + sum_d sigma^-2 (Vd^-1 + thhat thhat^T)_ss, in the form that inverts 3 x 3 only;
# - `posterior_rows`: Vd = gamma I + sum_n sigma^-2 G_n, G_n the second moment of (s_n; 1);
# - `free_energy`: the bound on the log evidence that both raise, corrected (docs/methods/heads.md).
#
# A precision of 0 means that a point was not seen; it adds nothing to any of the three.

Seen: TypeAlias = tuple[Floats, Floats]
"""Rows (D, n) of positions, and their precisions, (D, n) inverse variances."""

Belief: TypeAlias = tuple[Floats, Floats]
"""Means and covariances: (n, 3) and (n, 3, 3) of a shape's points, or (D, 4) and (D, 4, 4) of a motion's rows."""


@compiled
def posterior_points(seen: Seen, motion: Belief) -> Belief:
    """Return the belief in the points: the E step.

    Args:
        seen: Positions and precisions.
        motion: The belief in the rows.
    """
    (rows, precisions), (thetas, spreads) = seen, motion
    count = rows.shape[1]
    means, covariances = np.empty((count, 3)), np.empty((count, 3, 3))
    precision, information = np.empty((3, 3)), np.empty(3)
    for n in range(count):
        for i in range(3):
            information[i] = 0.0
            for j in range(i + 1):
                precision[i, j] = 1.0 if i == j else 0.0
        for d in range(rows.shape[0]):
            weight = precisions[d, n]
            rest = rows[d, n] - thetas[d, 3]
            for i in range(3):
                information[i] += weight * (rest * thetas[d, i] - spreads[d, i, 3])
                for j in range(i + 1):
                    precision[i, j] += weight * (thetas[d, i] * thetas[d, j] + spreads[d, i, j])
        invert(precision, covariances[n])
        for i in range(3):
            means[n, i] = 0.0
            for j in range(3):
                means[n, i] += covariances[n, i, j] * information[j]
    return means, covariances


@compiled
def moments(means: Floats, covariances: Floats) -> Floats:
    """Return G (n, 4, 4), the second moments of (s; 1)."""
    count = means.shape[0]
    result = np.empty((count, 4, 4))
    for n in range(count):
        result[n, 3, 3] = 1.0
        for i in range(3):
            result[n, i, 3] = result[n, 3, i] = means[n, i]
            for j in range(3):
                result[n, i, j] = means[n, i] * means[n, j] + covariances[n, i, j]
    return result


@compiled
def posterior_rows(seen: Seen, second: Floats, gamma: float, first: int) -> tuple[Belief, Floats]:
    """Return the belief in the rows of motion, and log det Vd (D,): the M step.

    Args:
        seen: Positions and precisions.
        second: (n, 4, 4) second moments of (s; 1).
        gamma: Precision of the prior of the motion.
        first: Number of the first row, counted from the beginning of the tracks: the first four have a prior mean.
    """
    rows, precisions = seen
    height, count = rows.shape
    means, covariances, log_determinants = np.empty((height, 4)), np.empty((height, 4, 4)), np.empty(height)
    precision, information = np.empty((4, 4)), np.empty(4)
    for d in range(height):
        for i in range(4):
            information[i] = gamma if first + d == i else 0.0
            for j in range(i + 1):
                precision[i, j] = gamma if i == j else 0.0
        for n in range(count):
            weight = precisions[d, n]
            for i in range(4):
                information[i] += weight * rows[d, n] * second[n, i, 3]
                for j in range(i + 1):
                    precision[i, j] += weight * second[n, i, j]
        log_determinants[d] = invert(precision, covariances[d])
        for i in range(4):
            means[d, i] = 0.0
            for j in range(4):
                means[d, i] += covariances[d, i, j] * information[j]
    return (means, covariances), log_determinants


@compiled
def free_energy(seen: Seen, shape: Belief, motion: Belief, log_determinants: Floats, gamma: float, first: int) -> float:
    """Return F, the lower bound on the log density of the positions that were seen (Bando 2007, fig. 4.19, corrected).

    Args:
        seen: Positions and precisions.
        shape: The belief in the points.
        motion: The belief in the rows.
        log_determinants: (D,) log det Vd of the rows' precisions.
        gamma: Precision of the prior of the motion.
        first: Number of the first row.
    """
    (rows, precisions), (thetas, motion_covariances), (means, shape_covariances) = seen, motion, shape
    height, count = rows.shape
    second = moments(means, shape_covariances)
    scratch = np.empty((3, 3))
    energy = 0.0
    for n in range(count):
        # Prior and entropy of the point.
        energy += 1.5 + 0.5 * invert(shape_covariances[n], scratch)
        for i in range(3):
            energy -= 0.5 * second[n, i, i]
        for d in range(height):
            if precisions[d, n] > 0.0:
                square = _expected_square(rows[d, n], thetas[d], motion_covariances[d], second[n], shape_covariances[n])
                energy -= 0.5 * (np.log(2.0 * np.pi) - np.log(precisions[d, n]) + precisions[d, n] * square)
    for d in range(height):
        energy += 0.5 * (4.0 * (1.0 + np.log(gamma)) - log_determinants[d])
        for i in range(4):
            offset = thetas[d, i] - (1.0 if first + d == i else 0.0)
            energy -= 0.5 * gamma * (offset * offset + motion_covariances[d, i, i])
    return energy


@compiled
def _expected_square(
    position: float, motion: Floats, motion_covariance: Floats, second: Floats, shape_covariance: Floats
) -> float:
    """Return the expected square of a position less theta . (s; 1), given moments of theta and of s."""
    apart = position
    square = 0.0
    for i in range(4):
        apart -= motion[i] * second[i, 3]
        for j in range(4):
            square += motion_covariance[i, j] * second[i, j]
    for i in range(3):
        for j in range(3):
            square += motion[i] * motion[j] * shape_covariance[i, j]
    return square + apart * apart


Initial: TypeAlias = Literal["svd", "zero", "random"]

GAMMA = 1e-4
"""Precision of the prior of the motion's entries, 1/px^2."""

ITERATIONS = 10
FIRST_VARIANCE = 1e-6
"""Variance of the rows of a given initial motion."""


@dataclass(frozen=True, eq=False)
class Variational:
    """The posterior of shape and motion.

    Attributes:
        shape: (n, 3) means of the points; about unit variance, known up to an affine map.
        shape_covariances: (n, 3, 3); the prior's, the identity, for a point that was never seen.
        motion: (2 T, 4) means of the rows (m, t), px.
        motion_covariances: (2 T, 4, 4) px^2.
        free_energies: (iterations,) after each, never falling.
        strengths: (3,) strength of each direction of the shape, the greatest first: the explained part, relative to
            what noise alone would explain. A third one near 1 or below means that the depth was not seen: there was too
            little rotation, or the points lie in one plane.
    """

    shape: Floats
    shape_covariances: Floats
    motion: Floats
    motion_covariances: Floats
    free_energies: Floats
    strengths: Floats


def fit(
    tracks: Tracks,
    *,
    iterations: int = ITERATIONS,
    initial: Initial = "svd",
    gamma: float = GAMMA,
    rng: Generator | None = None,
) -> Variational:
    """Factor tracks, with their variances.

    Args:
        tracks: Positions and variances.
        iterations: Passes over shape and motion, at least one.
        initial: The initial motion: by singular values of the weighted tracks; none; or random.
        gamma: Precision of the prior of the motion, 1/px^2.
        rng: For a random one.

    Raises:
        ValueError: There are no iterations, gamma is not above 0, or a random beginning has no generator.
    """
    if iterations < 1 or not gamma > 0.0:
        raise ValueError(f"expected at least one iteration and gamma above 0, got {iterations} and {gamma:g}")
    seen = tracks.matrix, tracks.precisions
    return iterate(seen, initial_motion(seen, initial, gamma, rng), iterations, gamma)


def iterate(seen: Seen, motion: Belief, iterations: int, gamma: float, first: int = 0) -> Variational:
    """Return the posterior after passes from a given motion; arguments as in `passes`."""
    energies = np.empty(iterations)
    for iteration in range(iterations):
        shape = posterior_points(seen, motion)
        motion, logs = posterior_rows(seen, moments(*shape), gamma, first)
        energies[iteration] = free_energy(seen, shape, motion, logs, gamma, first)
    return Variational(*shape, *motion, energies, strengths_of(seen[1], shape[0], motion[0]))


def initial_motion(seen: Seen, initial: Initial, gamma: float, rng: Generator | None = None) -> Belief:
    """Return the initial belief in the motion."""
    rows, precisions = seen
    height = len(rows)
    if initial == "zero":
        # The first three rows have the means of their prior, without which no direction would differ from another.
        motion = np.zeros((height, 4))
        motion[:4] = np.eye(4)[: min(height, 4)]
        return motion, np.broadcast_to(np.eye(4) / gamma, (height, 4, 4)).copy()
    totals = precisions.sum(axis=1)
    means = np.divide((precisions * rows).sum(axis=1), totals, out=np.zeros(height), where=totals > 0.0)
    motion = np.column_stack([np.zeros((height, 3)), means])
    if initial == "random":
        if rng is None:
            raise ValueError("a random beginning needs a generator")
        motion[:, :3] = rng.standard_normal((height, 3))
    else:
        greatest = float(precisions.max())
        weights = np.sqrt(precisions / greatest) if greatest > 0.0 else np.zeros_like(precisions)
        left, strengths, _ = singular_values(weights * (rows - means[:, None]))
        motion[:, :3] = left[:, :3] * strengths[:3] / np.sqrt(rows.shape[1])
    return motion, np.broadcast_to(FIRST_VARIANCE * np.eye(4), (height, 4, 4)).copy()


def metric(found: Variational) -> Variational:
    """Return the posterior after the map that makes the cameras orthographic; the shape is then in px.

    Raises:
        ValueError: The cameras do not determine the map.
    """
    transform = np.eye(4)
    transform[:3, :3] = metric_transform(found.motion[:, :3])
    inverse = solve_system(transform, np.eye(4))[:3, :3].copy()
    return replace(
        found,
        shape=product(found.shape, inverse.T),
        shape_covariances=transform_covariances(found.shape_covariances, inverse),
        motion=product(found.motion, transform),
        motion_covariances=transform_covariances(found.motion_covariances, transform.T),
    )


def transform_covariances(covariances: Floats, matrix: Floats) -> Floats:
    """Return A P A^T of covariances (n, d, d)."""
    return np.array([product(product(matrix, one), matrix.T) for one in covariances])


def strengths_of(precisions: Floats, shape: Floats, motion: Floats) -> Floats:
    """Return the singular values of the whitened fit relative to the greatest one of noise alone."""
    height, count = precisions.shape
    whitened = np.sqrt(precisions) * product(motion[:, :3], (shape - shape.mean(axis=0)).T)
    # Noise of unit variance in a matrix of this size has sqrt(D) + sqrt(n) as its greatest singular value.
    return np.asarray(singular_values(whitened)[1][:3] / (np.sqrt(height) + np.sqrt(count)))


# The online method (Bando 2007, ch. 4 section 5.2) as printed averages the cameras of different frames, which a moving
# camera forbids. Here a window of 90 frames slides on by one, and only the second moments of the shape are averaged
# over time (docs/methods/heads.md). A step drops the oldest frame, finds the camera of the new one from the averaged
# shape, finds the shape from the window, averages, and finds all cameras of the window from the average:
#
#     <<G>> <- (1 - eta) <<G>> + eta G,   eta <- 1 / (1 + lambda / eta).
#
# **Forgetting by how well a point is seen.** With one eta for all, a point that is hidden throughout the window loses
# its shape, and through the cameras it spoils the others; Bando closes with the proposal to control the forgetting
# (section 5.5). With `forgetting` = "by-information" each point has its own average, in which a frame counts by its
# information on the point: with w the information on it in the window (the trace of the precision that the positions
# add),
#
#     W <- lambda W + w,   eta_n = w / W,
#
# which is the same eta for a point that is always seen alike.

Forgetting: TypeAlias = Literal["common", "by-information"]


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings.

    Attributes:
        window: Frames, at least two.
        memory: lambda, 0..1: share of the past that is kept per frame. Small values forget fast.
        forgetting: Whether all points forget alike, or each by its own information.
        iterations: Passes over the first full window.
        gamma: Precision of the prior of the motion, 1/px^2.
    """

    window: int = 90
    memory: float = 0.5
    forgetting: Forgetting = "common"
    iterations: int = 10
    gamma: float = GAMMA

    def __post_init__(self) -> None:
        """Refuse invalid windows and memories."""
        if self.window < 2 or not 0.0 <= self.memory <= 1.0 or self.iterations < 1 or not self.gamma > 0.0:
            raise ValueError(
                "expected a window of at least 2, a memory of 0 to 1, at least one iteration and gamma above 0, "
                f"got {self.window}, {self.memory:g}, {self.iterations} and {self.gamma:g}"
            )


@dataclass(frozen=True, eq=False)
class Online:
    """The state after a frame, immutable.

    Attributes:
        settings: The settings.
        rows: (2 W, n) positions in the window, W at most its length.
        precisions: (2 W, n).
        frames: Number of frames used.
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
    rows: Floats
    precisions: Floats
    frames: int
    second: Floats
    eta: Floats
    totals: Floats
    motion: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    motion_covariances: Floats = field(default_factory=lambda: np.zeros((0, 4, 4)))
    common_eta: float = 1.0
    free_energy: float = float("nan")
    average_energy: float = float("nan")
    best_energy: float = -float("inf")
    published: Floats | None = None

    @property
    def full(self) -> bool:
        """Whether the window is full, so that there is a shape."""
        return self.frames >= self.settings.window

    @property
    def shape(self) -> Floats:
        """(n, 3) the averaged shape, up to an affine map."""
        return self.second[:, :3, 3].copy()

    @property
    def shape_covariances(self) -> Floats:
        """(n, 3, 3) spread of the points within the average."""
        means = self.shape
        return np.asarray(self.second[:, :3, :3] - means[:, :, None] * means[:, None])


def begin(count: int, settings: Settings | None = None) -> Online:
    """Begin with `count` unknown points.

    Raises:
        ValueError: There are fewer than four points.
    """
    if count < FEWEST_POINTS:
        raise ValueError(f"expected at least {FEWEST_POINTS} points, got {count}")
    nothing, none = np.zeros((0, count)), np.zeros(count)
    return Online(settings or Settings(), nothing, nothing, 0, np.zeros((count, 4, 4)), none, none)


def step(state: Online, positions: Floats, variances: Floats) -> Online:
    """Take a frame.

    Args:
        state: The state before.
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
    seen = state.rows, state.precisions
    found = iterate(seen, initial_motion(seen, "svd", gamma), state.settings.iterations, gamma)
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
    (second, eta, totals), (motion, spreads), energy = _slide(
        (state.rows, state.precisions),
        (state.second, state.eta, state.totals),
        (state.motion, state.motion_covariances),
        (memory, settings.forgetting == "common", float(settings.gamma)),
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
    seen: Seen,
    averages: tuple[Floats, Floats, Floats],
    before: Belief,
    settings: tuple[float, bool, float],
    first: int,
) -> tuple[tuple[Floats, Floats, Floats], Belief, float]:
    """Return averages, the belief in the motion, and the free energy of the window.

    Args:
        seen: Positions and precisions in the window, which has slid on already.
        averages: Second moments, eta and totals of the points.
        before: The belief in the motion before.
        settings: Memory, whether all points forget alike, and gamma.
        first: Number of the window's first row.
    """
    (rows, precisions), (second, eta, totals), (motion, spreads) = seen, averages, before
    memory, common, gamma = settings
    height, count = rows.shape
    last = rows[height - 2 :].copy(), precisions[height - 2 :].copy()
    (newest, newest_spreads), _ = posterior_rows(last, second, gamma, first + height - 2)
    cameras, camera_spreads = np.empty((height, 4)), np.empty((height, 4, 4))
    for frame in range(height):
        kept = frame < height - 2
        for i in range(4):
            cameras[frame, i] = motion[frame + 2, i] if kept else newest[frame - height + 2, i]
            for j in range(4):
                camera_spreads[frame, i, j] = (
                    spreads[frame + 2, i, j] if kept else newest_spreads[frame - height + 2, i, j]
                )
    shape, covariances = posterior_points(seen, (cameras, camera_spreads))
    told = _information(covariances)
    fresh = moments(shape, covariances)
    averaged, weights, sums = np.empty_like(second), np.empty(count), np.empty(count)
    for n in range(count):
        weights[n] = 1.0 / (1.0 + memory / eta[n])
        sums[n] = memory * totals[n] + told[n]
        if not common:
            weights[n] = told[n] / sums[n] if sums[n] > 0.0 else 0.0
        for i in range(4):
            for j in range(4):
                averaged[n, i, j] = second[n, i, j] + weights[n] * (fresh[n, i, j] - second[n, i, j])
    motion_now, logs = posterior_rows(seen, averaged, gamma, first)
    energy = free_energy(seen, (shape, covariances), motion_now, logs, gamma, first)
    return (averaged, weights, sums), motion_now, energy


@compiled
def _information(covariances: Floats) -> Floats:
    """Return the positions' information on each point (n,): the trace of the precision less the prior's identity."""
    count = covariances.shape[0]
    told = np.empty(count)
    precision = np.empty((3, 3))
    for n in range(count):
        invert(covariances[n], precision)
        told[n] = max(precision[0, 0] + precision[1, 1] + precision[2, 2] - 3.0, 0.0)
    return told
