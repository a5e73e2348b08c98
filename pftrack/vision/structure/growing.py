"""A model that grows while it is used: from the mean of others to the body's own, as far as the evidence goes.

A tracker needs points from the first frame on, and at first it has only those of other bodies. The body's own shape is
learned meanwhile (`recursive`, from that mean as the prior). Whether it is the better one is not a matter of how sure
it is of itself: both shapes predict each frame before they have seen it, the camera integrated out, and the log
densities are compared (prequentially; Dawid 1984). The probability that the own shape predicts better follows from the
sum of the differences, of which a share returns to what was thought at first in each frame (fixed share; Herbster and
Warmuth 1998), so that it can change its mind. The weight of the own shape in what is published follows that probability
at a bounded speed, so that a tracker meets no jump:

    published = (1 - weight) mean + weight own,

the own shape turned, moved and scaled onto the mean, since what the tracker calls "frontal" is the mean's.

Both predict as points, as the tracker uses them, without their uncertainty. A shape that only knows how uncertain it is
would win against one that does not, and be no better to track with.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import product, solve_system
from pftrack.vision.geometry.face_model import Similarity, fit_similarity
from pftrack.vision.structure import recursive
from pftrack.vision.structure.cameras import evidence, fit_camera, frontal
from pftrack.vision.structure.positive import invert
from pftrack.vision.structure.recursive import Recursive
from pftrack.vision.structure.tracks import check_view

__all__ = ["Growing", "Settings", "begin", "step"]

CAMERA_ROUNDS = 30
LARGEST_DIFFERENCE = 20.0
"""Of two log densities of one frame: an outlier must not decide alone."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How to learn and to publish.

    Attributes:
        focal_px: Focal length of the pinhole.
        memory: 0..1, what is kept of a well-seen point's precision with each frame; 1 forgets nothing.
        first: Probability, before any evidence, that the own shape predicts better.
        share: Of the probability that returns to that in each frame.
        frames: At least so many it takes from the mean shape to the own one.
        frozen: Whether nothing is learned; the frames still decide which shape is published.
    """

    focal_px: float
    memory: float = 1.0
    first: float = 0.01
    share: float = 0.01
    frames: int = 30
    frozen: bool = False

    def __post_init__(self) -> None:
        """Refuse what are no probabilities."""
        if not (0.0 < self.first < 1.0 and 0.0 <= self.share <= 1.0 and self.frames >= 1):
            raise ValueError(
                "expected a first probability between 0 and 1, a share of 0 to 1 and at least one frame, "
                f"got {self.first:g}, {self.share:g} and {self.frames}"
            )


@dataclass(frozen=True, eq=False)
class Growing:
    """What is known after a frame, immutable.

    Attributes:
        settings: How to learn and to publish.
        mean_shape: (n, 3) of other bodies.
        own: The belief in the body's own shape, in a frame of its own.
        onto_mean: By which the own shape is turned, moved and scaled onto the mean.
        mean_camera: (3, 4) by which the mean shape was fitted to the last frame; None before the first.
        probability: That the own shape predicts better.
        weight: 0..1, of the own shape in what is published.
        advantage: By how much the log density that the own shape gave to the last frame exceeds the mean shape's.
        shape: (n, 3) what is published.
    """

    settings: Settings
    mean_shape: NDArray[np.float64]
    own: Recursive
    onto_mean: Similarity
    mean_camera: NDArray[np.float64] | None
    probability: float
    weight: float
    advantage: float
    shape: NDArray[np.float64]

    @property
    def shape_covariances(self) -> NDArray[np.float64]:
        """(n, 3, 3) of the points of the own shape, the uncertainty of its place, size and rotation included."""
        return self.own.shape_covariances

    @property
    def covariances(self) -> NDArray[np.float64]:
        """(n, 3, 3) of the points of what is published, about the true shape turned, moved and scaled onto the mean.

        The mean shape is off as the prior says, the own one as its belief says, and both share the latter part: so
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
    def nbytes(self) -> int:
        """About how much memory it takes that other frames do not share, bytes."""
        # The covariance is kept beside the precision once somebody has asked for it.
        return 2048 + 2 * self.own.precision.nbytes + 3 * self.shape.nbytes

    @property
    def free_energy(self) -> float:
        """The log density of the last frame under the own shape before it was taken, up to a constant."""
        return self.own.log_evidence


