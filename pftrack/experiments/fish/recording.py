"""A recording of a fish from above: the shape comes from the mark, and so does how the fish is told from the water.

What was learned of the tank's fish is scaled to the body that is marked: lengths go with its half length, the tolerance
of edges with the square of it. That assumes that fish move alike when measured in bodies a frame, which holds for fish
of one kind at one frame rate at best, and is a start: the width of the diffusion is live.
"""

from typing import ClassVar

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools
from pftrack.core.model.marks import LongBody
from pftrack.core.model.parameters import revise
from pftrack.core.model.recipe import Footage
from pftrack.core.model.setup import Setup, Suitability, grade
from pftrack.core.model.source import FrameSequence, Target, Truth
from pftrack.experiments.fish.model import (
    CAP_PX,
    GOLDFISH,
    Edges,
    FishShape,
    edges_of,
    foreground,
    largest_distances,
    shape,
)
from pftrack.experiments.fish.parameters import FishTrackerParameters
from pftrack.experiments.fish.scene import FishTarget
from pftrack.experiments.shared.recording import RecordingParameters, RecordingSource
from pftrack.experiments.shared.reports import JudgedByBox

LEAST_SIGMA_D_PX2, LARGEST_SIGMA_D_PX2 = 1.0, 400.0
"""Edges are a pixel wide, however small the fish; a fish of more than 320 px has the largest that can be set."""

COLOURFUL, DISTINCT = 60, 0.35
"""Least median saturation of a fish that is told by its colour, and the largest share of such pixels around it."""

HUE_ROOM, SHARE_OF_LOW = 6, 0.7
"""Hues beyond those of nine tenths of the fish, and share of what all but a tenth of it has of the rest."""

AROUND_BODIES = 2.0
"""Radius of what is around a fish, in half lengths."""


class FishBody(LongBody):
    """A fish from above."""

    title: ClassVar[str] = "Fish"

    @classmethod
    def of_target(cls, target: Target) -> "FishBody | None":
        """Return the mark of a fish whose pose is known."""
        if not isinstance(target, FishTarget):
            return None
        ahead = np.array([np.cos(target.theta), np.sin(target.theta)])
        tail = np.array([np.cos(target.theta + target.phi), np.sin(target.theta + target.phi)])
        head = target.position + target.shape.half_length * ahead
        root = target.position - target.shape.half_length * ahead
        tip = root - target.shape.tail_length * tail
        return cls(
            head=tuple(head.tolist()),
            root=tuple(root.tolist()),
            tip=tuple(tip.tolist()),
            half_width=target.shape.half_width,
        )

    @property
    def target(self) -> FishTarget:
        """The fish that is marked, at rest."""
        lengths = FishShape(self.half_length, self.half_width, self.tail_length)
        pose = np.append(self.centre, (self.heading, self.bend))
        return FishTarget.of(pose, lengths, np.zeros(2), hidden=None)


class RecordedFishParameters(JudgedByBox, RecordingParameters, FishTrackerParameters):
    """A recording with an overlay, and its trackers."""


def wire(sequence: FrameSequence, mark: FishBody, start: int, truth: Truth | None) -> Setup:
    """Wire a recording of a fish.

    Args:
        sequence: The pictures.
        mark: The fish in the picture `start`.
        start: Number of the picture to start at.
        truth: True boxes by number of the picture, where they are known.
    """
    target = mark.target
    scaled = 25.0 * (target.shape.half_length / GOLDFISH.half_length) ** 2
    parameters = revise(
        RecordedFishParameters(),
        {
            "half_length_px": min(max(target.shape.half_length, 2.0), 400.0),
            "half_width_px": min(target.shape.half_width, 400.0),
            "tail_length_px": min(target.shape.tail_length, 400.0),
            "sigma_d_px2": min(max(scaled, LEAST_SIGMA_D_PX2), LARGEST_SIGMA_D_PX2),
            **_appearance(sequence.picture(start), target),
        },
    )
    source = RecordingSource(sequence, (0.0, 0.0, 1.0, 1.0), start, truth.at if truth else None, start=target)
    return Setup(lambda _seed, _parameters: source, parameters)


