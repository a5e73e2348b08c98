"""Geometry: the shape of a face and a head.

`face` has eleven named points with their mean and their spread over people, a smooth surface through these points as a
mesh, and yaw, pitch and roll in everyday terms. Rotations are in `pftrack.core.geometry`, cameras in
`pftrack.core.numerics.matrices`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from pftrack.core.arrays import Floats
from pftrack.core.geometry import nearest_rotation
from pftrack.core.numerics.elementary import exponential, power
from pftrack.core.numerics.matrices import product, solve_system
from pftrack.core.texts import read_whole

# The face as eleven named points, their mean and spread over people; the surface of a head; and gaze.
#
# A face model is rigid: points, the eleven features or others, in the head's own frame, in mm, with the origin midway
# between the corneas, x to the right of the picture (the person's left), y down and z away from the camera (Bando 2007,
# ch. 4 section 4). Names begin with `l` for the person's left, which is the right of the picture.
#
# A person's own face is unknown when a video begins. So a tracker uses the mean of thirteen measured people, not
# including the driver; here people are drawn from published means and standard deviations of adult faces. Most
# variation is symmetric: both sides share one draw, mirrored. Each point adds its own 0.5 mm per coordinate, and the
# size of the whole varies by 3 %. `person(seed)` uses NumPy's `default_rng`, as the reference implementation does, and
# draws in this order: eleven triples, the left points' for both sides, eleven triples of asymmetry, and the size.
# Drivers 99, 101 and 102 are then 2.2, 3.8 and 3.7 mm (root mean square over the points) from the mean model; the
# reference implementation, whose order of draws is not known, has 2.2, 3.9 and 3.6.


class Feature(BaseModel):
    """A point of the face.

    Attributes:
        title: Its everyday name.
        mean_mm: Its mean over people; None for one on the right, which mirrors that on the left.
        sd_mm: The standard deviation about it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    title: str
    mean_mm: tuple[float, float, float] | None = None
    sd_mm: tuple[float, float, float] | None = None


class Features(BaseModel):
    """The declarations of `features.yaml`.

    Attributes:
        features: By name, in order.
        links: Pairs of them to connect by lines in drawings.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    features: dict[str, Feature]
    links: tuple[tuple[str, str], ...]


_DECLARED = read_whole(Features, Path(__file__).with_name("features.yaml"))

FEATURES = tuple(_DECLARED.features)
"""Nose tip; centres, inner and outer corners of the eyes; inner ends of the brows; corners of the mouth."""

TITLES = {name: feature.title for name, feature in _DECLARED.features.items()}
"""Everyday names of the features; left and right are the person's own."""

LINKS = _DECLARED.links
"""Pairs of features between which a line helps the eye."""

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

    points_mm: Floats
    names: tuple[str, ...] = FEATURES

    def __post_init__(self) -> None:
        """Store a read-only copy, and refuse values that are not a face model."""
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

    def __getitem__(self, feature: str) -> Floats:
        """Return the point (3,) of a feature by name, mm."""
        point: Floats = self.points_mm[self.names.index(feature)]
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
    rotation: Floats
    translation: Floats

    def __call__(self, points: Floats) -> Floats:
        """Map points (n, d)."""
        mapped: Floats = product(self.scale * points, self.rotation.T) + self.translation
        return mapped

    def inverse(self, points: Floats) -> Floats:
        """Return what is mapped to points (n, d)."""
        mapped: Floats = product((points - self.translation) / self.scale, self.rotation)
        return mapped


def person(seed: int) -> FaceModel:
    """Draw a person from the statistics; the same seed gives the same person."""
    return _draw(np.random.default_rng(seed))


@cache
def mean_model(people: int = PEOPLE, seed: int = PEOPLE_SEED) -> FaceModel:
    """Return the mean of people drawn one after another from one generator.

    Args:
        people: Number of people.
        seed: Seed of the generator.
    """
    rng = np.random.default_rng(seed)
    return average([_draw(rng) for _ in range(people)])


@cache
def spread_mm2() -> Floats:
    """Return the covariance (3 F, 3 F) of all coordinates over people, read-only.

    By the same statistics as `person`: both sides share one draw, mirrored, each point has its own asymmetry, and all
    share the size.
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


def fit_similarity(source: Floats, target: Floats) -> Similarity:
    """Return the similarity that maps points onto others with the least sum of squared distances.

    Umeyama 1991, by `nearest_rotation` of the cross-covariance, which is never a mirror image. Two points in the plane
    determine it exactly.

    Args:
        source: (n, d) points to be mapped, not all the same.
        target: (n, d) their desired positions.

    Raises:
        ValueError: The shapes differ, a value is not finite, or all points are equal, so the scale is undefined.
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


