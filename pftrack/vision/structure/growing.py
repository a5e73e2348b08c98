"""A model that adapts while it is used, from the mean of other bodies to the body's own, if the evidence supports it.

A tracker needs points from the first frame on, and at first it has only those of other bodies. The body's own shape is
learned meanwhile (`recursive`, from that mean as the prior). Its own confidence does not decide whether it is better:
both shapes predict each frame before they have seen it, the camera integrated out, and the log densities are compared
(prequentially; Dawid 1984). The probability that the own shape predicts better follows from the sum of the differences;
a share of it returns to the first probability in each frame (fixed share; Herbster and Warmuth 1998), so the decision
can be reversed. The weight of the own shape in the published one follows that probability at a bounded speed, so a
tracker sees no jump:

    published = (1 - weight) mean + weight own,

the own shape turned, moved and scaled onto the mean, since the mean defines what the tracker calls "frontal".

Both predict as points, as the tracker uses them, without their uncertainty. A shape with an uncertainty would win
against one without, and yet not track better.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials, logarithms
from pftrack.core.numerics.matrices import product, solve_system
from pftrack.vision.face import Similarity, fit_similarity
from pftrack.vision.structure import recursive, variational
from pftrack.vision.structure.cameras import Sight, evidence, fit_camera, frontal, residuals_and_slopes
from pftrack.vision.structure.factorization import Tracks, check_view, invert
from pftrack.vision.structure.recursive import Recursive
from pftrack.vision.structure.variational import Variational

CAMERA_ROUNDS = 30
LARGEST_DIFFERENCE = 20.0
"""Largest difference of two log densities in one frame: an outlier must not decide alone."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How to learn and to publish.

    Attributes:
        focal_px: Focal length of the pinhole.
        memory: 0..1, share of a well-seen point's precision that is kept per frame; 1 forgets nothing.
        first: Prior probability that the own shape predicts better.
        share: Share of the probability that returns to that in each frame.
        frames: Least number of frames from the mean shape to the own one.
        frozen: Whether learning is off; the frames still decide which shape is published.
    """

    focal_px: float
    memory: float = 1.0
    first: float = 0.01
    share: float = 0.01
    frames: int = 30
    frozen: bool = False

    def __post_init__(self) -> None:
        """Refuse values that are not probabilities."""
        if not (0.0 < self.first < 1.0 and 0.0 <= self.share <= 1.0 and self.frames >= 1):
            raise ValueError(
                "expected a first probability between 0 and 1, a share of 0 to 1 and at least one frame, "
                f"got {self.first:g}, {self.share:g} and {self.frames}"
            )


@dataclass(frozen=True, eq=False)
class Growing:
    """The state after a frame, immutable.

    Attributes:
        settings: How to learn and to publish.
        mean_shape: (n, 3) of other bodies.
        own: The belief in the body's own shape, in its own frame.
        onto_mean: Similarity that turns, moves and scales the own shape onto the mean.
        mean_camera: (3, 4) camera of the mean shape fitted to the last frame; None before the first.
        probability: Probability that the own shape predicts better.
        weight: 0..1, weight of the own shape in the published one.
        advantage: Log density of the last frame under the own shape, less that under the mean shape.
        shape: (n, 3) what is published.
    """

    settings: Settings
    mean_shape: Floats
    own: Recursive
    onto_mean: Similarity
    mean_camera: Floats | None
    probability: float
    weight: float
    advantage: float
    shape: Floats

    @property
    def shape_covariances(self) -> Floats:
        """(n, 3, 3) covariances of the own shape's points, including its uncertain place, size and rotation."""
        return self.own.shape_covariances

    @property
    def covariances(self) -> Floats:
        """(n, 3, 3) covariances of the published points about the true shape turned, moved and scaled onto the mean.

        The mean shape has the prior's covariance, the own one that of its belief, and both share the latter part: so
        the weight w leaves (1 - w)^2 of the prior's covariance and the rest of the belief's.
        """
        count, left = len(self.mean_shape), (1.0 - self.weight) ** 2
        joint = self.own.covariance
        if left > 0.0:
            prior = np.empty_like(joint)
            invert(self.own.prior_precision, prior)
            joint = left * prior + (1.0 - left) * joint
        kept = _shape_only(self.mean_shape)
        blocks = product(product(kept, joint), kept).reshape(count, 3, count, 3)
        return blocks[np.arange(count), :, np.arange(count)].copy()

    @property
    def free_energy(self) -> float:
        """The log density of the last frame under the own shape before it was taken, up to a constant."""
        return self.own.log_evidence


def begin(
    mean_shape: Floats,
    covariance: Floats,
    settings: Settings,
    camera: Floats | None = None,
) -> Growing:
    """Begin with the mean of other bodies; arguments as for `recursive.begin`."""
    own = recursive.begin(mean_shape, covariance, _of_own(settings), camera)
    onto_mean = fit_similarity(own.shape, own.shape)
    return Growing(settings, own.shape, own, onto_mean, own.camera, settings.first, 0.0, 0.0, own.shape)