def _appearance(image_rgb: NDArray[np.uint8], target: FishTarget) -> dict[str, object]:
    """Return how a fish is told from what is around it: by its colour if it has one, else by its brightness."""
    on, around = _regions(image_rgb.shape[:2], target)
    hsv = np.asarray(cv2.cvtColor(image_rgb, cv2.COLOR_RGB2HSV), np.int64)
    grey = np.asarray(cv2.cvtColor(image_rgb, cv2.COLOR_RGB2GRAY), np.float64)
    hue, saturation, value = hsv[on].T
    middle = int(np.argmax(np.bincount(hue, minlength=180)))
    off = np.sort((hue - middle + 90) % 180 - 90)
    low, high = (int(off[int(share * (len(off) - 1))]) for share in (0.05, 0.95))
    ranges = {
        "lowest_hue": (middle + low - HUE_ROOM) % 180,
        "highest_hue": (middle + high + HUE_ROOM) % 180,
        "saturation_low": int(SHARE_OF_LOW * np.sort(saturation)[len(off) // 10]),
        "value_low": int(SHARE_OF_LOW * np.sort(value)[len(off) // 10]),
    }
    beside = hsv[around]
    within = (beside[:, 0] - ranges["lowest_hue"]) % 180 <= (ranges["highest_hue"] - ranges["lowest_hue"]) % 180
    alike = within & (beside[:, 1] >= ranges["saturation_low"]) & (beside[:, 2] >= ranges["value_low"])
    difference = float(np.median(grey[around]) - np.median(grey[on])) if around.any() else 0.0
    chosen: dict[str, object] = {
        **ranges,
        "least_contrast": min(max(round(0.5 * abs(difference)), 5), 255),
        "contrast_radius_px": min(max(round(AROUND_BODIES * target.shape.half_length), 3), 200),
    }
    share = float(alike.mean()) if len(alike) else 0.0
    if np.median(saturation) >= COLOURFUL and share <= DISTINCT:
        return {**chosen, "foreground": "colour"}
    return {**chosen, "foreground": "dark" if difference > 0.0 else "light"}


def _regions(size: tuple[int, ...], target: FishTarget) -> tuple[Bools, Bools]:
    """Return the pixels of the inner part of a fish's body, at least one, and those around the fish."""
    rows, columns = np.indices(size[:2])
    x, y = columns - target.position[0], rows - target.position[1]
    cosine, sine = np.cos(target.theta), np.sin(target.theta)
    along, across = cosine * x + sine * y, cosine * y - sine * x
    shape_of = target.shape
    inner = (along / shape_of.half_length) ** 2 + (across / shape_of.half_width) ** 2
    away = np.hypot(x, y) / shape_of.half_length
    own = (inner <= 2.0) | ((np.abs(across) < shape_of.half_width) & (along < 0.0))
    return inner <= max(0.7, float(inner.min())), (away <= AROUND_BODIES) & ~own


def suits(sequence: FrameSequence, footage: Footage, parameters: RecordedFishParameters) -> Suitability:
    """Return how well a marked fish stands out: how much of it is told to be fish, how little of what is around it.

    A fit of the marked outline to the edges is asked for as well; what counts is the worse of the two.
    """
    mark = FishBody.read(footage.mark)
    image = sequence.picture(footage.start)
    seen = edges_of(image, foreground(parameters))
    on, around = _regions(image.shape[:2], mark.target)
    covered, beside = (float((seen.mask[region] > 0).mean()) if region.any() else 0.0 for region in (on, around))
    d_max = _fit(seen, mark, parameters)
    allowed = 0.5 * parameters.half_width_px + 2.0
    value = min(grade(max(covered - beside, 0.0), 0.3, 0.7), grade(allowed / max(d_max, 0.1), 0.5, 1.0))
    told = {"colour": "colour", "dark": "darkness", "light": "brightness"}[parameters.foreground]
    fits = f"within {d_max:.1f} px of edges" if d_max < CAP_PX else f"partly {CAP_PX} px or more from any edge"
    remark = (
        f"{100 * covered:.0f} % of the body is told from the water by its {told}, and {100 * beside:.0f} % of what is "
        f"around it as well; the outline is {fits}"
    )
    return Suitability(value, remark, _advice(parameters, covered, beside, d_max > 2.0 * allowed))


def _fit(seen: Edges, mark: FishBody, parameters: FishTrackerParameters) -> float:
    """Return how far the worst point of the marked outline is from an edge, px."""
    pose = np.asfortranarray(mark.target.pose[None])
    return float(largest_distances(seen.distances, pose, shape(parameters))[0]) / 4.0


def _advice(parameters: RecordedFishParameters, covered: float, beside: float, far: bool) -> tuple[str, ...]:
    by_colour = parameters.foreground == "colour"
    advice = []
    if covered < 0.7:
        wider = "widen the range of hues, or lower the least saturation or brightness"
        advice.append(wider if by_colour else "lower the least contrast, or separate it by its colour")
    if beside > 0.2:
        narrower = "narrow the range of hues, or raise the least saturation or brightness"
        advice.append(narrower if by_colour else "raise the least contrast, or separate it by its colour")
    if far:
        advice.append("mark head, root and tip on the outline; each point of it should lie near an edge")
    if parameters.half_length_px < 8.0:
        advice.append("the fish is a few pixels long, so its bend cannot be seen: expect its place and no more")
    return tuple(advice)
