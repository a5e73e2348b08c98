"""Recipes: everything that determines a run, as one frozen value with one JSON form, and the timeline of changes.

A saved run, a request for a session, a stored session, a worker's configuration, a run of a sweep and a share link all
hold a recipe. People can also write one as a file:

    {"experiment": "ball", "seed": 3, "timeline": [{"frame": 0, "values": {"sample_count": 400}}]}

Everything except the experiment is optional. For a recording, `footage` identifies the file and holds the mark; the
code that makes the run finds the file.
"""

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, field_validator

from pftrack.core.model.parameters import (
    LONGEST_FILE,
    NOT_BOOLEAN,
    Parameters,
    Value,
    declarations,
    flat,
    revise,
)
from pftrack.core.model.source import History
from pftrack.core.numerics.random import LARGEST_SEED
from pftrack.core.refusal import ParameterError, first_problem

if TYPE_CHECKING:
    from pftrack.core.model.marks import Mark
    from pftrack.core.model.source import FrameSequence, Truth

# A timeline holds the parameters, tracker and random seed in force in each frame. It is immutable: a change gives a new
# timeline or is refused as a whole, and branches share their common part.

LONGEST_RUN = 1_000_000

NO_PARAMETERS = frozenset({"tracker", "seed", "move"})
"""Names in a change that are not parameters."""

MOST_MOVES = 100
"""Most moves before one frame."""


