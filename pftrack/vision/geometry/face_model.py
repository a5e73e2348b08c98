"""The face as eleven named points: its mean and its spread over people, persons drawn from them, and the mean model.

A face model is rigid: points, the eleven features or others, in the head's own frame, in mm, with the origin midway
between the corneas, x to the right of the picture (the person's left), y down and z away from the camera (Bando 2007,
ch. 4 section 4). Names begin with `l` for the person's left, which is the right of the picture.

No one's own face is known when a video begins. So a tracker uses the mean of thirteen measured people, the driver not
among them; here people are drawn from published means and standard deviations of adult faces. What varies is mostly
symmetric: both sides share one draw, mirrored; 0.5 mm a coordinate is each point's own, and 3 % is the size of the
whole. `person(seed)` uses NumPy's `default_rng`, as the reference implementation does, and draws in this
order: eleven triples of which the left points' count for both sides, eleven triples of asymmetry, and the size. Drivers
99, 101 and 102 are then 2.2, 3.8 and 3.7 mm (root mean square over the points) from the mean model; the reference
implementation, whose order of draws is not known, has 2.2, 3.9 and 3.6.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.rotation import nearest_rotation
from pftrack.core.numerics.matrices import product

__all__ = [
    "FEATURES",
    "LINKS",
    "TITLES",
    "FaceModel",
    "Similarity",
    "average",
    "fit_similarity",
    "mean_model",
    "person",
    "place",
    "spread_mm2",
]

FEATURES = ("nose", "leye", "reye", "lmc", "rmc", "llc", "rlc", "lbro", "rbro", "lmou", "rmou")
"""Nose tip; centres, inner and outer corners of the eyes; inner ends of the brows; corners of the mouth."""

TITLES = {
    "nose": "tip of the nose",
    "leye": "left eye",
    "reye": "right eye",
    "lmc": "left eye, inner corner",
    "rmc": "right eye, inner corner",
    "llc": "left eye, outer corner",
    "rlc": "right eye, outer corner",
    "lbro": "left brow, inner end",
    "rbro": "right brow, inner end",
    "lmou": "left corner of the mouth",
    "rmou": "right corner of the mouth",
}
"""What people call the features; left and right are the person's own."""

LINKS = (
    ("rlc", "reye"),
    ("reye", "rmc"),
    ("lmc", "leye"),
    ("leye", "llc"),
    ("rbro", "lbro"),
    ("rmc", "nose"),
    ("nose", "lmc"),
    ("rmou", "lmou"),
)
"""Pairs of features between which a line helps the eye: eyes, brows, nose and mouth."""

_LEFT = {
    "nose": ((0.0, 38.0, -26.0), (0.0, 3.0, 2.2)),
    "leye": ((31.5, 0.0, 0.0), (1.8, 0.8, 1.5)),
    "lmc": ((16.5, 1.0, 6.0), (1.3, 0.8, 1.5)),
    "llc": ((45.0, -1.0, 14.0), (2.0, 1.0, 2.0)),
    "lbro": ((14.0, -20.0, -3.0), (2.0, 2.5, 2.0)),
    "lmou": ((26.0, 67.0, 2.0), (1.8, 3.5, 2.5)),
}
"""Mean and standard deviation over people of the points on the person's left, mm (docs/methods/heads.md)."""

ASYMMETRY_SD_MM = 0.5
SIZE_SD = 0.03
PEOPLE, PEOPLE_SEED = 13, 1300
ALIGNMENT_ROUNDS = 5


@dataclass(frozen=True, eq=False)
class FaceModel:
    """Named points of one face; two models of the same names and points are equal.

    Attributes:
        points_mm: (F, 3) in the head's frame, in the order of the names, read-only.
        names: (F,) of the points; the eleven features if not given.
    """

    points_mm: NDArray[np.float64]
    names: tuple[str, ...] = FEATURES

    def __post_init__(self) -> None:
        """Keep an own read-only copy, and refuse what is no face model."""
        points = np.array(self.points_mm, dtype=np.float64)
        if points.shape != (len(self.names), 3) or not np.isfinite(points).all():
            raise ValueError(f"expected {len(self.names)} finite points (x, y, z) in mm, got shape {points.shape}")
        if len(set(self.names)) < len(self.names):
            raise ValueError(f"expected a name for each point, got {', '.join(self.names)}")
        points.flags.writeable = False
        object.__setattr__(self, "points_mm", points)

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, FaceModel)
            and self.names == other.names
            and np.array_equal(self.points_mm, other.points_mm)
        )

    def __hash__(self) -> int:
        return hash((self.names, self.points_mm.tobytes()))

    def __getitem__(self, feature: str) -> NDArray[np.float64]:
        """Return the point (3,) of a feature by name, mm."""
        point: NDArray[np.float64] = self.points_mm[self.names.index(feature)]
        return point


@dataclass(frozen=True, eq=False)
class Similarity:
    """A map x -> scale R x + translation in d dimensions.

    Attributes:
        scale: Above 0.
        rotation: (d, d), a proper rotation.
        translation: (d,).
    """

    scale: float
    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map points (n, d)."""
        mapped: NDArray[np.float64] = product(self.scale * points, self.rotation.T) + self.translation
        return mapped

    def inverse(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what is mapped to points (n, d)."""
        mapped: NDArray[np.float64] = product((points - self.translation) / self.scale, self.rotation)
        return mapped


