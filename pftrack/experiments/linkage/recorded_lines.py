"""Four points of a chain on a recording: followed from where a person has marked them, or the tracks of a table.

Each point has a template, cut anew wherever it was found, since what is around a joint turns as the chain moves; so
that it does not drift away, the first template has the last word where it still fits nearby. A point whose best match
fits badly, or that touches the edge, has none in that picture, and is looked for again around where it was last seen.
"""

from collections.abc import Callable
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import parameter
from pftrack.core.model.source import Frame, FrameSequence, History, Measurements, Target
from pftrack.core.numerics.elementary import direction
from pftrack.core.numerics.matrices import product
from pftrack.experiments.linkage.scene import LinkageTarget, in_degrees
from pftrack.experiments.shared.recording import OccluderParameters, paint_strip, strip
from pftrack.sources.tracks.sequence import TrackSequence
from pftrack.vision.matching import LARGEST_TEMPLATE_PX, cut, match

MATCHING = "Following"
POINTS = 4
NEARBY_PX = 3
"""How far from a match the first template is looked for."""

FOLLOWED_SD_PX = 1.0
TILT = 0.5
"""Slope of the plane in which a chain is taken to lie at first, along the way from root to tip."""

Points: TypeAlias = tuple[Floats, Floats]
"""(4, 2) positions in the picture, px, NaN where they are not known, and (4, 2) standard deviations."""


class FollowingParameters(OccluderParameters, group=MATCHING):
    """How marked points are followed, and what is laid over the recording."""

    # fmt: off
    template_px: int = parameter(
        15, "Template", "Side of the square about a point that is looked for in later pictures.",
        unit="px", within=(5, LARGEST_TEMPLATE_PX, 2), live=False)
    search_reach_px: int = parameter(
        16, "Search to", "How far from its last match a point is looked for, to all four sides.",
        unit="px", within=(2, 40, 1), live=False)
    largest_cost: float = parameter(
        0.5, "Largest cost", "One minus the correlation beyond which a match is none; 2 takes all.",
        within=(0, 2, 0.05), live=False)
    # fmt: on


class Followed:
    """Marked points through a recording, each picture looked at once, in order."""

    def __init__(self, sequence: FrameSequence, first: int, points: Floats, parameters: FollowingParameters) -> None:
        """Take up points (4, 2) in the picture `first`."""
        self._sequence, self._first, self._parameters = sequence, first, parameters
        self._size = parameters.template_px // 2 * 2 + 1
        self._places = np.rint(points).astype(np.int64)
        self._original = self._templates = cut(self._grey(0), self._places, self._size)
        # What was marked between pixels stays so.
        self._within = points - self._places
        self._found = [points]

    def at(self, index: int) -> Points:
        """Return the points in the picture `first + index`; the same index gives the same, in whatever order."""
        while len(self._found) <= index:
            self._found.append(self._next(self._grey(len(self._found))))
        return self._found[index], np.full((POINTS, 2), FOLLOWED_SD_PX)

    def _grey(self, index: int) -> NDArray[np.uint8]:
        return np.asarray(cv2.cvtColor(self._sequence.picture(self._first + index), cv2.COLOR_RGB2GRAY), np.uint8)

    def _next(self, grey: NDArray[np.uint8]) -> Floats:
        most, half = self._parameters.largest_cost, self._size // 2
        found = match(grey, self._templates, self._places, self._parameters.search_reach_px, "correlation")
        again = match(grey, self._original, found.places, NEARBY_PX, "correlation")
        original = again.costs <= np.minimum(found.costs + most / 2.0, most)
        places = np.where(original[:, None], again.places, found.places)
        offsets = np.where(original[:, None], again.offsets, found.offsets)
        inside = ((places > half) & (places < np.array(grey.shape[::-1]) - 1 - half)).all(axis=1)
        good = inside & (np.minimum(found.costs, again.costs) <= most)
        self._places = np.where(good[:, None], places, self._places)
        self._templates = np.where(good[:, None, None], cut(grey, self._places, self._size), self._templates)
        return np.where(good[:, None], places + offsets + self._within, np.nan)


def track_points(sequence: TrackSequence, columns: list[int], first: int) -> Callable[[int], Points]:
    """Return four of the tracks of a table, by number of the frame from the frame `first` on."""

    def at(index: int) -> Points:
        number = first + index
        return sequence.positions[number][columns], np.sqrt(sequence.variances[number][columns])

    return at


class RecordedLinkage:
    """The frames of a recording with four points of a chain in each.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second.
        frame_count: Frames from the chosen one to the end.
        start: The chain as it is guessed from the points of the first picture.
        noisy: The frames do not depend on the seed.
    """

    noisy = False

    def __init__(self, sequence: FrameSequence, first: int, start: LinkageTarget, at: Callable[[int], Points]) -> None:
        """Wire a recording up from the picture `first` on.

        Args:
            sequence: The pictures.
            first: Number of the first picture used.
            start: What is guessed of the chain there.
            at: Number of the frame -> the points.
        """
        self._sequence, self._first, self._at = sequence, first, at
        self._times_s = sequence.times_s[first:] - sequence.times_s[first]
        self.size, self.frame_rate_hz = sequence.size, sequence.frame_rate_hz
        self.frame_count: int | None = sequence.frame_count - first
        self.start: Target = start

    def frame(self, index: int, history: History[FollowingParameters]) -> Frame:
        """Return a picture and the points in it; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        image = self._sequence.picture(self._first + index)
        if parameters.occlusion_width_px > 0:
            image = image.copy()
            paint_strip(image, parameters)
            image.flags.writeable = False
        points, sd = self._at(index)
        left, right = strip(parameters, self.size[0])
        seen = np.isfinite(points).all(axis=1) & ~((left <= points[:, 0]) & (points[:, 0] < right))
        measured = Measurements(np.where(seen[:, None], points, np.nan), np.where(seen[:, None], sd, np.inf))
        return Frame(index, float(self._times_s[index]), image_rgb=image, measurements=measured)


def guess(points: Floats) -> LinkageTarget:
    """Return a chain in space that is seen at four points (4, 2), px.

    Any plane that is not seen edge-on holds such a chain. The one that is taken slopes away from the camera from root
    to tip: parallel to the image it would not matter, to first order, how it is turned.
    """
    across = points - points[0]
    chord = across[-1] if np.square(across[-1]).sum() > 0.0 else across[1]
    chord = chord / np.sqrt(np.square(chord).sum())
    places = np.column_stack([across, TILT * (across * chord).sum(axis=1)])
    links = np.diff(places, axis=0)
    lengths = np.sqrt(np.square(links).sum(axis=1))
    normal = np.cross(np.append(chord, TILT), np.array([-chord[1], chord[0], 0.0]))
    normal = normal / np.sqrt(np.square(normal).sum())
    along = links[0] / lengths[0]
    reference = np.column_stack([along, np.cross(normal, along), normal])
    flat = product(links, reference)
    directions = np.array([direction(x, y) for x, y in flat[:, :2].tolist()])
    theta = np.diff(np.append(0.0, directions))
    theta = theta - 2.0 * np.pi * np.round(theta / (2.0 * np.pi))
    theta[0] = 0.0
    position = np.concatenate([np.zeros(5), theta, lengths])
    return LinkageTarget(
        in_degrees(position),
        size=float(np.ptp(points, axis=0).max()),
        hidden=None,
        theta=theta,
        r=lengths,
        omega=np.zeros(3),
        t=np.zeros(2),
        reference=reference,
        origin_px=points[0],
    )
