"""What a source is: frames with what is known to be true of them, and the history of parameters that it looks at.

A frame may also hold beliefs that another loop, or another tracker, has computed. A recording is a source's pictures by
number, with the index of what decodes, and with its truth. `pftrack.sources.sequence` opens, surveys and decodes files;
`pftrack.sources.truth` reads tables of truth.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Generic, Literal, Protocol, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.parameters import Parameters


@dataclass(frozen=True, slots=True, eq=False)
class Belief:
    """What is believed of one target, or what is true of it: all that was said, and None for what was not.

    Attributes:
        target: Number of the target, as whoever computed it has it.
        particles: (N, d) states.
        log_weights: (N,) logarithms of their weights, which need not sum to one; None for equal ones.
        ancestors: (N,) place of each particle's parent in the frame before.
        mean: (d,) of the state, or of a position.
        covariance: (d, d) of the same.
        box: (4,) left and upper edge, width and height, px; the first pixel is 0.
        score: How sure the tracker says it is of the box; NaN if it does not say.
        label: Name of the target; empty if it has none.
    """

    target: int = 0
    particles: Floats | None = None
    log_weights: Floats | None = None
    ancestors: Ints | None = None
    mean: Floats | None = None
    covariance: Floats | None = None
    box: Floats | None = None
    score: float = float("nan")
    label: str = ""

    @property
    def centre(self) -> Floats | None:
        """(2,) middle of the box, px: a box covers whole pixels, and positions count from the centre of the first."""
        return None if self.box is None else self.box[:2] + (self.box[2:] - 1.0) / 2.0


@dataclass(frozen=True, slots=True)
class Plane:
    """Where two components of states are drawn that have no picture: px = scale * state + shift.

    Attributes:
        size: Width and height of the paper, px.
        scale: (2,) px for a unit, across and down.
        shift: (2,) px.
    """

    size: tuple[int, int]
    scale: tuple[float, float] = (1.0, 1.0)
    shift: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Beliefs:
    """What is believed of all targets of a frame, and what is true of them as far as it is known.

    Attributes:
        selected: Of the target that is looked at; the last one known, or else the first, where it is not `present`.
        present: Whether anything is said of it in this frame.
        others: Of the other targets.
        truths: What is true, of as many as there are.
        switches: How many true targets have another number in this frame than they had before.
        components: (tracked,) which components of the state the estimate is.
        names: Of all components; empty where they have none.
        plane: Where states are drawn.
    """

    selected: Belief
    present: bool
    others: tuple[Belief, ...]
    truths: tuple[Belief, ...]
    switches: int
    components: tuple[int, ...]
    names: tuple[str, ...]
    plane: Plane


@dataclass(frozen=True, slots=True, eq=False)
class Landmarks:
    """Named points of a solid target.

    Attributes:
        points_px: (F, 2) where they are in the picture.
        visible: (F,) whether each is seen.
        model_mm: (F, 3) where they are in the target's own frame, as far as that is known.
        names: Of the points.
    """

    points_px: Floats
    visible: Bools
    model_mm: Floats
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Measurements:
    """Positions of F points as they were measured, with noise that is known.

    Attributes:
        points_px: (F, 2) in the picture; NaN for a point that was not measured.
        sd_px: (F,) standard deviation of each measurement, or (F, 2) where it is not the same across and down; infinite
            for a point that was not measured.
    """

    points_px: Floats
    sd_px: Floats


@dataclass(frozen=True, slots=True)
class Target:
    """Where the target truly is.

    Attributes:
        position: (d,) centre; (u, v) in px of the picture with u the column and v the row; or the signal's value; or
            the pose of a solid, (theta_x, theta_y, theta_z) in rad.
        size: Longer side of the box around it, px; 0 for a signal.
        hidden: Whether it is known to be out of sight; None for what cannot be, such as a signal.
        landmarks: Its points, if it is a solid that is tracked by them.
        extent: Width and height of the box around it, px; None for a target without one, such as a signal or a pose.
    """

    position: Floats
    size: float = 0.0
    hidden: bool | None = False
    landmarks: Landmarks | None = None
    extent: tuple[float, float] | None = None


class Backdrop(Protocol):
    """Pictures of a source that tell what is behind its target; it can be a key, and the same one has the same."""

    def pictures(self, first: int) -> Iterator[NDArray[np.uint8]]:
        """Return some of the first so many pictures (height, width, 3), or with 0 some of all, evenly."""

    def __hash__(self) -> int:
        """Return the same for the same pictures."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One instant of a source.

    Attributes:
        index: Number of the frame within the run, from 0.
        time_s: Time since frame 0, s.
        image_rgb: (height, width, 3) uint8, read-only, or None for a signal.
        signal: (d,) observed values, or None for a picture.
        measurements: Measured points, or None where the picture is all there is.
        target: The truth, or None where it is not known.
        backdrop: Where to see what is behind the target, or None where nothing tells.
        beliefs: What others believe of it, or None where nothing but the frame is given.
    """

    index: int
    time_s: float
    image_rgb: NDArray[np.uint8] | None = None
    signal: Floats | None = None
    measurements: Measurements | None = None
    target: Target | None = None
    backdrop: Backdrop | None = None
    beliefs: Beliefs | None = None

    @property
    def picture(self) -> NDArray[np.uint8]:
        """The picture (height, width, 3), where one is needed.

        Raises:
            ValueError: The frame has none.
        """
        if self.image_rgb is None:
            raise ValueError("a picture is needed, got a frame without one")
        return self.image_rgb


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


Kind: TypeAlias = Literal["video", "gif", "images", "tracks", "beliefs"]


@dataclass(frozen=True, slots=True)
class FrameIndex:
    """What one pass over a sequence has found; opening with it again skips the pass.

    Attributes:
        kind: What the sequence is made of.
        sha256: Of the file's content; of a folder, of its pictures' digests in order.
        width: Of every picture, turned upright, px.
        height: Of every picture, turned upright, px.
        frame_rate_hz: Frames a second; the mean where the rate varies.
        times_s: When each frame is shown, from 0, s.
        checksums: CRC-32 of each frame's RGB bytes.
        stamps: Each frame's time in the container's own ticks, rising; empty where they cannot be used to seek.
        keyframes: Numbers of the frames at which decoding can begin.
        orientation: How stored pictures are turned upright, see `pftrack.sources.video`.
        warnings: Sentences for people about what is odd.
    """

    kind: Kind
    sha256: str
    width: int
    height: int
    frame_rate_hz: float
    times_s: tuple[float, ...]
    checksums: tuple[int, ...]
    stamps: tuple[int, ...] = ()
    keyframes: tuple[int, ...] = ()
    orientation: int = 0
    warnings: tuple[str, ...] = ()

    @property
    def frame_count(self) -> int:
        """How many frames there are."""
        return len(self.checksums)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of every picture, px."""
        return self.width, self.height

    @property
    def duration_s(self) -> float:
        """How long it lasts, s; the last frame is shown as long as the mean one."""
        return self.times_s[-1] + 1 / self.frame_rate_hz

    def to_json(self) -> str:
        """Write the index as one line of JSON."""
        return _ADAPTER.dump_json(self).decode()

    @classmethod
    def from_json(cls, text: str) -> "FrameIndex":
        """Read what `to_json` wrote.

        Raises:
            ValueError: It is something else.
        """
        index = _ADAPTER.validate_json(text)
        if len(index.times_s) != index.frame_count or len(index.stamps) not in {0, index.frame_count}:
            raise ValueError(f"expected a time and a stamp for each of {index.frame_count} frames, got others")
        return index


