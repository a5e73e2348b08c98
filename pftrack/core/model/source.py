"""Sources: frames with their known truth, and the history of the parameters that a source reads.

A frame may also hold beliefs that another loop or tracker computed. A recording gives pictures by number, with an index
of the frames that decode, and its truth. `pftrack.sources.sequence` opens, surveys and decodes files;
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
    """A belief about one target, or its truth; fields that were not given are None.

    Attributes:
        target: Number of the target in the recording.
        particles: (N, d) states.
        log_weights: (N,) logarithms of their weights, which need not sum to one; None for equal weights.
        ancestors: (N,) index of each particle's parent in the frame before.
        mean: (d,) mean of the state or of a position.
        covariance: (d, d) its covariance.
        box: (4,) left and upper edge, width and height, px; the first pixel is 0.
        score: Confidence that the tracker gives for the box; NaN without one.
        label: Name of the target; empty without one.
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
        """(2,) centre of the box, px; a box covers whole pixels, and positions count from the centre of the first."""
        return None if self.box is None else self.box[:2] + (self.box[2:] - 1.0) / 2.0


@dataclass(frozen=True, slots=True)
class Plane:
    """Plane on which to draw two components of states without a picture: px = scale * state + shift.

    Attributes:
        size: Width and height of the plane, px.
        scale: (2,) px per unit, across and down.
        shift: (2,) px.
    """

    size: tuple[int, int]
    scale: tuple[float, float] = (1.0, 1.0)
    shift: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Beliefs:
    """Beliefs about all targets of a frame, and their known truth.

    Attributes:
        selected: Belief about the selected target; if it is not `present`, its last known belief, else its first.
        present: Whether this frame has a belief about the selected target.
        others: Beliefs about the other targets.
        truths: Truth of each target.
        switches: Number of true targets whose number in the tracker's output changed in this frame.
        components: (tracked,) components of the state that form the estimate.
        names: Names of all components; empty without names.
        plane: Plane on which states are drawn.
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
        points_px: (F, 2) positions in the picture.
        visible: (F,) whether each point is visible.
        model_mm: (F, 3) positions in the target's own frame, if known.
        names: Names of the points.
    """

    points_px: Floats
    visible: Bools
    model_mm: Floats
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Measurements:
    """Measured positions of F points with known noise.

    Attributes:
        points_px: (F, 2) positions in the picture; NaN for a point that was not measured.
        sd_px: (F,) standard deviation of each measurement, or (F, 2) if it differs across and down; infinite for a
            point that was not measured.
    """

    points_px: Floats
    sd_px: Floats


@dataclass(frozen=True, slots=True)
class Target:
    """The truth of a target.

    Attributes:
        position: (d,) centre (u, v) in px of the picture, with column u and row v; or the value of a signal; or the
            pose of a solid, (theta_x, theta_y, theta_z) in rad.
        size: Longer side of the box around it, px; 0 for a signal.
        hidden: Whether it is known to be out of sight; None for a target that cannot be, such as a signal.
        landmarks: Points of a solid that is tracked by them.
        extent: Width and height of the box around it, px; None for a target without one, such as a signal or a pose.
    """

    position: Floats
    size: float = 0.0
    hidden: bool | None = False
    landmarks: Landmarks | None = None
    extent: tuple[float, float] | None = None