def place(model: FaceModel, found: Mapping[str, tuple[float, float]]) -> Floats:
    """Return the positions (F, 2) of all points of a frontal face in the picture, px, given some of them.

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
def _statistics() -> tuple[Floats, Floats]:
    """Return mean and standard deviation (11, 3) of all points, mm; those on the right mirror those on the left."""
    mean, spread = np.empty((2, len(FEATURES), 3))
    for index, name in enumerate(FEATURES):
        mirrored = name.startswith("r")
        known = _DECLARED.features["l" + name[1:] if mirrored else name]
        mean[index] = np.array(known.mean_mm) * ((-1.0, 1.0, 1.0) if mirrored else 1.0)
        spread[index] = known.sd_mm
    return mean, spread


# The surface of a head through the eleven points (docs/methods/heads.md) is an egg, a nose on it, and a smooth
# correction that makes it pass through every point of the face model and keeps its shape between them. Depth is a
# function of (x, y) in front; the mesh goes round to behind the ears, with the correction faded out. Units and axes are
# the face model's.
#
# The full mesh has 200 x 220 vertices. The shape is smooth, so half as many in either direction show the same picture
# when colour is looked up for every pixel and only shape and light are interpolated.

HALF_WIDTH_MM, HALF_HEIGHT_MM, HALF_DEPTH_MM = 75.0, 115.0, 95.0
MIDDLE_Y_MM = 8.0
FLATNESS = 2.5
"""Exponent along y; at 2 the head would be an ellipsoid."""

ANCHORS_MM = (
    (0.0, -70.0), (40.0, -50.0), (-40.0, -50.0), (50.0, 45.0), (-50.0, 45.0), (60.0, 0.0), (-60.0, 0.0), (0.0, -35.0),
    (0.0, 100.0),
)  # fmt: skip
ANCHOR_CORRECTION_MM = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -14.0)
"""Forehead, cheeks and temples stay on the egg; the chin comes forward."""

CORRECTION_SD_MM = 16.0
RIDGE = 1e-3
LONGITUDE, LATITUDE = np.deg2rad(115.0), np.deg2rad(89.5)
"""Ending at 86 degrees of latitude, as the reference implementation does, leaves a notch at the crown."""


@dataclass(frozen=True, eq=False)
class HeadMesh:
    """A triangle mesh of a head.

    Attributes:
        vertices_mm: (n, 3) in the head's frame.
        triangles: (m, 3) int32 indices of vertices, clockwise as seen from outside in a frame with y down.
        normals: (n, 3) unit vectors that point outwards.
    """

    vertices_mm: Floats
    triangles: NDArray[np.int32]
    normals: Floats


class HeadSurface:
    """Depth of the front of a head through the points of a face."""

    def __init__(self, model: FaceModel) -> None:
        """Solve for the correction.

        Args:
            model: The face that the surface passes through.
        """
        self._nose = model["nose"]
        self._centres = np.vstack([model.points_mm[:, :2], ANCHORS_MM])
        x, y = model.points_mm[:, 0], model.points_mm[:, 1]
        missing = model.points_mm[:, 2] - egg_depth(x, y) - self._nose_depth(x, y)
        wanted = np.concatenate([missing, ANCHOR_CORRECTION_MM])
        kernel = self._kernel(self._centres[:, 0], self._centres[:, 1])
        self._weights = solve_system(kernel + RIDGE * np.eye(len(wanted)), wanted)

    def depth(self, x: Floats, y: Floats) -> Floats:
        """Return z in mm at (x, y) in mm, arrays of equal shape."""
        return egg_depth(x, y) + self.correction(x, y)

    def correction(self, x: Floats, y: Floats) -> Floats:
        """Return what nose and correction add to the egg's depth, mm."""
        kernel = self._kernel(x, y)
        corrected = product(kernel.reshape(-1, len(self._weights)), self._weights).reshape(np.shape(x))
        added: Floats = self._nose_depth(x, y) + corrected
        return added

    def _kernel(self, x: Floats, y: Floats) -> Floats:
        away = (x[..., None] - self._centres[:, 0]) ** 2 + (y[..., None] - self._centres[:, 1]) ** 2
        return exponential(-away / (2.0 * CORRECTION_SD_MM**2))

    def _nose_depth(self, x: Floats, y: Floats) -> Floats:
        """Return the nose alone: a ridge that rises and widens down to the tip, and ends below it."""
        _, tip_y, tip_z = self._nose
        along = np.maximum(0.0, (y + 4.0) / (tip_y + 4.0))
        width = 6.0 + 5.0 * np.minimum(along, 1.2)
        below = exponential(-((np.maximum(y - tip_y, 0.0) / 6.0) ** 2) / 2.0)
        ridge = power(np.minimum(along, 1.0), 1.4) * below * exponential(-((x / width) ** 2) / 2.0)
        depth: Floats = 0.85 * tip_z * ridge
        return depth