class Move(BaseModel):
    """A move of a particle or of the estimate by hand, in the belief from which the next step starts.

    Attributes:
        particle: Number of the particle; None shifts all of them until the estimate is at the place.
        place: New place in coordinates and units of the estimate: px of the picture, or values of a signal.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    particle: Annotated[int, Field(ge=0), NOT_BOOLEAN] | None = None
    place: tuple[Annotated[float, Field(allow_inf_nan=False), NOT_BOOLEAN], ...]

    @property
    def words(self) -> str:
        """Description of the move, such as "Particle 7 moved to (312, 140)"."""
        what = "Estimate" if self.particle is None else f"Particle {self.particle}"
        place = ", ".join(f"{value:.4g}" for value in self.place)
        return f"{what} moved to {place if len(self.place) == 1 else f'({place})'}"


_MOVES: TypeAdapter[tuple[Move, ...]] = TypeAdapter(tuple[Move, ...])


@dataclass(frozen=True, slots=True)
class Change:
    """Values that take effect in a frame.

    Attributes:
        frame: The first frame computed with them.
        values: Values by parameter name. `tracker` names the tracker, and `seed` is the tracker's random seed from this
            frame on; the scene keeps the seed of the run, so the tracker sees the same frames. `move` is a `Move`, or
            several, made once before this frame is computed.
    """

    frame: Annotated[int, Field(ge=0, le=10 * LONGEST_RUN), NOT_BOOLEAN]
    values: Mapping[Annotated[str, Field(max_length=64)], Any]


@dataclass(frozen=True, slots=True)
class Segment:
    """Values in force from a frame on; seed None means that of the run, and moves are made before the first frame."""

    start: int
    parameters: Any
    tracker: str
    seed: int | None = None
    moves: tuple[Move, ...] = ()


@dataclass(frozen=True, slots=True)
class Timeline:
    """The changes of a run, and the values in force.

    Attributes:
        changes: Changes in ascending order of frames; those of frame 0 are the initial values.
        segments: Values in force in ascending order of frames; the first segment begins at frame 0.
        trackers: Names of the available trackers.
        history: The parameters alone, for a source.
    """

    changes: tuple[Change, ...]
    segments: tuple[Segment, ...]
    trackers: tuple[str, ...]
    history: History[Any]

    @classmethod
    def begin(
        cls, parameters: Parameters, tracker: str, trackers: Collection[str], changes: Iterable[Change] = ()
    ) -> "Timeline":
        """Return the timeline with these initial parameters, this tracker and these changes.

        Raises:
            ParameterError: A name or value is refused.
        """
        check_tracker(trackers, tracker)
        timeline = _timeline((), (Segment(0, parameters, tracker),), tuple(trackers))
        for change in sorted(changes, key=lambda change: change.frame):
            timeline = _append(timeline, change)
        return timeline

    def parameters_at(self, frame: int) -> Any:  # noqa: ANN401 - the experiment's own model
        """Return the parameters in force in a frame."""
        return self.segment_at(frame).parameters

    def tracker_at(self, frame: int) -> str:
        """Return the name of the tracker that computes a frame."""
        return self.segment_at(frame).tracker

    def seed_at(self, frame: int) -> int | None:
        """Return the random seed of the tracker in a frame; None means that of the run."""
        return self.segment_at(frame).seed

    def moves_at(self, frame: int) -> tuple[Move, ...]:
        """Return the moves in the belief of the frame before."""
        segment = self.segment_at(frame)
        return segment.moves if segment.start == frame else ()

    def insert(self, change: Change) -> "Timeline":
        """Return the timeline with one more change at its frame; later changes stay.

        Raises:
            ParameterError: A name or a value is refused.
        """
        kept = [segment for segment in self.segments if segment.start <= change.frame]
        before = _timeline(self.changes_until(change.frame), tuple(kept), self.trackers)
        timeline = _append(before, change)
        for later in self.changes:
            if later.frame > change.frame:
                timeline = _append(timeline, later)
        return timeline

    def in_force_until(self, frame: int) -> tuple[tuple[str, Any], ...]:
        """Return name of tracker and parameters of each segment up to a frame."""
        return tuple((one.tracker, one.parameters) for one in self.segments if one.start <= frame)

    def changes_until(self, frame: int) -> tuple[Change, ...]:
        """Return the changes up to a frame, which a branch from there shares."""
        return tuple(change for change in self.changes if change.frame <= frame)

    def segment_at(self, frame: int) -> Segment:
        """Return the values in force in a frame.

        Raises:
            IndexError: The frame is negative.
        """
        for segment in reversed(self.segments):
            if segment.start <= frame:
                return segment
        raise IndexError(f"a run begins at frame 0, got {frame}")


def check_tracker(trackers: Collection[str], name: object) -> str:
    """Return the name of a tracker.

    Raises:
        ParameterError: The name is unknown.
    """
    if not isinstance(name, str) or name not in trackers:
        raise ParameterError("tracker", name, f"one of {', '.join(trackers)}")
    return name


def parameter_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a change that belong to parameters."""
    return {name: value for name, value in values.items() if name not in NO_PARAMETERS}


def _check_seed(frame: int, seed: object) -> int:
    if frame == 0:
        raise ParameterError("seed", seed, "that of the run in frame 0, and can change in a later frame only")
    if not isinstance(seed, int) or isinstance(seed, bool) or not 0 <= seed <= LARGEST_SEED:
        raise ParameterError("seed", seed, f"a whole number between 0 and {LARGEST_SEED}")
    return seed


def _read_moves(frame: int, given: object) -> tuple[Move, ...]:
    if frame == 0:
        raise ParameterError("move", given, "made before frame 1 or later; frame 0 is the first belief")
    try:
        return _MOVES.validate_python([given] if isinstance(given, Mapping | Move) else given)
    except ValidationError:
        bound = "a place of finite numbers, with the number of a particle unless the estimate is moved"
        raise ParameterError("move", given, bound) from None


def _timeline(changes: tuple[Change, ...], segments: tuple[Segment, ...], trackers: tuple[str, ...]) -> Timeline:
    history = History(tuple((segment.start, segment.parameters) for segment in segments))
    return Timeline(changes, segments, trackers, history)