class Backdrop(Protocol):
    """Pictures of a source that show the background of its target; equal backdrops have equal pictures."""

    def pictures(self, first: int) -> Iterator[NDArray[np.uint8]]:
        """Return evenly spaced ones of the first `first` pictures (height, width, 3), or of all if it is 0."""

    def __hash__(self) -> int:
        """Return a hash that is equal for equal pictures."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One instant of a source.

    Attributes:
        index: Number of the frame within the run, from 0.
        time_s: Time since frame 0, s.
        image_rgb: (height, width, 3) uint8, read-only, or None for a signal.
        signal: (d,) observed values, or None for a picture.
        measurements: Measured points, or None if there is only the picture.
        target: The truth, or None if unknown.
        backdrop: Pictures of the background, or None.
        beliefs: Recorded beliefs, or None.
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
        """The picture (height, width, 3).

        Raises:
            ValueError: The frame has no picture.
        """
        if self.image_rgb is None:
            raise ValueError("a picture is needed, got a frame without one")
        return self.image_rgb


P_co = TypeVar("P_co", bound=Parameters, covariant=True)
P_contra = TypeVar("P_contra", bound=Parameters, contravariant=True)


@dataclass(frozen=True, slots=True)
class History(Generic[P_co]):
    """Parameters in force over time, piecewise constant, newest last.

    Attributes:
        segments: Pairs of a first frame and the parameters from there on; the first pair begins at frame 0.
    """

    segments: tuple[tuple[int, P_co], ...]

    def at(self, frame: int) -> P_co:
        """Return the parameters in force in a frame."""
        for start, parameters in reversed(self.segments):
            if start <= frame:
                return parameters
        raise IndexError(f"a history begins at frame 0, got {frame}")

    def spans(self, frame: int, *names: str) -> list[tuple[int, P_co]]:
        """Return the parameters in force during the steps 1..frame, each with the number of its steps.

        Args:
            frame: The last step.
            names: Names of the relevant parameters; consecutive spans in which they are equal are merged. So sums over
                spans stay the same bit for bit when only other parameters change, such as those of the tracker.
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
        frame_rate_hz: Frame rate, Hz.
        frame_count: Number of frames; None if endless.
        start: The target at frame 0.
        noisy: Whether the frames depend on the seed; if not, all runs of a batch see the same frames.
    """

    size: tuple[int, int]
    frame_rate_hz: float
    frame_count: int | None
    start: Target
    noisy: bool

    def frame(self, index: int, history: History[P_contra]) -> Frame:
        """Return a frame; equal arguments give equal frames, bit for bit."""


Kind: TypeAlias = Literal["video", "gif", "images", "tracks", "beliefs"]


@dataclass(frozen=True, slots=True)
class FrameIndex:
    """The result of one pass over a sequence; opening the sequence with it skips the pass.

    Attributes:
        kind: Kind of the sequence.
        sha256: Hash of the file's content, or of the digests of a folder's pictures in order.
        width: Width of every upright picture, px.
        height: Height of every upright picture, px.
        frame_rate_hz: Frame rate, Hz; the mean if it varies.
        times_s: Time of each frame, from 0, s.
        checksums: CRC-32 of each frame's RGB bytes.
        stamps: Time stamp of each frame in ticks of the container, rising; empty if they cannot be used to seek.
        keyframes: Numbers of the frames at which decoding can begin.
        orientation: Rotation that turns stored pictures upright; see `pftrack.sources.video`.
        warnings: Sentences for people about irregularities.
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
        """Number of frames."""
        return len(self.checksums)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of every picture, px."""
        return self.width, self.height

    @property
    def duration_s(self) -> float:
        """Duration, s; the last frame is assumed to last as long as the mean one."""
        return self.times_s[-1] + 1 / self.frame_rate_hz

    def to_json(self) -> str:
        """Write the index as one line of JSON."""
        return _ADAPTER.dump_json(self).decode()

    @classmethod
    def from_json(cls, text: str) -> "FrameIndex":
        """Read the result of `to_json`.

        Raises:
            ValueError: The text is something else.
        """
        index = _ADAPTER.validate_json(text)
        if len(index.times_s) != index.frame_count or len(index.stamps) not in {0, index.frame_count}:
            raise ValueError(f"expected a time and a stamp for each of {index.frame_count} frames, got others")
        return index


_ADAPTER = TypeAdapter(FrameIndex)


class FrameSequence(ABC):
    """Random access to pictures of one size.

    Attributes:
        name: Name of the file or folder, without its path.
        index: Result of the survey.
    """

    name: str
    index: FrameIndex

    @property
    def frame_count(self) -> int:
        """Number of frames that decode."""
        return self.index.frame_count

    @property
    def frame_rate_hz(self) -> float:
        """Frame rate, Hz; the mean if it varies."""
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
        """Time of each frame, (frame_count,), from 0, s."""
        return np.array(self.index.times_s)

    @property
    def square(self) -> bool:
        """Whether pixels are square or were made square; an earlier version kept oblong ones."""
        return True

    def picture(self, index: int) -> NDArray[np.uint8]:
        """Return a frame, (height, width, 3) RGB, read-only.

        Args:
            index: Number of the frame, from 0.

        Raises:
            IndexError: The number is out of range.
            RefusedError: The file has changed since its survey.
        """
        if not 0 <= index < self.frame_count:
            raise IndexError(f"frame must be between 0 and {self.frame_count - 1}, got {index}")
        return self._picture(index)

    @abstractmethod
    def _picture(self, index: int) -> NDArray[np.uint8]:
        """Return a frame whose number is in range."""

    def close(self) -> None:
        """Release files and cached pictures."""
        return


class Truth(Protocol):
    """The truth of a recording: numbers by frame, and the target that they describe."""

    @property
    def rows(self) -> Mapping[int, tuple[float, ...]]:
        """The numbers of each frame that has any, as in the file."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Parts that the reader skipped, in one sentence each."""

    def at(self, frame: int) -> Target | None:
        """Return the target of a frame, or None without a truth."""