def step(state: Growing, positions: Floats, variances: Floats) -> Growing:
    """Take a frame: let both shapes predict it, then learn from it.

    Args:
        state: The state before; its settings may have been replaced.
        positions: (n, 2) px from the principal point.
        variances: (n, 2) px^2, infinite where a point was not seen.

    Raises:
        ValueError: The shapes differ, a variance is not above 0, or a position that was seen is not finite.
    """
    settings = state.settings
    sight = Sight(float(settings.focal_px), *check_view(positions, variances, len(state.mean_shape)))
    mean_camera = state.mean_camera
    if mean_camera is None:
        mean_camera = frontal(sight, state.mean_shape)
    own_camera = state.own.camera if state.own.camera is not None else mean_camera
    turn_precision = 1.0 / state.own.settings.turn_sd_rad**2
    mean_camera, usual = _predict(sight, mean_camera, state.mean_shape, turn_precision)
    own_camera, personal = _predict(sight, own_camera, state.own.shape, turn_precision)
    # A camera's translation is in the unit of the shape: in another size its flat prior is another.
    advantage = personal - usual - 3.0 * math.log(state.onto_mean.scale)
    advantage = min(max(advantage, -LARGEST_DIFFERENCE), LARGEST_DIFFERENCE)
    odds = state.probability / (1.0 - state.probability) * math.exp(advantage)
    probability = settings.share * settings.first + (1.0 - settings.share) * odds / (1.0 + odds)
    probability = min(probability, 1.0 - ALMOST)
    weight = state.weight + min(max(probability - state.weight, -1.0 / settings.frames), 1.0 / settings.frames)
    if settings.frozen:
        # Frames without learning must be followed, too.
        own, onto_mean = replace(state.own, camera=own_camera), state.onto_mean
    else:
        own = recursive.take(replace(state.own, settings=_of_own(settings)), sight)
        onto_mean = fit_similarity(own.shape, state.mean_shape)
    shape = state.mean_shape + weight * (onto_mean(own.shape) - state.mean_shape)
    return Growing(settings, state.mean_shape, own, onto_mean, mean_camera, probability, weight, advantage, shape)


def _shape_only(shape: Floats) -> Floats:
    """Return the projection (3 n, 3 n) that takes off what moves, turns or scales a shape as a whole."""
    count, centred = len(shape), shape - shape.mean(axis=0)
    ways = np.zeros((7, count, 3))
    for axis, along in enumerate(np.eye(3)):
        ways[axis, :, axis] = 1.0
        ways[3 + axis] = np.cross(along, centred)
    ways[6] = centred
    whole = ways.reshape(7, 3 * count)
    return np.eye(3 * count) - product(whole.T, solve_system(product(whole, whole.T), whole))


ALMOST = 1e-12


def _of_own(settings: Settings) -> recursive.Settings:
    return recursive.Settings(settings.focal_px, settings.memory)


@compiled
def _predict(sight: Sight, camera: Floats, shape: Floats, turn_precision: float) -> tuple[Floats, float]:
    """Return the camera that fits a shape to a frame, and the frame's log density given the shape."""
    fitted = fit_camera(sight, camera, shape, camera, turn_precision, CAMERA_ROUNDS)
    return fitted, evidence(sight, fitted, shape, camera, turn_precision)


# A point that has slipped to another place is measured as exactly as ever, there. One such measurement in fifty ruins a
# factorization of all of them, and even more a shape that is updated frame by frame. So a measurement is either right,
# with its own variance plus that of the point in the shape, or wrong, and then it may lie anywhere on the body. The
# view's camera is fitted to the measurements that are probably right, and its residuals give the probabilities:
# expectation maximisation of a mixture (Dempster, Laird and Rubin 1977; where some measurements are wrong A. Aitkin and
# G. Wilson 1980). A variance divided by the probability gives the expected log likelihood of the measurement, up to a
# constant.
#
# Where no shape is known yet the same is done with the affine fit of a factorization (`fit_despite_outliers`).
#
# At first the shape itself is wrong, and no point is where it should be. So the variances are raised, if needed, until
# the median residual equals its expectation.

ROUNDS = 6
NEWTON_STEPS = 5
FITS = 4
TURN_PRECISION = 100.0
"""Precision of the rotation from frame to frame, 1/rad^2: 6 degrees."""

MEDIAN = 1.3863
"""Median of a chi-square with two degrees of freedom."""

FEWEST = 5
"""Points that are measured in a frame: with fewer, a camera fits whatever is seen."""

MOST_SURPRISE = 200.0
"""Largest log likelihood ratio."""

LEAST = 1e-6
"""Least probability of being right, so wrong measurements keep a finite variance."""


