"""Appearance of a face's features, and detection of a lost face: templates flat and in relief, and their memory.

Flat templates are as large as Bando's (2007, table 4.1). Templates in relief are the surroundings of each feature at
first sight, laid onto the surface of a head.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics.matrices import contiguous_copy, product, solve_system
from pftrack.core.numerics.random import Gaussian
from pftrack.experiments.head.detection import Box, eye_distance
from pftrack.experiments.shared.pose.methods import slopes_at
from pftrack.experiments.shared.pose.state import Solid
from pftrack.filters.agreement import middle
from pftrack.vision.face import FEATURES, FaceModel, HeadSurface
from pftrack.vision.likelihoods import separation, template
from pftrack.vision.likelihoods.separation import Part, Reliefs, Views
from pftrack.vision.likelihoods.template import Templates, scaled_sizes
from pftrack.vision.structure.growing import Growing

SIZES_PX: Mapping[str, tuple[int, int]] = {
    "nose": (64, 42),
    "leye": (64, 32),
    "reye": (64, 32),
    "lmc": (36, 36),
    "rmc": (36, 36),
    "llc": (36, 36),
    "rlc": (36, 36),
    "lbro": (36, 36),
    "rbro": (36, 36),
    "lmou": (24, 24),
    "rmou": (24, 24),
}
"""Width and height; the table has no size for the ends of the brows, 36 x 36 is a reading."""

EYE_DISTANCE_PX = 108.0
"""Between the eyes of the mean face at Bando's camera; the sizes above are for that."""


def template_sizes(features: Sequence[str], eye_distance_px: float, factor: float = 1.0) -> Ints:
    """Return widths and heights (F, 2) of templates in proportion to the face, px, even numbers.

    Args:
        features: Names, of `SIZES_PX`.
        eye_distance_px: Between the eyes in the picture; at 108 px the sizes are Bando's.
        factor: A further factor on all sizes.
    """
    return scaled_sizes([SIZES_PX[name] for name in features], factor * eye_distance_px / EYE_DISTANCE_PX)


# A face is *doubtful* in a frame in which too few of its features are recognised, or in which they lie elsewhere than a
# head of the estimated pose would have them; it is *lost* when it has been so for too long. A lost face is not tracked
# but searched every few frames, first near its last place and then everywhere. A found face is the same face: its
# templates and its frame 0 remain, unless its distance has changed so much that the templates no longer fit.

SEARCH_EVERY = 5
WIDEST_RAD = float(np.deg2rad(60.0))
"""Standard deviation of angles that are unknown again."""


class Form(NamedTuple):
    """The parameters by which the solid and the templates were made from the first sight of the face."""

    face_model: str
    upper_layer: str
    focal_widths: float
    template_scale: float
    starting_face: str = ""
    templates: str = "flat"

    @property
    def learned_from(self) -> tuple[str, float, str]:
        """By what a growing face was learned; with another of it, it begins again."""
        return self.face_model, self.focal_widths, self.starting_face


@dataclass(frozen=True, eq=False)
class FirstSight:
    """The picture from which the templates were cut, kept to recreate them and the solid.

    Attributes:
        grey: (height, width), 8 bit.
        points_px: (11, 2) the features in it.
        own: The person's own face, as far as it is known.
    """

    grey: NDArray[np.uint8]
    points_px: Floats
    own: FaceModel

    @cached_property
    def eye_distance_px(self) -> float:
        """Distance of the eyes."""
        return eye_distance(self.points_px)

    def templates(self, factor: float) -> Templates:
        """Cut templates, `factor` times as large as Bando's for a face of this size.

        Raises:
            ValueError: A feature is not within the picture.
        """
        sizes = template_sizes(FEATURES, self.eye_distance_px, factor)
        return template.cut(self.grey, self.points_px, sizes)