def _append(timeline: Timeline, change: Change) -> Timeline:
    """Return the timeline with a change at the end."""
    if change.frame < 0:
        raise ParameterError("frame", change.frame, "a whole number, not negative")
    newest = timeline.segments[-1]
    given = dict(change.values)
    tracker = check_tracker(timeline.trackers, given.pop("tracker", newest.tracker))
    seed = _check_seed(change.frame, given.pop("seed")) if "seed" in given else newest.seed
    moves = newest.moves if newest.start == change.frame else ()
    if "move" in given:
        moves += _read_moves(change.frame, given.pop("move"))
        if len(moves) > MOST_MOVES:
            raise ParameterError("move", len(moves), f"at most {MOST_MOVES} before one frame")
    revised = revise(newest.parameters, given)
    if change.frame > 0:
        _check_live(newest.parameters, given)
    values: dict[str, Any] = {name: value for name, value in flat(revised).items() if name in given}
    if "tracker" in change.values:
        values["tracker"] = tracker
    if seed is not None and "seed" in change.values:
        values["seed"] = seed
    if moves:
        values["move"] = [move.model_dump(mode="json") for move in moves]
    segments, changes = timeline.segments, timeline.changes
    if newest.start == change.frame:
        segments = segments[:-1]
    if changes and changes[-1].frame == change.frame:
        values = {**changes[-1].values, **values}
        changes = changes[:-1]
    added = Segment(change.frame, revised, tracker, seed, moves)
    return _timeline((*changes, Change(change.frame, values)), (*segments, added), timeline.trackers)


def _check_live(parameters: Parameters, values: Mapping[str, object]) -> None:
    for declaration in declarations(type(parameters)):
        if declaration.name in values and not declaration.live:
            raise ParameterError(declaration.name, values[declaration.name], "set before the run starts")


def check_timeline(timeline: Iterable[Change], frames: int) -> None:
    """Refuse a change after the last frame.

    Raises:
        ParameterError: A change lies beyond the last frame.
    """
    last = max((change.frame for change in timeline), default=0)
    if last >= frames:
        raise ParameterError("timeline", last, f"changes within the run, frames 0 to {frames - 1}")


FILTER_HASH = re.compile(r"sha256:[0-9a-f]{64}")
"""Form of a hash that stands for the known text of a filter."""


def _check_filter(text: str) -> str:
    if text.startswith("sha256:") and not FILTER_HASH.fullmatch(text):
        raise ValueError("a filter is the text of its file, or sha256: and 64 hexadecimal digits in lower case")
    return text


FilterName = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]{0,39}$")]
FilterText = Annotated[str, Field(max_length=LONGEST_FILE), AfterValidator(_check_filter)]
Seed = Annotated[int, Field(ge=0, le=LARGEST_SEED), NOT_BOOLEAN]


