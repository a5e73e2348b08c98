"""A recording as a source: the pictures of a video, with an overlay and, where it is known, the truth.

The overlay is an occluder and look-alikes that any source can have. The occluder is a vertical strip in front of
everything; the distracters are discs in the target's colour at three of six slots around the middle of the picture,
twenty layouts in all (Bando 2007, ch. 3 section 3). On a simulated scene they are the experiment; on a recording they
make an easy clip hard, live.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, wraps
from itertools import combinations
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.files import PictureKey
from pftrack.core.geometry import paint_disc
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.source import Frame, FrameSequence, History, Target
from pftrack.core.numerics.compiled import compiled

LAYOUTS = tuple(combinations(range(6), 3))
"""Which three of the six slots hold a distracter, by layout number; slots run row by row from the left top."""

GROUP = "Occluder and look-alikes"

C = TypeVar("C", bound=Callable[..., Any])


def occlusion_width(default: float) -> Any:  # noqa: ANN401 - a field declaration
    """Declare the occluder's width, px."""
    return parameter(
        default,
        "Occluder width",
        "Width of the vertical strip that hides whatever passes behind it.",
        unit="px",
        within=(0, 640, 1),
        useful=(0, 120),
        group=GROUP,
        role="world",
    )


def distracter_radius(default: float) -> Any:  # noqa: ANN401 - a field declaration
    """Declare the distracters' radius, px."""
    return parameter(
        default,
        "Look-alike radius",
        "Radius of the three discs in the target's colour; 0 shows none.",
        unit="px",
        within=(0, 100, 1),
        useful=(0, 40),
        group=GROUP,
        role="world",
    )


class OccluderParameters(Parameters, group=GROUP):
    """A strip in front of everything; none by default."""

    occlusion_width_px: float = occlusion_width(0)
    occlusion_offset_px: float = parameter(0, "Occluder place", unit="px", within=(-960, 960, 1), useful=(-160, 160))
    """Distance of the strip's middle to the right of the picture's middle."""
    occluder_colour: str = parameter("#3c3c3c", "Occluder colour", colour=True)
    """Colour of the strip."""


class OverlayParameters(OccluderParameters, group=GROUP):
    """The overlay of the picture; nothing by default."""

    distracter_radius_px: float = distracter_radius(0)
    layout: int = parameter(7, "Look-alike layout", within=(0, len(LAYOUTS) - 1, 1))
    """Which three of the six slots around the middle hold a look-alike."""
    slot_spacing_px: float = parameter(60, "Slot spacing", unit="px", within=(0, 640, 1), useful=(0, 160))
    """Distance between neighbouring columns of slots."""
    slot_offset_px: float = parameter(50, "Slot offset", unit="px", within=(0, 540, 1), useful=(0, 140))
    """Distance of the two rows of slots from the middle of the picture."""


def strip(parameters: OccluderParameters, width: int) -> tuple[float, float]:
    """Return the left and right edge of the occluder, px: it covers the columns left <= u < right.

    Args:
        parameters: The occluder.
        width: Width of the picture, px.
    """
    middle = width / 2 + parameters.occlusion_offset_px
    half = parameters.occlusion_width_px / 2
    return middle - half, middle + half


def paint(image_rgb: NDArray[np.uint8], parameters: OverlayParameters, target_colour: str) -> None:
    """Paint the overlay into a picture.

    Args:
        image_rgb: (height, width, 3), changed in place.
        parameters: The overlay.
        target_colour: Colour of the distracters, #rrggbb.
    """
    height, width, _ = image_rgb.shape
    if parameters.distracter_radius_px > 0:
        for slot in LAYOUTS[parameters.layout]:
            row, column = divmod(slot, 3)
            u = width / 2 + (column - 1) * parameters.slot_spacing_px
            v = height / 2 + (2 * row - 1) * parameters.slot_offset_px
            paint_disc(image_rgb, u, v, float(parameters.distracter_radius_px), rgb(target_colour))
    paint_strip(image_rgb, parameters)


def overlaid(image_rgb: NDArray[np.uint8], parameters: OverlayParameters, target_colour: str) -> NDArray[np.uint8]:
    """Return a read-only copy of a picture with its overlay, or the picture itself where nothing lies over it."""
    if parameters.occlusion_width_px <= 0 and parameters.distracter_radius_px <= 0:
        return image_rgb
    image = image_rgb.copy()
    paint(image, parameters, target_colour)
    image.flags.writeable = False
    return image


SHIFT = 4
"""Bits of a sixteenth of a pixel."""


def sixteenths(points: Floats) -> NDArray[np.int32]:
    """Return positions in whole sixteenths of a pixel, as OpenCV takes them with `SHIFT`."""
    return np.asarray(np.rint(2.0**SHIFT * points), np.int32)


