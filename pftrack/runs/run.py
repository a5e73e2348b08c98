"""Runs: one source folded through one tracker.

A run is a seed and a timeline of parameter changes; everything else follows from them. The fold

    state_t = step(state_{t-1}, frame_t, parameters_t, random numbers of (seed, t))

is pure, so it can be entered anywhere: the run keeps whole states at keyframes, and `seek` restores the nearest one
and repeats the few steps from there, to the same numbers. A change of a parameter takes effect in the next frame; the
past is the past, and a change to it makes a `branch`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np

from pftrack.experiment import Experiment, Setup, Step
from pftrack.frame import Frame
from pftrack.parameters import ParameterError, Parameters, Value, declarations, flat, revise
from pftrack.random import MAXIMUM_SEED, Purpose, Stream
from pftrack.runs.diagnostics import Diagnostics, diagnose
from pftrack.runs.keyframes import Keyframes
from pftrack.runs.scoring import allowed_loss, estimates_hash, judge
from pftrack.sources.source import History
from pftrack.trackers import TrackState

__all__ = ["Change", "EndOfRun", "PastError", "Run", "Timeline"]

LONGEST_RUN = 1_000_000


class EndOfRun(Exception):  # noqa: N818 - an end is not an error
    """There is no further frame."""


class PastError(ValueError):
    """A change to what has already happened; it would have to be a branch."""


@dataclass(frozen=True, slots=True)
class Change:
    """Values that take effect in computing a frame.

    Attributes:
        frame: The first frame computed with them.
        values: By parameter name; `tracker` names the tracker.
    """

    frame: int
    values: Mapping[str, Value]


Timeline = tuple[Change, ...]


@dataclass(frozen=True, slots=True)
class Segment:
    """Parameters and tracker in force from a frame on."""

    start: int
    parameters: Any
    tracker: str


class Run:
    """A source folded through a tracker, one frame at a time, with its past at hand."""

    def __init__(
        self,
        experiment: Experiment,
        setup: Setup,
        *,
        tracker: str | None = None,
        seed: int = 0,
        frames: int | None = None,
        timeline: Timeline = (),
    ) -> None:
        """Set a run up and compute its frame 0.

        Args:
            experiment: The wiring.
            setup: The source, as `experiment.simulate()` or `experiment.on_video(...)` gives it.
            tracker: Name of the tracker at frame 0.
            seed: Of all randomness, 0..2**63-1.
            frames: Length; the recording's, or the experiment's own for a simulated scene, if not given.
            timeline: Changes by ascending frame; those of frame 0 are the run's initial values.

        Raises:
            ParameterError: A value is unknown or out of bounds, the length or seed included.
        """
        self.experiment = experiment
        self.setup = setup
        self.seed = _checked_seed(seed)
        self.tracker = _checked_tracker(experiment, tracker or experiment.default_tracker)
        self._segments = [Segment(0, setup.parameters, self.tracker)]
        self._timeline: list[Change] = []
        for change in sorted(timeline, key=lambda change: change.frame):
            self._append(change)
        self.source = setup.open_source(self.seed, self.parameters_at(0))
        self.frames = _checked_length(frames, self.source.frame_count, experiment.frames)
        self.diagnostics: list[Diagnostics] = []
        self._keyframes = Keyframes()
        self.current = self._compute(0, None)

    @property
    def timeline(self) -> Timeline:
        """All changes, by ascending frame."""
        return tuple(self._timeline)

    @property
    def position(self) -> int:
        """Frame of the current step."""
        return self.current.diagnostics.frame

    @property
    def head(self) -> int:
        """The furthest frame computed so far."""
        return len(self.diagnostics) - 1

    def parameters_at(self, frame: int) -> Any:  # noqa: ANN401 - the experiment's own model
        """Return the parameters in force in a frame."""
        return self._segment(frame).parameters

    def tracker_at(self, frame: int) -> str:
        """Return the name of the tracker that computes a frame."""
        return self._segment(frame).tracker

    def advance(self) -> Step:
        """Compute the next frame and return it.

        Raises:
            EndOfRun: The current frame is the last.
        """
        if self.position + 1 >= self.frames:
            raise EndOfRun(f"the run ends at frame {self.frames - 1}")
        self.current = self._compute(self.position + 1, self.current.state)
        return self.current

    def __iter__(self) -> Iterator[Step]:
        """Yield the current step and all further ones."""
        yield self.current
        while self.position + 1 < self.frames:
            yield self.advance()

    def finish(self) -> Step:
        """Compute all frames and return the last step."""
        return self.seek(self.frames - 1)

    def seek(self, frame: int) -> Step:
        """Go to a frame, in the past or in the future; the numbers are the same whichever way one comes.

        Raises:
            ParameterError: The run has no such frame.
        """
        if not 0 <= frame < self.frames:
            raise ParameterError("frame", frame, f"a whole number between 0 and {self.frames - 1}")
        if frame < self.position or self._keyframes.latest(frame)[0] > self.position:
            index, state = self._keyframes.latest(frame)
            self.current = self._seen(index, state)
        while self.position < frame:
            self.advance()
        return self.current

    def change(self, values: Mapping[str, object]) -> Change:
        """Change parameters from the next frame on.

        Args:
            values: By name; `tracker` names a tracker, which takes over from the present state.

        Returns:
            The change as it stands on the timeline.

        Raises:
            PastError: The current frame is in the past, or a value is none that can change in mid-run.
            ParameterError: A value is unknown or out of bounds; nothing has changed.
            EndOfRun: There is no next frame.
        """
        if self.position < self.head:
            raise PastError(f"frame {self.position + 1} has been computed already; branch there to change it")
        if self.position + 1 >= self.frames:
            raise EndOfRun(f"the run ends at frame {self.frames - 1}; go back to change what leads there, or restart")
        return self._insert(Change(self.position + 1, dict(values)))  # type: ignore[arg-type] # checked within

    def branch(self, frame: int, values: Mapping[str, object] | None = None) -> "Run":
        """Return a new run that shares this one's past up to a frame and stands there.

        Args:
            frame: The last frame shared, 0..head.
            values: Changes from the frame after on.

        Raises:
            ParameterError: The frame has not been computed, or a value is unknown or out of bounds.
        """
        if not 0 <= frame <= self.head:
            raise ParameterError("frame", frame, f"a whole number between 0 and {self.head}")
        shared = tuple(change for change in self._timeline if change.frame <= frame)
        changes = (Change(frame + 1, dict(values)),) if values else ()  # type: ignore[arg-type] # checked within
        twin = Run(
            self.experiment,
            self.setup,
            tracker=self.tracker,
            seed=self.seed,
            frames=self.frames,
            timeline=shared + changes,
        )
        twin.diagnostics = self.diagnostics[: frame + 1]
        twin._keyframes = self._keyframes.until(frame)
        twin.seek(frame)
        return twin

    @property
    def estimates_sha256(self) -> str:
        """Hash of all estimates up to the head: equal if and only if they are to the bit."""
        return estimates_hash(np.array([row.estimate for row in self.diagnostics]))

    def summary(self) -> dict[str, Any]:
        """Return what came of the run so far, as JSON values.

        Success and the hit rate count the frames whose truth is known; both are None where there are none.
        """
        parameters = self.parameters_at(self.head)
        errors = np.array([np.nan if row.error is None else row.error for row in self.diagnostics])
        lost = np.array([bool(row.lost) for row in self.diagnostics]) if self.experiment.lost else None
        verdict = judge(errors, lost, allowed_loss(parameters))
        return {
            "experiment": self.experiment.id,
            "tracker": self.tracker,
            "seed": self.seed,
            "frames": len(self.diagnostics),
            "parameters": flat(self.parameters_at(0)),
            "changes": [{"frame": change.frame, "values": dict(change.values)} for change in self._timeline],
            "success": verdict.success,
            "mean_error": verdict.mean_error,
            "mean_error_px": verdict.mean_error if self.experiment.unit == "px" else None,
            "lost_frames": verdict.lost_frames,
            "first_lost_frame": verdict.first_lost_frame,
            "labelled_frames": verdict.labelled_frames,
            "hit_rate": None if verdict.lost_frames is None else 1.0 - verdict.lost_frames / verdict.labelled_frames,
            "step_ms_median": median(row.step_ms for row in self.diagnostics[1:]) if self.head else None,
            "estimates_sha256": self.estimates_sha256,
        }

    def _segment(self, frame: int) -> Segment:
        for segment in reversed(self._segments):
            if segment.start <= frame:
                return segment
        raise IndexError(f"a run begins at frame 0, got {frame}")

    def _insert(self, change: Change) -> Change:
        """Write a change at its place on the timeline, or refuse it whole; what is to change later stays."""
        before = self._timeline, self._segments
        later = [other for other in self._timeline if other.frame > change.frame]
        self._timeline = [other for other in self._timeline if other.frame <= change.frame]
        self._segments = [segment for segment in self._segments if segment.start <= change.frame]
        try:
            written = self._append(change)
            for other in later:
                self._append(other)
        except ParameterError:
            self._timeline, self._segments = before
            raise
        return written

    def _append(self, change: Change) -> Change:
        """Write a change at the end of the timeline, or refuse it whole."""
        if change.frame < 0:
            raise ParameterError("frame", change.frame, "a whole number, not negative")
        parameters, tracker = self._segments[-1].parameters, self._segments[-1].tracker
        values = dict(change.values)
        if "tracker" in values:
            tracker = _checked_tracker(self.experiment, values.pop("tracker"))
        revised = revise(parameters, values)
        if change.frame > 0:
            _check_live(parameters, values)
        values = {name: value for name, value in flat(revised).items() if name in values}
        if "tracker" in change.values:
            values["tracker"] = tracker
        if self._segments[-1].start == change.frame:
            self._segments.pop()
        self._segments.append(Segment(change.frame, revised, tracker))
        if self._timeline and self._timeline[-1].frame == change.frame:
            values = {**self._timeline.pop().values, **values}
        self._timeline.append(Change(change.frame, values))
        if change.frame == 0:
            self.tracker = tracker
        return Change(change.frame, values)

    def _frame(self, index: int) -> Frame:
        return self.source.frame(
            index, History(tuple((segment.start, segment.parameters) for segment in self._segments))
        )

    def _compute(self, index: int, previous: TrackState | None) -> Step:
        segment = self._segment(index)
        parameters, name = segment.parameters, segment.tracker
        tracker = self.experiment.trackers[name]
        frame = self._frame(index)
        begun = perf_counter()
        if previous is None:
            rng = Stream(self.seed, index, Purpose.START)
            state = tracker.start(self.source.start, frame, parameters, rng)
        else:
            rng = Stream(self.seed, index, Purpose.TRACK)
            state = tracker.step(previous, frame, parameters, rng)
        step_ms = 1e3 * (perf_counter() - begun)
        if index < len(self.diagnostics):
            return self._seen(index, state, frame)
        series = self.experiment.series(frame, state) if self.experiment.series else {}
        verdict = self._judge(frame, state, parameters)
        self.diagnostics.append(diagnose(frame, state, verdict, step_ms, scale=self.experiment.scale, series=series))
        self._keyframes.offer(index, state)
        return Step(frame, state, self.diagnostics[index], parameters, name)

    def _judge(self, frame: Frame, state: TrackState, parameters: Parameters) -> tuple[float | None, bool | None]:
        """Return error and verdict of a frame, None where the truth is unknown or there is no notion of lost."""
        if frame.target is None:
            return None, None
        error = float(self.experiment.error(state.estimate, frame.target.position))
        judged = self.experiment.lost
        return error, bool(judged(error, frame.target.size, parameters)) if judged else None

    def _seen(self, index: int, state: TrackState, frame: Frame | None = None) -> Step:
        segment = self._segment(index)
        row = self.diagnostics[index]
        return Step(frame or self._frame(index), state, row, segment.parameters, segment.tracker)


def _check_live(parameters: Parameters, values: Mapping[str, object]) -> None:
    for declaration in declarations(type(parameters)):
        if declaration.name in values and not declaration.live:
            raise ParameterError(declaration.name, values[declaration.name], "set before the run starts")


def _checked_tracker(experiment: Experiment, name: object) -> str:
    if not isinstance(name, str) or name not in experiment.trackers:
        raise ParameterError("tracker", name, f"one of {', '.join(experiment.trackers)}")
    return name


def _checked_seed(seed: int) -> int:
    if not 0 <= seed <= MAXIMUM_SEED:
        raise ParameterError("seed", seed, f"a whole number between 0 and {MAXIMUM_SEED}")
    return seed


def _checked_length(wanted: int | None, available: int | None, usual: int) -> int:
    longest = available or LONGEST_RUN
    frames = wanted if wanted is not None else available or usual
    if not 1 <= frames <= longest:
        raise ParameterError("frames", frames, f"a whole number between 1 and {longest}")
    return frames