def begin(
    mean_shape: NDArray[np.float64],
    covariance: NDArray[np.float64],
    settings: Settings,
    camera: NDArray[np.float64] | None = None,
) -> Growing:
    """Begin with the mean of other bodies; arguments as for `recursive.begin`."""
    own = recursive.begin(mean_shape, covariance, _of_own(settings), camera)
    onto_mean = fit_similarity(own.shape, own.shape)
    return Growing(settings, own.shape, own, onto_mean, own.camera, settings.first, 0.0, 0.0, own.shape)


def step(state: Growing, positions: NDArray[np.float64], variances: NDArray[np.float64]) -> Growing:
    """Take a frame: let both shapes predict it, then learn from it.

    Args:
        state: As it was; its settings may have been replaced.
        positions: (n, 2) px from the principal point.
        variances: (n, 2) px^2, infinite where a point was not seen.

    Raises:
        ValueError: The shapes differ, a variance is not above 0, or a position that was seen is not finite.
    """
    settings = state.settings
    rows, precisions = check_view(positions, variances, len(state.mean_shape))
    focal = float(settings.focal_px)
    mean_camera = state.mean_camera
    if mean_camera is None:
        mean_camera = frontal(focal, state.mean_shape, rows, precisions)
    own_camera = state.own.camera if state.own.camera is not None else mean_camera
    turn_precision = 1.0 / state.own.settings.turn_sd_rad**2
    mean_camera, usual = _predict(focal, mean_camera, state.mean_shape, rows, precisions, turn_precision)
    own_camera, personal = _predict(focal, own_camera, state.own.shape, rows, precisions, turn_precision)
    # A camera's translation is in the unit of the shape: in another size its flat prior is another.
    advantage = personal - usual - 3.0 * math.log(state.onto_mean.scale)
    advantage = min(max(advantage, -LARGEST_DIFFERENCE), LARGEST_DIFFERENCE)
    odds = state.probability / (1.0 - state.probability) * math.exp(advantage)
    probability = settings.share * settings.first + (1.0 - settings.share) * odds / (1.0 + odds)
    probability = min(probability, 1.0 - ALMOST)
    weight = state.weight + min(max(probability - state.weight, -1.0 / settings.frames), 1.0 / settings.frames)
    if settings.frozen:
        # What is not learned from must be followed all the same.
        own, onto_mean = replace(state.own, camera=own_camera), state.onto_mean
    else:
        own = recursive.take(replace(state.own, settings=_of_own(settings)), rows, precisions)
        onto_mean = fit_similarity(own.shape, state.mean_shape)
    shape = state.mean_shape + weight * (onto_mean(own.shape) - state.mean_shape)
    return Growing(settings, state.mean_shape, own, onto_mean, mean_camera, probability, weight, advantage, shape)


def _shape_only(shape: NDArray[np.float64]) -> NDArray[np.float64]:
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
def _predict(
    focal: float,
    camera: NDArray[np.float64],
    shape: NDArray[np.float64],
    rows: NDArray[np.float64],
    precisions: NDArray[np.float64],
    turn_precision: float,
) -> tuple[NDArray[np.float64], float]:
    """Return the camera that fits a shape to a frame, and the frame's log density given the shape."""
    fitted = fit_camera(focal, camera, shape, rows, precisions, camera, turn_precision, CAMERA_ROUNDS)
    return fitted, evidence(focal, fitted, shape, rows, precisions, camera, turn_precision)