def keep_last(compute: C) -> C:
    """Keep what a function computes of the last two pictures, which are tracked first and drawn then.

    Args:
        compute: (picture, further arguments that have a hash) -> what is kept; of a picture that may be written nothing
            is.
    """
    kept = lru_cache(maxsize=2)(lambda picture, *given: compute(picture.image_rgb, *given))

    @wraps(compute)
    def of(image_rgb: NDArray[np.uint8], *given: Any) -> Any:  # noqa: ANN401 - what the function takes and returns
        return compute(image_rgb, *given) if image_rgb.flags.writeable else kept(PictureKey(image_rgb), *given)

    return cast("C", of)


def paint_strip(image_rgb: NDArray[np.uint8], parameters: OccluderParameters) -> None:
    """Paint the occluder into a picture (height, width, 3), in place."""
    width = image_rgb.shape[1]
    left, right = strip(parameters, width)
    first, last = (min(max(int(np.ceil(edge)), 0), width) for edge in (left, right))
    _paint_columns(image_rgb, first, last, rgb(parameters.occluder_colour))


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue, 0..255, of #rrggbb."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


@compiled
def _paint_columns(image_rgb: NDArray[np.uint8], first: int, last: int, colour: tuple[int, int, int]) -> None:
    """Fill the columns first..last - 1, in place."""
    for row in range(image_rgb.shape[0]):
        for column in range(first, last):
            for channel in range(3):
                image_rgb[row, column, channel] = colour[channel]


MOST_LOOKED_AT = 25
"""Pictures that show the background."""


@dataclass(frozen=True)
class RecordedBackdrop:
    """The background of a recording, without the overlay.

    Attributes:
        sequence: The pictures.
    """

    sequence: FrameSequence

    def pictures(self, first: int) -> Iterator[NDArray[np.uint8]]:
        """Return pictures of the first so many, or with 0 of all: evenly spaced ones, from the beginning on."""
        count = min(first or self.sequence.frame_count, self.sequence.frame_count)
        looked_at = min(count, MOST_LOOKED_AT)
        return (self.sequence.picture(place * count // looked_at) for place in range(looked_at))


THEN_EVERY = 5


def frames_to_search(first: int, last: int, *, closely: int, most: int) -> Sequence[int]:
    """Return the numbers of the pictures of a recording to look for a target in, however long it is.

    The first ones are looked into one by one, since most recordings begin with the target, and the others spread
    evenly, since what enters late stays for a while.

    Args:
        first: Number of the first picture.
        last: Number of the last picture.
        closely: Number of pictures examined one by one; later at most every fifth.
        most: Largest number of examined pictures.
    """
    near = range(first, min(first + closely, last + 1))
    every = max(THEN_EVERY, -(-(last + 1 - near.stop) // (most - closely)))
    return [*near, *range(near.stop, last + 1, every)]


class RecordingParameters(OverlayParameters, group=GROUP):
    """The overlay of the recording."""

    distracter_colour: str = parameter("#c83232", "Look-alike colour", colour=True)
    """Colour of the look-alikes; the target's own at first."""


class RecordedFrames:
    """The pictures of a recording from a chosen one on, for sources that make frames of them.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second.
        frame_count: Frames from the chosen one to the end.
        noisy: The pictures do not depend on the seed.
        start: Prior knowledge of the target in the first picture.
    """

    noisy = False

    def __init__(self, sequence: FrameSequence, first: int, start: Target) -> None:
        """Wire a recording up from the picture `first` on."""
        self._sequence, self._first, self.start = sequence, first, start
        self._times_s = sequence.times_s[first:] - sequence.times_s[first]
        self.size, self.frame_rate_hz = sequence.size, sequence.frame_rate_hz
        self.frame_count: int | None = sequence.frame_count - first


class RecordingSource(RecordedFrames):
    """The frames of a recording from a chosen one on; `start` is the user's box, or other prior knowledge.

    An overlay may lie over them.
    """

    def __init__(
        self,
        sequence: FrameSequence,
        box: tuple[float, float, float, float],
        first: int = 0,
        truth: Callable[[int], Target | None] | None = None,
        *,
        start: Target | None = None,
    ) -> None:
        """Wire a recording up.

        Args:
            sequence: The pictures.
            box: Around the target in the first picture used: x and y of the left top corner, width and height, px.
            first: Number of that picture within the sequence.
            truth: True place of the target, by number of the picture within the sequence.
            start: The target in the first picture, if it is more than the middle of the box.
        """
        x, y, w, h = box
        super().__init__(sequence, first, start or Target(np.array([x + (w - 1) / 2, y + (h - 1) / 2]), max(w, h)))
        self._backdrop, self._truth = RecordedBackdrop(sequence), truth

    def frame(self, index: int, history: History[RecordingParameters]) -> Frame:
        """Return a picture with its overlay; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        image = overlaid(self._sequence.picture(self._first + index), parameters, parameters.distracter_colour)
        target = self._truth(self._first + index) if self._truth else None
        return Frame(index, float(self._times_s[index]), image_rgb=image, target=target, backdrop=self._backdrop)