def egg_depth(x: Floats, y: Floats) -> Floats:
    """Return the depth of the egg's front at (x, y), mm; beyond its outline, that of its widest section."""
    off = power(np.abs(y - MIDDLE_Y_MM) / HALF_HEIGHT_MM, FLATNESS)
    inside = np.maximum(0.0, 1.0 - (x / HALF_WIDTH_MM) ** 2 - off)
    depth: Floats = HALF_DEPTH_MM - HALF_DEPTH_MM * np.sqrt(inside)
    return depth


def head_mesh(model: FaceModel, longitudes: int = 200, latitudes: int = 220) -> HeadMesh:
    """Return the mesh of a head.

    Args:
        model: The face that it passes through.
        longitudes: Vertices from ear to ear, over 230 degrees, at least 3.
        latitudes: Vertices from crown to throat, over 179 degrees, at least 3.
    """
    surface = HeadSurface(model)
    longitude, latitude = np.meshgrid(
        np.linspace(-LONGITUDE, LONGITUDE, longitudes), np.linspace(-LATITUDE, LATITUDE, latitudes)
    )
    x = HALF_WIDTH_MM * np.sin(longitude) * np.cos(latitude)
    y = MIDDLE_Y_MM + HALF_HEIGHT_MM * np.sign(np.sin(latitude)) * power(np.abs(np.sin(latitude)), 2.0 / FLATNESS)
    # Depth is a function of (x, y) in front only: the correction must not show again at the back.
    front = np.clip((np.cos(longitude) - 0.15) / 0.35, 0.0, 1.0)
    z = HALF_DEPTH_MM - HALF_DEPTH_MM * np.cos(longitude) * np.cos(latitude) + surface.correction(x, y) * front
    vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    triangles = grid_triangles(longitudes, latitudes)
    return HeadMesh(vertices, triangles, vertex_normals(vertices, triangles))


@lru_cache(maxsize=4)
def grid_triangles(columns: int, rows: int) -> NDArray[np.int32]:
    """Return the triangles (m, 3) of a grid of vertices, row by row, two a cell."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    first = np.stack([corner, corner + 1, corner + columns], axis=1)
    second = np.stack([corner + 1, corner + columns + 1, corner + columns], axis=1)
    triangles = np.concatenate([first, second]).astype(np.int32)
    triangles.flags.writeable = False
    return triangles


def vertex_normals(vertices: Floats, triangles: NDArray[np.int32]) -> Floats:
    """Return unit normals (n, 3): those of the adjoining triangles, averaged by area."""
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    # x right, y down, z away: the cross product of a triangle that runs clockwise to the eye points away from it.
    across = np.cross(c - a, b - a)
    normals = np.zeros_like(vertices)
    for axis in range(3):
        for corner in range(3):
            normals[:, axis] += np.bincount(triangles[:, corner], across[:, axis], len(vertices))
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    unit: Floats = normals / np.maximum(lengths, 1e-12)
    return unit


# Yaw, pitch and roll describe how a head appears in the picture, instead of the angles of a rotation. With d = R (0, 0,
# -1) the direction in which the face looks, in the camera's frame, and e = R (1, 0, 0) its eye line,
#
#     yaw = atan2(d.x, -d.z),   pitch = asin(-d.y),   roll = atan2(e.y, e.x):
#
# yaw is positive when the face looks towards the right side of the picture, pitch when it looks up, roll when the head
# is turned clockwise in the picture. So yaw = -theta_y and pitch = -theta_x exactly; the roll is that of the eye line
# in the picture, which is theta_z only while the head looks into the camera.


def gaze(theta_rad: Floats) -> Floats:
    """Return yaw, pitch and roll (3,), rad, of the angles (theta_x, theta_y, theta_z), rad.

    Pitch is within a quarter of a turn, yaw and roll within half a turn.
    """
    sx, sy, sz = np.sin(theta_rad)
    cx, cy, cz = np.cos(theta_rad)
    return np.array(
        [np.arctan2(-sy * cx, cy * cx), np.arcsin(np.clip(-sx, -1.0, 1.0)), np.arctan2(cx * sz, cy * cz + sy * sx * sz)]
    )


def theta_of(gaze_rad: Floats) -> Floats:
    """Return (theta_x, theta_y, theta_z), rad, of yaw, pitch and roll, rad; the inverse of `gaze`.

    Yaw and pitch must be within a quarter of a turn: the eye line of a head that looks away runs the other way.
    """
    yaw, pitch, roll = gaze_rad
    x, y = -pitch, -yaw
    across = np.cos(roll) * np.cos(x) - np.sin(roll) * np.sin(y) * np.sin(x)
    return np.array([x, y, np.arctan2(np.sin(roll) * np.cos(y), across)])
