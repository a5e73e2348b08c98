"""Bodies of points: what is between the points, from where each is seen, and what others of the kind look like."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.random import Purpose, Stream
from pftrack.sources.prism import FACES, NAMES, NORMALS, OFFSETS, TOUCHING, VERTICES_MM
from pftrack.vision.geometry.face_model import FEATURES, LINKS, mean_model, person

__all__ = ["Body", "Kind", "Shape", "body_of", "named_shape", "normalise", "unnamed_shape"]

Kind: TypeAlias = Literal["prism", "face", "cloud", "plate"]

HEAD_CENTRE_MM = np.array([0.0, 0.0, 90.0])
"""From the face's origin, about the middle of the head: a feature looks away from there."""

GOLDEN_RAD = np.pi * (3.0 - 5.0**0.5)
CLOUD_AXES = np.array([1.0, 0.7, 0.8])
PRIOR_SD = 0.06
"""Of a face's coordinates about the mean face, relative to its size: 3 mm."""


@dataclass(frozen=True, eq=False)
class Shape:
    """What a body has between its points.

    Attributes:
        names: (n,) of the points.
        edges: (m, 2) numbers of points that belong together.
        triangles: (k, 3) numbers of points, clockwise seen from outside.
        mean: (n, 3) mean of other bodies of the kind, about its centre and of unit size; None where none are known.
        prior_sd: Standard deviation of a coordinate about the mean, of unit size.
    """

    names: tuple[str, ...]
    edges: NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    triangles: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 3), np.int32))
    mean: NDArray[np.float64] | None = None
    prior_sd: float = PRIOR_SD


@dataclass(frozen=True, eq=False)
class Body:
    """A body that can be simulated.

    Attributes:
        shape: What is between its points.
        points: (n, 3) about the centre, of unit size: their root mean square distance from it is 1.
        normals: (n, m, 3) in which directions each point looks: it is seen if one of its planes is.
        offsets: (n, m) of these planes from the centre; infinite for a plane that there is not.
        graded: Whether a point is seen the worse the more it turns away, rather than well or not at all.
    """

    shape: Shape
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    offsets: NDArray[np.float64]
    graded: bool = False


def unnamed_shape(count: int) -> Shape:
    """Return what is known of a body of so many points: nothing else."""
    return Shape(tuple(map(str, range(1, count + 1))))


def named_shape(points: Sequence[str]) -> Shape:
    """Return what is known of a body by the names of its points: other faces, if all are features of one."""
    if not set(points) <= set(FEATURES):
        return Shape(tuple(points))
    mean = mean_model().points_mm[[FEATURES.index(point) for point in points]]
    return Shape(tuple(points), _links(points), mean=normalise(mean))


def _links(points: Sequence[str]) -> NDArray[np.int64]:
    both = [(points.index(one), points.index(other)) for one, other in LINKS if {one, other} <= set(points)]
    return np.array(both, np.int64).reshape(-1, 2)


def normalise(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points (n, 3) about their centre, their root mean square distance from it 1; all zero if they are one."""
    centred = points - points.mean(axis=0)
    size = float(np.sqrt(np.square(centred).sum() / len(centred)))
    return np.asarray(centred / size if size > 0.0 else centred)


@lru_cache(maxsize=16)
def body_of(kind: Kind, seed: int, count: int) -> Body:
    """Return a body.

    Args:
        kind: Which.
        seed: Of a face or a cloud, which one.
        count: Of a cloud or a plate, how many points.
    """
    match kind:
        case "prism":
            return _prism()
        case "face":
            return _face(seed)
        case "cloud":
            return _cloud(seed, count)
        case "plate":
            return _plate(seed, count)


def _prism() -> Body:
    corners = np.array(FACES)
    points = np.concatenate([VERTICES_MM, VERTICES_MM[corners].mean(axis=1)])
    names = (*NAMES, "front", "rear", "left", "right", "top", "bottom")
    edges = sorted({tuple(sorted(pair)) for face in FACES for pair in zip(face, (*face[1:], face[0]), strict=True)})
    fans = [
        (8 + place, *pair) for place, face in enumerate(FACES) for pair in zip(face, (*face[1:], face[0]), strict=True)
    ]
    middle = points.mean(axis=0)
    size = float(np.sqrt(np.square(points - middle).sum() / len(points)))
    faces = np.concatenate([TOUCHING, np.eye(len(FACES), dtype=np.bool_)])
    normals = np.broadcast_to(NORMALS, (len(points), *NORMALS.shape))
    offsets = np.where(faces, (OFFSETS - (NORMALS * middle).sum(axis=1)) / size, np.inf)
    triangles = _outwards(np.array(fans, np.int32), points)
    return Body(Shape(names, np.array(edges), triangles), normalise(points), normals, offsets)


def _outwards(triangles: NDArray[np.int32], points: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return triangles of a convex body, clockwise as they are seen from outside with y downwards and z away."""
    one, two, three = points[triangles].transpose(1, 0, 2)
    away = (np.cross(two - one, three - one) * (one - points.mean(axis=0))).sum(axis=1)
    return np.where((away > 0.0)[:, None], triangles, triangles[:, ::-1])


def _face(seed: int) -> Body:
    points = person(seed).points_mm
    outwards = points - HEAD_CENTRE_MM
    normals = outwards / np.sqrt(np.square(outwards).sum(axis=1))[:, None]
    return Body(named_shape(FEATURES), normalise(points), normals[:, None], np.zeros((len(points), 1)), graded=True)


def _cloud(seed: int, count: int) -> Body:
    """Points on an egg, spread evenly (Fibonacci's spiral) and shifted a little at random."""
    heights = 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    angles = GOLDEN_RAD * np.arange(count)
    radii = np.sqrt(1.0 - heights * heights)
    directions = np.stack([radii * np.cos(angles), heights, radii * np.sin(angles)], axis=1)
    bumps = 1.0 + 0.15 * Stream(seed, 0, Purpose.SCENE).standard_normal((count, 1))
    points = normalise(directions * CLOUD_AXES * bumps)
    return Body(unnamed_shape(count), points, directions[:, None], np.zeros((count, 1)))


def _plate(seed: int, count: int) -> Body:
    """Points in one plane, which is seen from both sides."""
    places = Stream(seed, 0, Purpose.SCENE).standard_normal((count, 2))
    points = normalise(np.column_stack([places, np.zeros(count)]))
    both = np.broadcast_to([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]], (count, 2, 3))
    return Body(unnamed_shape(count), points, both, np.zeros((count, 2)))