def fit_despite_outliers(tracks: Tracks, wrong: float) -> tuple[Tracks, Variational]:
    """Factor tracks with some wrong measurements.

    Args:
        tracks: Positions and variances.
        wrong: Share of the measurements that are wrong, 0..1; at 0 all are believed.

    Returns:
        The tracks with variances over how likely each measurement is right, and their factorization.
    """
    fit = variational.fit(tracks)
    if not wrong > 0.0:
        return tracks, fit
    variances = tracks.variances.mean(axis=2)
    known = np.where(np.isfinite(tracks.variances), tracks.positions, 0.0)
    doubted = tracks
    for _ in range(FITS):
        expected = product(fit.motion[:, :3], fit.shape.T) + fit.motion[:, 3:]
        distances = np.square(known - expected.reshape(len(known), 2, -1).transpose(0, 2, 1)).sum(axis=2)
        right = _find_right(known, distances, variances, wrong)
        doubted = Tracks(tracks.positions, tracks.variances / right[:, :, None])
        fit = variational.fit(doubted)
    return doubted, fit


@compiled
def find_right(sight: Sight, before: Floats, shape: Floats, covariances: Floats, wrong: float) -> Floats:
    """Return how likely each measurement of a view is right, (n,).

    Args:
        sight: The frame.
        before: (3, 4) camera of the frame before.
        shape: (n, 3).
        covariances: (n, 3, 3) covariances of its points.
        wrong: Share of the measurements that are wrong, 0..1.
    """
    count = len(shape)
    positions, camera = sight.rows.T.copy().reshape(1, count, 2), before
    right: Floats = np.ones((1, count))
    variances, distances, kept = np.empty((1, count)), np.empty((1, count)), sight.precisions.copy()
    for _ in range(ROUNDS):
        residuals, by_point, _ = residuals_and_slopes(sight, camera, shape)
        for n in range(count):
            variances[0, n], distances[0, n] = 0.0, 0.0
            for d in range(2):
                along = by_point[d, n].copy()
                variances[0, n] += 0.5 / sight.precisions[d, n] + 0.5 * _quadratic(along, covariances[n])
                distances[0, n] += residuals[d, n] ** 2
        right = _find_right(positions, distances, variances, wrong)
        for n in range(count):
            for d in range(2):
                kept[d, n] = sight.precisions[d, n] * right[0, n]
        likely_so = Sight(sight.focal_px, sight.rows, kept)
        camera = fit_camera(likely_so, camera, shape, before, TURN_PRECISION, NEWTON_STEPS)
    likely: Floats = right[0]
    return likely


@compiled
def _quadratic(along: Floats, covariance: Floats) -> float:
    """Return the variance of a weighted sum of coordinates."""
    found = 0.0
    for i in range(along.shape[0]):
        for j in range(along.shape[0]):
            found += along[i] * covariance[i, j] * along[j]
    return found


@compiled
def _find_right(positions: Floats, distances: Floats, variances: Floats, wrong: float) -> Floats:
    """Return the probability that measurements of a few frames are right, (T, n); 1 where one is missing.

    Args:
        positions: (T, n, 2) px.
        distances: (T, n) squared distances from where a fit has them, px^2.
        variances: (T, n) of either coordinate, px^2; infinite where a point was not measured.
        wrong: Share of the measurements that are wrong.
    """
    frames, count = distances.shape
    right, measured = np.ones((frames, count)), np.isfinite(variances)
    anywhere = _spread(positions, measured)
    squares: Floats = np.sort((distances / variances).ravel()[measured.ravel()])
    if squares.shape[0] < FEWEST * frames:
        return right
    wider = max(1.0, squares[squares.shape[0] // 2] / MEDIAN)
    for t in range(frames):
        here = np.where(measured[t], wider * variances[t], 1.0)
        there = here + anywhere[t]
        odds = logarithms(wrong / (1.0 - wrong) * here / there)
        for n in range(count):
            odds[n] += min(0.5 * distances[t, n] * (1.0 / here[n] - 1.0 / there[n]), MOST_SURPRISE)
        likely = exponentials(odds)
        for n in range(count):
            if measured[t, n]:
                right[t, n] = max(1.0 / (1.0 + likely[n]), LEAST)
    return right


@compiled
def _spread(positions: Floats, measured: Bools) -> Floats:
    """Return the variance of a coordinate of the measurements in each frame, (T,) px^2."""
    found = np.zeros(positions.shape[0])
    for t in range(positions.shape[0]):
        count = max(int(measured[t].sum()), 1)
        for d in range(2):
            mean = 0.0
            for n in range(measured.shape[1]):
                mean += positions[t, n, d] / count if measured[t, n] else 0.0
            for n in range(measured.shape[1]):
                found[t] += (positions[t, n, d] - mean) ** 2 / (2 * count) if measured[t, n] else 0.0
    return found