@dataclass(frozen=True, slots=True, eq=False)
class HeadMemory:
    """Beside the layers, immutable.

    Attributes:
        templates: Those that flat features are compared with.
        sight: From which they were cut.
        form: Parameters of the templates and the solid.
        model: The face that is assumed.
        turn: (3, 3) from the model's frame to the solid's, in which the head looks as it did in frame 0.
        box: Around the features where they were last recognised, px.
        enlarged: Size of the face when it was last found, relative to first sight.
        correlations: (11,) NCC of each feature at its estimated position.
        doubtful_frames: Number of consecutive doubtful frames.
        lost_frames: Number of frames since the face was lost; 0 while it is tracked.
        growth: The belief in the person's own face, if the model grows.
        reliefs: The templates in relief, if so asked for.
    """

    templates: Templates
    sight: FirstSight
    form: Form
    model: FaceModel
    turn: Floats
    box: Box
    enlarged: float = 1.0
    correlations: Floats = field(default_factory=lambda: np.ones(len(FEATURES)))
    doubtful_frames: int = 0
    lost_frames: int = 0
    growth: Growing | None = None
    reliefs: Reliefs | None = None

    @property
    def lost(self) -> bool:
        """Whether there is no face."""
        return self.lost_frames > 0

    @property
    def template_likeness(self) -> Floats:
        """(11,) NCC of each template with the one that was cut first; those in relief do not change."""
        if self.reliefs is not None:
            return np.ones(len(FEATURES))
        return template.likeness(self.templates, self.sight.templates(self.form.template_scale))

    def judge(self, correlations: Floats, means_px: Floats, patience: int, *, doubtful: bool) -> "HeadMemory":
        """Return what is remembered after a frame.

        Args:
            correlations: (11,) NCC at the estimated positions.
            means_px: (11, 2) the estimated positions.
            patience: Doubtful frames after which the face is lost; 0 for never.
            doubtful: Whether this frame is.
        """
        frames = self.doubtful_frames + 1 if doubtful else 0
        lost = 1 if patience and frames >= patience else 0
        box = self.box if doubtful else around(means_px)
        return replace(self, correlations=correlations, doubtful_frames=frames, lost_frames=lost, box=box)

    def misfit(self, expected_px: Floats, means_px: Floats) -> float:
        """Return the median distance of features (11, 2) from their predictions, in distances of the eyes."""
        return float(middle(np.hypot(*(expected_px - means_px).T))) / self.sight.eye_distance_px


def around(points_px: Floats) -> Box:
    """Return the box of a face (x, y, width, height) with these points (11, 2): half as large again as theirs."""
    low, high = points_px.min(axis=0), points_px.max(axis=0)
    side = 1.5 * float((high - low).max())
    x, y = (low + high) / 2.0 - side / 2.0
    return float(x), float(y), side, side


def widen(pose: Gaussian, sd_rad: float) -> Gaussian:
    """Return a belief in angles after one more frame without observation."""
    covariance = pose.covariance + sd_rad**2 * np.eye(3)
    most = float(covariance.diagonal().max())
    return Gaussian(pose.mean, covariance if most <= WIDEST_RAD**2 else WIDEST_RAD**2 * np.eye(3))


MOST_ACROSS = 16
"""Points along the longer side of a template."""

ROUNDS = 6
"""Iterations for a pixel's depth: its place depends on its depth, and the depth on its place."""

DETAIL = 0.22
"""Half the side of the square over which the shading is taken, as a share of the distance between the eyes."""

MIDDLE = 128.0
"""Grey level of a picture without any detail."""

STEP_MM = 0.5
"""Over which the slope of the surface is taken."""

LEAST_FACING = 0.25
"""Cosine between the surface and the line of sight at first sight below which a pixel is left out: it is smeared."""


def cut(sight: FirstSight, factor: float, model: FaceModel, solid: Solid, turn: Floats, upper: str) -> Reliefs:
    """Cut templates around the features at first sight, and lay them onto the face that is assumed.

    Args:
        sight: The picture.
        factor: Their size, see `FirstSight.templates`.
        model: The face.
        solid: The head at first sight.
        turn: (3, 3) from the face's frame to the solid's.
        upper: The camera before which the solid is.
    """
    surface = HeadSurface(model)
    sizes = template_sizes(FEATURES, sight.eye_distance_px, factor)
    if upper == "affine":
        slopes = np.tile(solid.reference[:, :3], (len(FEATURES), 1, 1))
    else:
        slopes = slopes_at(solid, np.concatenate([np.zeros(3), solid.translation_mm]))
    height, width = sight.grey.shape
    grey = detail(sight.grey, sight)
    points, normals, levels, ends = [], [], [], [0]
    for n, ((x, y), (w, h)) in enumerate(zip(sight.points_px, sizes, strict=True)):
        step = max(1.0, max(w, h) / MOST_ACROSS)
        across, down = np.meshgrid(_space(int(w), step), _space(int(h), step))
        offsets = np.stack([across.ravel(), down.ravel()], axis=1)
        place, normal = _lay(offsets, surface, model.points_mm[n], product(slopes[n], turn))
        kept = -normal[:, 2] >= LEAST_FACING
        columns = np.floor(x + offsets[kept, 0] + 0.5).astype(int).clip(0, width - 1)
        rows = np.floor(y + offsets[kept, 1] + 0.5).astype(int).clip(0, height - 1)
        points.append(product(place[kept], turn.T))
        normals.append(product(normal[kept], turn.T))
        levels.append(grey[rows, columns].astype(np.float64))
        ends.append(ends[-1] + len(levels[-1]))
    places, facing = contiguous_copy(np.concatenate(points)), contiguous_copy(np.concatenate(normals))
    return Reliefs(places, facing, np.concatenate(levels), np.array(ends))