_ADAPTER = TypeAdapter(FrameIndex)


class FrameSequence(ABC):
    """Random access to pictures of one size.

    Attributes:
        name: The file's or folder's own name, without its path.
        index: All that the survey found; what follows from it is below.
    """

    name: str
    index: FrameIndex

    @property
    def frame_count(self) -> int:
        """How many frames really decode."""
        return self.index.frame_count

    @property
    def frame_rate_hz(self) -> float:
        """Frames a second; the mean where the rate varies."""
        return self.index.frame_rate_hz

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of every picture, px."""
        return self.index.size

    @property
    def sha256(self) -> str:
        """Digest of the content."""
        return self.index.sha256

    @property
    def times_s(self) -> Floats:
        """When each frame is shown, (frame_count,), from 0, s."""
        return np.array(self.index.times_s)

    @property
    def square(self) -> bool:
        """Whether pixels are square, or were made so; an earlier version took oblong ones as they are stored."""
        return True

    def picture(self, index: int) -> NDArray[np.uint8]:
        """Return a frame, (height, width, 3) RGB, read-only.

        Args:
            index: Its number, from 0.

        Raises:
            IndexError: There is no such frame.
            RefusedError: The file has changed since it was surveyed.
        """
        if not 0 <= index < self.frame_count:
            raise IndexError(f"frame must be between 0 and {self.frame_count - 1}, got {index}")
        return self._picture(index)

    @abstractmethod
    def _picture(self, index: int) -> NDArray[np.uint8]:
        """Return a frame that there is."""

    def close(self) -> None:
        """Let go of files and cached pictures."""
        return


class Truth(Protocol):
    """What is known of a recording: numbers by frame, and the target that they mean."""

    @property
    def rows(self) -> Mapping[int, tuple[float, ...]]:
        """The numbers of each frame that has any, as the file has them."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was passed over in reading, one sentence each."""

    def at(self, frame: int) -> Target | None:
        """Return the target of a frame, or None where there is no truth."""