class Footage(BaseModel):
    """A recording with its target.

    Attributes:
        sha256: Hash of the file's content in hexadecimal digits; None accepts any content.
        name: Name of the file for people.
        path: Path of the file relative to the file of the recipe; None to find it by its content.
        start: Number of the first picture to use, or from which to search for the target.
        mark: The target in that picture; None to search for it.
        truth: Known truth by number of the picture, in the experiment's own form.
        labelled: Whether the recording has a truth of its own.
        square: Whether oblong pixels were made square, so that mark and truth refer to square ones; None for the
            present default.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")] | None = None
    name: Annotated[str, Field(max_length=200)] = ""
    path: Annotated[str, Field(max_length=4096)] | None = None
    start: Annotated[int, Field(ge=0, le=10 * LONGEST_RUN), NOT_BOOLEAN] = 0
    mark: dict[Annotated[str, Field(max_length=64)], Any] | None = None
    truth: dict[int, tuple[Annotated[float, Field(allow_inf_nan=False), NOT_BOOLEAN], ...]] | None = None
    labelled: bool = False
    square: bool | None = None

    @property
    def is_labelled(self) -> bool:
        """Whether a truth is known."""
        return self.labelled or bool(self.truth)

    @property
    def title(self) -> str:
        """Name of the file without its suffix."""
        return PurePath(self.name).stem

    @classmethod
    def of(cls, sequence: "FrameSequence", mark: "Mark | None", start: int, truth: "Truth | None" = None) -> Self:
        """Return the footage of a sequence from the picture `start` on, with its mark, if any."""
        rows = dict(truth.rows) if truth else None
        return cls(
            sha256=sequence.sha256,
            name=sequence.name,
            start=start,
            mark=mark.model_dump(mode="json") if mark else None,
            truth=rows,
            square=sequence.square,
        )


class Recipe(BaseModel):
    """Everything that determines a run, bit for bit.

    Attributes:
        experiment: Name of the experiment.
        tracker: Name of the tracker at frame 0; None for the experiment's default.
        seed: Random seed.
        frames: Length of the run; None for that of the recording or the experiment.
        timeline: Changes in ascending order of frames; those of frame 0 are the initial values.
        footage: The recording; None for the experiment's simulated scene.
        filters: Texts of filter files, or their hashes (`FILTER_HASH`), by the name of their tracker: all versions that
            the run may use, in order.
        defaults: Values of parameters that the timeline does not set, so that versions with other defaults give the
            same numbers. Parameters that a version no longer has are ignored.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    experiment: Annotated[str, Field(max_length=64)]
    tracker: Annotated[str, Field(max_length=64)] | None = None
    seed: Annotated[int, Field(ge=0), NOT_BOOLEAN] = 0
    frames: Annotated[int, Field(ge=1, le=LONGEST_RUN), NOT_BOOLEAN] | None = None
    timeline: Annotated[tuple[Change, ...], Field(max_length=10_000)] = ()
    footage: Footage | None = None
    filters: Annotated[
        dict[FilterName, Annotated[tuple[FilterText, ...], Field(min_length=1, max_length=1000)]], Field(max_length=16)
    ] = {}
    defaults: dict[Annotated[str, Field(max_length=64)], Value] = {}

    @field_validator("seed")
    @classmethod
    def _check_seed(cls, seed: int) -> int:
        if seed > LARGEST_SEED:
            raise ParameterError("seed", seed, f"a whole number between 0 and {LARGEST_SEED}")
        return seed

    @classmethod
    def read(cls, raw: object) -> Self:
        """Read a recipe from JSON values.

        Raises:
            ParameterError: The values are not a recipe; it names the field.
        """
        try:
            return cls.model_validate(raw)
        except ValidationError as error:
            first = first_problem(error.errors())
            place = ".".join(str(part) for part in first["loc"]) or "recipe"
            if first["type"] == "extra_forbidden":
                raise ParameterError(place, first["input"], "left out: a recipe has no such field") from None
            message = first["msg"].removeprefix("Value error, ")
            message = message[:1].lower() + message[1:]
            raise ParameterError(place, first["input"], f"as a recipe has it ({message})") from None

    def changes(self, known: Mapping[str, Value]) -> tuple[Change, ...]:
        """Return the timeline, with the recipe's defaults at frame 0 where they differ from present ones.

        Args:
            known: Present defaults by name.
        """
        first = self.timeline[0] if self.timeline and self.timeline[0].frame == 0 else Change(0, {})
        moved = {name: value for name, value in self.defaults.items() if name in known and known[name] != value}
        if not moved:
            return self.timeline
        later = self.timeline[1:] if first in self.timeline else self.timeline
        return (Change(0, {**moved, **first.values}), *later)

    def with_footage(self, **changes: Any) -> Self:  # noqa: ANN401 - fields of the footage
        """Return the recipe with changed fields of its footage; without footage, the same recipe."""
        if self.footage is None:
            return self
        return self.model_copy(update={"footage": self.footage.model_copy(update=changes)})

    def as_dict(self) -> dict[str, Any]:
        """Return the JSON form without default values."""
        return self.model_dump(mode="json", exclude_defaults=True)