def detail(grey: NDArray[np.uint8], sight: FirstSight, part: Part | None = None) -> NDArray[np.uint8]:
    """Return a picture (height, width) less its local mean, about a middle grey.

    The shading of a cheek is alike over tens of pixels and at many places, so a template of it correlates with all of
    them; and it changes as the head turns. Detail identifies a feature.

    Args:
        grey: (height, width).
        sight: The first sight, which gives the size of the face.
        part: The needed part, if not all; the rest is undefined.
    """
    half = round(DETAIL * sight.eye_distance_px)
    left, top, right, bottom = part or (0, 0, *grey.shape[::-1])
    # The local mean at the part's border is that over the picture beyond it.
    rows, columns = slice(max(top - half, 0), bottom + half), slice(max(left - half, 0), right + half)
    near, found = grey[rows, columns], np.full_like(grey, MIDDLE)
    if near.size:
        shading = cv2.blur(near, (2 * half + 1, 2 * half + 1), borderType=cv2.BORDER_REPLICATE)
        found[rows, columns] = cv2.addWeighted(near, 1.0, shading, -1.0, MIDDLE)
    return found


class Look:
    """Fit of templates in relief to one picture; its detail is computed where they are searched."""

    def __init__(self, grey: NDArray[np.uint8], sight: FirstSight, views: Views) -> None:
        """Look at a picture (height, width) by templates as they should look in it."""
        self._grey, self._sight, self._views = grey, sight, views
        self._part: Part = (0, 0, 0, 0)
        self._detail = grey

    def __call__(self, positions: Floats) -> Floats:
        """Return the correlations (F, N) at positions (F, N, 2) px."""
        wanted = separation.reach(positions, self._views, self._grey.shape)
        if not _covers(self._part, wanted):
            self._part, self._detail = wanted, detail(self._grey, self._sight, wanted)
        return separation.correlations(self._detail, positions, self._views)


def _covers(part: Part, other: Part) -> bool:
    (left, top, right, bottom), (west, north, east, south) = part, other
    return left <= west and top <= north and right >= east and bottom >= south


def _space(length_px: int, step_px: float) -> Floats:
    """Return places along a side, px from its middle."""
    count = max(int(length_px / step_px), 2)
    places: Floats = (np.arange(count, dtype=np.float64) - (count - 1) / 2.0) * step_px
    return places


def _lay(offsets_px: Floats, surface: HeadSurface, feature_mm: Floats, slopes: Floats) -> tuple[Floats, Floats]:
    """Return points (P, 3) mm of a surface, relative to a feature's, and their normals, by where they are seen.

    Args:
        offsets_px: (P, 2) from the feature.
        surface: Surface of the head.
        feature_mm: (3,) the feature.
        slopes: (2, 3) px/mm.
    """
    x, y = feature_mm[:2]
    depth = surface.depth(np.array([x]), np.array([y]))
    back = solve_system(slopes[:, :2], np.eye(2))
    z = np.zeros(len(offsets_px))
    for _ in range(ROUNDS):
        flat = product(offsets_px - z[:, None] * slopes[:, 2], back.T)
        z = surface.depth(x + flat[:, 0], y + flat[:, 1]) - depth
    right, below = x + flat[:, 0], y + flat[:, 1]
    by_x = surface.depth(right + STEP_MM, below) - surface.depth(right - STEP_MM, below)
    by_y = surface.depth(right, below + STEP_MM) - surface.depth(right, below - STEP_MM)
    normals = np.column_stack([by_x, by_y, np.full(len(z), -2.0 * STEP_MM)])
    lengths = np.sqrt(np.square(normals).sum(axis=1, keepdims=True))
    return np.column_stack([flat, z]), np.asarray(normals / lengths, np.float64)
