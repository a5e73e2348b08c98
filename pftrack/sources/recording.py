"""A recording as a source: the pictures of a video, with an overlay and, where it is known, the truth."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.parameters import ParameterError, parameter
from pftrack.core.model.sequence import FrameSequence
from pftrack.core.model.source import History
from pftrack.sources.overlay import OverlayParameters, paint

__all__ = ["RecordedBackdrop", "RecordingParameters", "RecordingSource", "check_start"]


MOST_LOOKED_AT = 25
"""Pictures that tell of the background."""


@dataclass(frozen=True)
class RecordedBackdrop:
    """What a recording tells of its background, without what is laid over it.

    Attributes:
        sequence: The pictures.
    """

    sequence: FrameSequence

    def pictures(self, first: int) -> Iterator[NDArray[np.uint8]]:
        """Return pictures of the first so many, or with 0 of all: evenly spaced ones, from the beginning on."""
        count = min(first or self.sequence.frame_count, self.sequence.frame_count)
        looked_at = min(count, MOST_LOOKED_AT)
        return (self.sequence.picture(place * count // looked_at) for place in range(looked_at))


class RecordingParameters(OverlayParameters):
    """What is laid over the recording."""

    distracter_colour: str = parameter(
        "#c83232",
        "Look-alike colour",
        "Colour of the look-alikes; the target's own at first.",
        colour=True,
        group="Occluder and look-alikes",
    )


class RecordingSource:
    """The frames of a recording from a chosen one on.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second.
        frame_count: Frames from the chosen one to the end.
        start: Where the person drew the box, or what else is known of the target in the first picture.
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
            truth: Where the target truly is, by number of the picture within the sequence.
            start: The target in the first picture, if it is more than the middle of the box.

        Raises:
            ParameterError: The first frame is not within the recording.
        """
        check_start(first, sequence)
        self._sequence = sequence
        self._first = first
        self._backdrop = RecordedBackdrop(sequence)
        self._truth = truth
        self._times_s = sequence.times_s[first:] - sequence.times_s[first]
        self.size = sequence.size
        self.frame_rate_hz = sequence.frame_rate_hz
        self.frame_count: int | None = sequence.frame_count - first
        x, y, w, h = box
        self.noisy = False
        self.start = start or Target(np.array([x + (w - 1) / 2, y + (h - 1) / 2]), max(w, h))

    def frame(self, index: int, history: History[RecordingParameters]) -> Frame:
        """Return a picture with its overlay; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        image = self._sequence.picture(self._first + index)
        if parameters.occlusion_width_px > 0 or parameters.distracter_radius_px > 0:
            image = image.copy()
            paint(image, parameters, parameters.distracter_colour)
            image.flags.writeable = False
        target = self._truth(self._first + index) if self._truth else None
        return Frame(index, float(self._times_s[index]), image_rgb=image, target=target, backdrop=self._backdrop)


def check_start(start: int, sequence: FrameSequence) -> None:
    """Refuse a first picture that is not within the recording.

    Raises:
        ParameterError: It is not.
    """
    if not 0 <= start < sequence.frame_count:
        raise ParameterError("start", start, f"a frame of the recording, 0 to {sequence.frame_count - 1}")
