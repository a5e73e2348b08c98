"""How a face is marked: by its features, or by a box in which they are then looked for."""

from collections.abc import Mapping
from typing import ClassVar, Self

from pftrack.core.model.frame import Target
from pftrack.core.model.marks import Box, FeaturePoints
from pftrack.experiments.head.trackers.memory import around
from pftrack.vision.geometry.face_model import LINKS, TITLES

__all__ = ["FaceBox", "FacePoints"]


class FacePoints(FeaturePoints):
    """The eleven features of a face, or some of them; the others are placed by the model."""

    title: ClassVar[str] = "Features of the face"
    features: ClassVar[Mapping[str, str]] = TITLES
    joined: ClassVar[tuple[tuple[str, str], ...]] = LINKS


class FaceBox(Box):
    """A box around a face."""

    title: ClassVar[str] = "Box around the face"
    instruction: ClassVar[str] = "Draw a box from the hair to the chin and from ear to ear."

    @classmethod
    def of_target(cls, target: Target) -> Self | None:
        """Return the box around the whole face: its features leave out hair, chin and ears."""
        if target.landmarks is None:
            return None
        x, y, width, height = around(target.landmarks.points_px)
        return cls.of(x, y, width, height)