def person(seed: int) -> FaceModel:
    """Draw a person from the statistics; the same seed gives the same person."""
    return _draw(np.random.default_rng(seed))


@cache
def mean_model(people: int = PEOPLE, seed: int = PEOPLE_SEED) -> FaceModel:
    """Return the mean of people drawn one after another from one generator.

    Args:
        people: How many.
        seed: Of the generator.
    """
    rng = np.random.default_rng(seed)
    return average([_draw(rng) for _ in range(people)])


@cache
def spread_mm2() -> NDArray[np.float64]:
    """Return how people vary about their mean, the covariance (3 F, 3 F) of all coordinates, read-only.

    By the same statistics as `person`: both sides share one draw, mirrored, each point has some asymmetry of its own,
    and all have the size in common.
    """
    mean, spread = _statistics()
    count = len(FEATURES)
    joint = np.zeros((count, 3, count, 3))
    for place, name in enumerate(FEATURES):
        joint[place, :, place] = np.diag(np.square(spread[place]) + ASYMMETRY_SD_MM**2)
        if name.startswith("r"):
            shared = np.diag(np.square(spread[place]) * (-1.0, 1.0, 1.0))
            joint[place, :, place - 1] = joint[place - 1, :, place] = shared
    coordinates = mean.ravel()
    covariance = joint.reshape(3 * count, 3 * count) + SIZE_SD**2 * coordinates[:, None] * coordinates
    covariance.flags.writeable = False
    return covariance


def average(models: list[FaceModel]) -> FaceModel:
    """Return the mean face: five times each is aligned to the mean by a similarity, and the mean taken again.

    Args:
        models: At least one, all of the same names.
    """
    shapes = [model.points_mm for model in models]
    # Beginning with one person would give the mean that person's tilt, and a tilted model mixes yaw with roll.
    mean = np.mean(shapes, axis=0)
    for _ in range(ALIGNMENT_ROUNDS):
        mean = np.mean([fit_similarity(shape, mean)(shape) for shape in shapes], axis=0)
    return FaceModel(mean, models[0].names)


def fit_similarity(source: NDArray[np.float64], target: NDArray[np.float64]) -> Similarity:
    """Return the similarity that maps points onto others with the least sum of squared distances.

    Umeyama 1991, by `nearest_rotation` of the cross-covariance, which is never a mirror image. Two points in the plane
    determine it exactly.

    Args:
        source: (n, d) points to be mapped, not all the same.
        target: (n, d) where they should come to lie.

    Raises:
        ValueError: The shapes differ, a value is not finite, or all points are the same, so that there is no scale.
    """
    if source.shape != target.shape or source.ndim != 2:
        raise ValueError(f"expected as many points as targets, got shapes {source.shape} and {target.shape}")
    if not np.isfinite((source, target)).all():
        raise ValueError("expected finite points, got some that are not")
    middle, aim = source.sum(axis=0) / len(source), target.sum(axis=0) / len(target)
    spread, aimed = source - middle, target - aim
    power = float((spread * spread).sum())
    cross = product(aimed.T, spread)
    rotation = nearest_rotation(cross)
    strength = float((rotation * cross).sum())
    if power <= 0.0 or strength <= 0.0:
        raise ValueError("expected points that differ from each other, got all at one place")
    scale = strength / power
    return Similarity(scale, rotation, aim - scale * product(rotation, middle))


def place(model: FaceModel, found: Mapping[str, tuple[float, float]]) -> NDArray[np.float64]:
    """Return where all points (F, 2) of a frontal face lie in the picture, px, given some of them.

    The model's x and y are mapped by the similarity that fits the given points best; the two eye centres suffice.

    Args:
        model: The face.
        found: Position (x, y) in px by name, at least two.

    Raises:
        ValueError: A name is unknown, there are fewer than two, or they are all at one place.
    """
    unknown = sorted(set(found) - set(model.names))
    if unknown or len(found) < 2:
        raise ValueError(f"expected at least two of {', '.join(model.names)}, got {', '.join(found) or 'none'}")
    known = np.array([model[name][:2] for name in found])
    return fit_similarity(known, np.array(list(found.values()), dtype=np.float64))(model.points_mm[:, :2])


def _draw(rng: np.random.Generator) -> FaceModel:
    mean, spread = _statistics()
    draws = rng.standard_normal(mean.shape)
    for index, name in enumerate(FEATURES):
        if name.startswith("r"):
            draws[index] = draws[index - 1] * (-1.0, 1.0, 1.0)
    points = mean + spread * draws + ASYMMETRY_SD_MM * rng.standard_normal(mean.shape)
    return FaceModel(points * (1.0 + SIZE_SD * rng.standard_normal()))


@cache
def _statistics() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return mean and standard deviation (11, 3) of all points, mm; those on the right mirror those on the left."""
    mean, spread = np.empty((2, len(FEATURES), 3))
    for index, name in enumerate(FEATURES):
        mirrored = name.startswith("r")
        middle, sd = _LEFT["l" + name[1:] if mirrored else name]
        mean[index] = np.array(middle) * ((-1.0, 1.0, 1.0) if mirrored else 1.0)
        spread[index] = sd
    return mean, spread
