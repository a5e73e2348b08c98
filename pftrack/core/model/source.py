"""What a source is, and the history of parameters that it looks at."""

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.parameters import Parameters

__all__ = ["History", "Source"]

P_co = TypeVar("P_co", bound=Parameters, covariant=True)
P_contra = TypeVar("P_contra", bound=Parameters, contravariant=True)


@dataclass(frozen=True, slots=True)
class History(Generic[P_co]):
    """Which parameters were in force when: piecewise constant, newest last.

    Attributes:
        segments: Pairs of the first frame and the parameters from there on; the first frame of all is 0.
    """

    segments: tuple[tuple[int, P_co], ...]

    def at(self, frame: int) -> P_co:
        """Return the parameters in force in a frame."""
        for start, parameters in reversed(self.segments):
            if start <= frame:
                return parameters
        raise IndexError(f"a history begins at frame 0, got {frame}")

    def spans(self, frame: int, *names: str) -> list[tuple[int, P_co]]:
        """Return how many of the steps 1..frame each of the parameters governed.

        Args:
            frame: The last step.
            names: Of the parameters that matter; spans that follow each other and have these alike are one. So what
                adds up over them is the same, to the bit, where only others were changed, as those of the tracker.
        """
        starts = [max(start, 1) for start, _ in self.segments if start <= frame]
        ends = [*starts[1:], frame + 1]
        joined: list[tuple[int, P_co]] = []
        for start, end, (_, parameters) in zip(starts, ends, self.segments, strict=False):
            before = joined[-1] if joined else None
            if before and names and all(getattr(before[1], name) == getattr(parameters, name) for name in names):
                joined[-1] = before[0] + end - start, before[1]
            elif end > start:
                joined.append((end - start, parameters))
        return joined


class Source(Protocol[P_contra]):
    """Random access to frames.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second at which it is meant to be seen.
        frame_count: Number of frames, or None if it never ends.
        start: Where the target is at frame 0.
        noisy: Whether the frames depend on the seed; if not, all runs of a batch see the same.
    """

    size: tuple[int, int]
    frame_rate_hz: float
    frame_count: int | None
    start: Target
    noisy: bool

    def frame(self, index: int, history: History[P_contra]) -> Frame:
        """Return a frame; the same arguments give the same frame, to the bit."""
