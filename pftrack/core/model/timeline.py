"""Timelines: which parameters, tracker and random numbers are in force in which frame of a run.

A timeline is a value: a change makes another timeline, or is refused whole, and what two branches share is shared.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field

from pftrack.core.model.parameters import NOT_BOOLEAN, ParameterError, Parameters, declarations, flat, revise
from pftrack.core.model.source import History
from pftrack.core.numerics.random import LARGEST_SEED

__all__ = ["LONGEST_RUN", "NO_PARAMETERS", "Change", "Timeline", "check_tracker", "parameter_values"]

LONGEST_RUN = 1_000_000

NO_PARAMETERS = frozenset({"tracker", "seed"})
"""What a change may name beside parameters."""


@dataclass(frozen=True, slots=True)
class Change:
    """Values that take effect in computing a frame.

    Attributes:
        frame: The first frame computed with them.
        values: By parameter name; `tracker` names the tracker, and `seed` is that of the tracker's random numbers from
            this frame on. The scene keeps the seed of the run: what the tracker looks at is the same.
    """

    frame: Annotated[int, Field(ge=0, le=10 * LONGEST_RUN), NOT_BOOLEAN]
    values: Mapping[Annotated[str, Field(max_length=64)], Any]


@dataclass(frozen=True, slots=True)
class Segment:
    """What is in force from a frame on; the seed is None for that of the run."""

    start: int
    parameters: Any
    tracker: str
    seed: int | None = None


@dataclass(frozen=True, slots=True)
class Timeline:
    """The changes of a run, and what they amount to.

    Attributes:
        changes: By ascending frame; those of frame 0 are the run's initial values.
        segments: What is in force, by ascending frame; the first begins at frame 0.
        trackers: Names of the trackers that there are.
        history: The parameters alone, as a source looks at them.
    """

    changes: tuple[Change, ...]
    segments: tuple[Segment, ...]
    trackers: tuple[str, ...]
    history: History[Any]

    @classmethod
    def begin(
        cls, parameters: Parameters, tracker: str, trackers: Collection[str], changes: Iterable[Change] = ()
    ) -> "Timeline":
        """Return the timeline that begins with these parameters and this tracker and then has these changes.

        Raises:
            ParameterError: A name or a value is refused.
        """
        check_tracker(trackers, tracker)
        timeline = _timeline((), (Segment(0, parameters, tracker),), tuple(trackers))
        for change in sorted(changes, key=lambda change: change.frame):
            timeline = _append(timeline, change)
        return timeline

    def parameters_at(self, frame: int) -> Any:  # noqa: ANN401 - the experiment's own model
        """Return the parameters in force in a frame."""
        return self._segment(frame).parameters

    def tracker_at(self, frame: int) -> str:
        """Return the name of the tracker that computes a frame."""
        return self._segment(frame).tracker

    def seed_at(self, frame: int) -> int | None:
        """Return the seed of the tracker's random numbers in a frame; None for that of the run."""
        return self._segment(frame).seed

    def insert(self, change: Change) -> "Timeline":
        """Return the timeline with a further change at its place; what is to change later stays.

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
        """Return each tracker, by name, and the parameters with it that are in force in any frame up to one."""
        return tuple((one.tracker, one.parameters) for one in self.segments if one.start <= frame)

    def changes_until(self, frame: int) -> tuple[Change, ...]:
        """Return the changes up to a frame: those that a branch leaving there has as well."""
        return tuple(change for change in self.changes if change.frame <= frame)

    def _segment(self, frame: int) -> Segment:
        for segment in reversed(self.segments):
            if segment.start <= frame:
                return segment
        raise IndexError(f"a run begins at frame 0, got {frame}")


def check_tracker(trackers: Collection[str], name: object) -> str:
    """Return the name of a tracker.

    Raises:
        ParameterError: There is none of that name.
    """
    if not isinstance(name, str) or name not in trackers:
        raise ParameterError("tracker", name, f"one of {', '.join(trackers)}")
    return name


def parameter_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return those values of a change that are of parameters."""
    return {name: value for name, value in values.items() if name not in NO_PARAMETERS}


def _check_seed(frame: int, seed: object) -> int:
    if frame == 0:
        raise ParameterError("seed", seed, "that of the run in frame 0, and can change in a later frame only")
    if not isinstance(seed, int) or isinstance(seed, bool) or not 0 <= seed <= LARGEST_SEED:
        raise ParameterError("seed", seed, f"a whole number between 0 and {LARGEST_SEED}")
    return seed


def _timeline(changes: tuple[Change, ...], segments: tuple[Segment, ...], trackers: tuple[str, ...]) -> Timeline:
    history = History(tuple((segment.start, segment.parameters) for segment in segments))
    return Timeline(changes, segments, trackers, history)


def _append(timeline: Timeline, change: Change) -> Timeline:
    """Return the timeline with a change at its end."""
    if change.frame < 0:
        raise ParameterError("frame", change.frame, "a whole number, not negative")
    newest = timeline.segments[-1]
    given = dict(change.values)
    tracker = check_tracker(timeline.trackers, given.pop("tracker", newest.tracker))
    seed = _check_seed(change.frame, given.pop("seed")) if "seed" in given else newest.seed
    revised = revise(newest.parameters, given)
    if change.frame > 0:
        _check_live(newest.parameters, given)
    values = {name: value for name, value in flat(revised).items() if name in given}
    if "tracker" in change.values:
        values["tracker"] = tracker
    if seed is not None and "seed" in change.values:
        values["seed"] = seed
    segments, changes = timeline.segments, timeline.changes
    if newest.start == change.frame:
        segments = segments[:-1]
    if changes and changes[-1].frame == change.frame:
        values = {**changes[-1].values, **values}
        changes = changes[:-1]
    added = Segment(change.frame, revised, tracker, seed)
    return _timeline((*changes, Change(change.frame, values)), (*segments, added), timeline.trackers)


def _check_live(parameters: Parameters, values: Mapping[str, object]) -> None:
    for declaration in declarations(type(parameters)):
        if declaration.name in values and not declaration.live:
            raise ParameterError(declaration.name, values[declaration.name], "set before the run starts")


def check_timeline(timeline: Iterable[Change], frames: int) -> None:
    """Refuse a change that no frame of the run would ever see.

    Raises:
        ParameterError: A change lies beyond the last frame.
    """
    last = max((change.frame for change in timeline), default=0)
    if last >= frames:
        raise ParameterError("timeline", last, f"changes within the run, frames 0 to {frames - 1}")
