"""What trackers of a head carry along beside both layers: what the features look like, and whether there is a face.

A face is *doubtful* in a frame in which too few of its features are recognised, or in which they lie elsewhere than a
head of the estimated pose would have them; it is *lost* when it has been so for too long. A lost face is not tracked
but looked for, every few frames, near where it was and then everywhere. What is found is the same face again: its
templates and its frame 0 stay what they were, unless it has come so much nearer or gone so much further away that the
templates no longer fit.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.gaussian import Gaussian
from pftrack.experiments.head.trackers.templates import template_sizes
from pftrack.filters.consensus import middle
from pftrack.vision.detection.cascades import Box
from pftrack.vision.geometry.face_model import FEATURES, FaceModel
from pftrack.vision.likelihoods import template
from pftrack.vision.likelihoods.relief import Reliefs
from pftrack.vision.likelihoods.template import Templates
from pftrack.vision.likelihoods.template_bank import TemplateBank
from pftrack.vision.structure.growing import Growing

__all__ = ["SEARCH_EVERY", "FirstSight", "Form", "HeadMemory", "around", "eye_distance", "widen"]

SEARCH_EVERY = 5
WIDEST_RAD = float(np.deg2rad(60.0))
"""Standard deviation of angles of which nothing is known any more."""


class Form(NamedTuple):
    """The parameters by which the solid and the templates were made from the first sight of the face."""

    face_model: str
    upper_layer: str
    focal_widths: float
    template_scale: float
    restarts: int = 0
    starting_face: str = ""
    templates: str = "flat"

    @property
    def learned_from(self) -> tuple[str, float, int, str]:
        """By what a growing face was learned; with another of it, it begins again."""
        return self.face_model, self.focal_widths, self.restarts, self.starting_face


@dataclass(frozen=True, eq=False)
class FirstSight:
    """The picture in which the templates were cut, kept so that they, and the solid, can be made again.

    Attributes:
        grey: (height, width), 8 bit.
        points_px: (11, 2) the features in it.
        own: The person's own face, as far as it is known.
    """

    grey: NDArray[np.uint8]
    points_px: NDArray[np.float64]
    own: FaceModel

    @cached_property
    def eye_distance_px(self) -> float:
        """How far apart the eyes are."""
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
        bank: Templates, by pose if so asked for.
        sight: From which they were cut.
        form: By which they, and the solid, were made.
        model: The face that is assumed.
        turn: (3, 3) from the model's frame to the solid's, in which the head looks as it did in frame 0.
        box: Around the features where they were last recognised, px.
        enlarged: How many times as large as at first sight the face was when it was last found.
        correlations: (11,) NCC of each feature at its estimated position.
        doubtful_frames: How many frames in a row were doubtful.
        lost_frames: For how many frames the face has been lost; 0 while it is tracked.
        growth: What is known of the person's own face, if the model grows.
        reliefs: The templates in relief, if so asked for.
    """

    bank: TemplateBank
    sight: FirstSight
    form: Form
    model: FaceModel
    turn: NDArray[np.float64]
    box: Box
    enlarged: float = 1.0
    correlations: NDArray[np.float64] = field(default_factory=lambda: np.ones(len(FEATURES)))
    doubtful_frames: int = 0
    lost_frames: int = 0
    growth: Growing | None = None
    reliefs: Reliefs | None = None

    @property
    def nbytes(self) -> int:
        """About how much memory it takes that other frames do not share, bytes; flat templates may be new in any."""
        grown = 0 if self.growth is None else self.growth.nbytes
        return grown + sum(templates.pixels.nbytes for templates in self.bank.sets.values())

    @property
    def lost(self) -> bool:
        """Whether there is no face."""
        return self.lost_frames > 0

    @property
    def template_likeness(self) -> NDArray[np.float64]:
        """(11,) NCC of each frontal template with the one that was cut first; those in relief stay what they were."""
        if self.reliefs is not None:
            return np.ones(len(FEATURES))
        return template.likeness(self.bank.frontal, self.sight.templates(self.form.template_scale))

    def templates(self, theta_rad: NDArray[np.float64], *, by_pose: bool) -> Templates:
        """Return the templates to use at a pose (3,)."""
        return self.bank.choose(theta_rad if by_pose else np.zeros(3))

    def judge(
        self, correlations: NDArray[np.float64], means_px: NDArray[np.float64], patience: int, *, doubtful: bool
    ) -> "HeadMemory":
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

    def misfit(self, expected_px: NDArray[np.float64], means_px: NDArray[np.float64]) -> float:
        """Return how far features (11, 2) are from where they are expected: the median, in distances of the eyes."""
        return float(middle(np.hypot(*(expected_px - means_px).T))) / self.sight.eye_distance_px


def around(points_px: NDArray[np.float64]) -> Box:
    """Return the box of a face (x, y, width, height) with these points (11, 2): half as large again as theirs."""
    low, high = points_px.min(axis=0), points_px.max(axis=0)
    side = 1.5 * float((high - low).max())
    x, y = (low + high) / 2.0 - side / 2.0
    return float(x), float(y), side, side


def eye_distance(points_px: NDArray[np.float64]) -> float:
    """Return the distance between the eyes among points (11, 2), px."""
    left, right = (points_px[FEATURES.index(name)] for name in ("leye", "reye"))
    return float(np.hypot(*(left - right)))


def widen(pose: Gaussian, sd_rad: float) -> Gaussian:
    """Return a belief in angles that nobody has looked at for a frame more."""
    covariance = pose.covariance + sd_rad**2 * np.eye(3)
    most = float(covariance.diagonal().max())
    return Gaussian(pose.mean, covariance if most <= WIDEST_RAD**2 else WIDEST_RAD**2 * np.eye(3))
