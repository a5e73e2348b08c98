"""The recursion: how each state of a run comes out of the one before, and which states are kept for seeking.

    state_t = step(state_{t-1}, frame_t, parameters_t, random numbers of (seed, t))

It is pure. What it needs of the run's past is its timeline, which tells the parameters, the tracker and the seed in
force in each frame; so code that holds a state and a timeline can enter it at any frame. Keyframes are whole states
kept now and then, so that seeking repeats few steps.
"""

from dataclasses import dataclass, field
from typing import Any

from pftrack.core.model.diagnostics import Diagnostics, Step, diagnose
from pftrack.core.model.recipe import Timeline
from pftrack.core.model.series import Series
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, Source
from pftrack.core.model.tracker import Tracker, TrackState
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.experiment import Experiment
from pftrack.runs.loss import judge_state
from pftrack.runs.scoring import measurements


@dataclass(frozen=True, slots=True)
class Recursion:
    """A source folded through trackers.

    Attributes:
        experiment: The wiring.
        setup: As `experiment.simulate()` or `experiment.on_video(...)` gives it.
        source: Opened for this seed.
        seed: Of all randomness where the timeline sets no other.
    """

    experiment: Experiment
    setup: Setup
    source: Source[Any]
    seed: int
    _declared: dict[str, Series] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Find the series that may be measured."""
        object.__setattr__(self, "_declared", {series.name: series for series in self.experiment.all_series()})

    def seed_at(self, index: int, timeline: Timeline) -> int:
        """Return the seed of the tracker's random numbers in a frame: the run's, unless a change has set another."""
        changed = timeline.seed_at(index)
        return self.seed if changed is None else changed

    def frame(self, index: int, timeline: Timeline) -> Frame:
        """Return what the source shows in a frame."""
        return self.source.frame(index, timeline.history)

    def state(self, frame: Frame, previous: TrackState | None, timeline: Timeline) -> TrackState:
        """Return the state of a frame.

        Args:
            frame: What the source shows.
            previous: The state of the frame before; None in frame 0.
            timeline: Of the run.
        """
        tracker, parameters = self._tracker(frame, timeline), timeline.parameters_at(frame.index)
        if previous is None:
            rng = Stream(self.seed, frame.index, Purpose.START)
            return tracker.start(self.source.start, frame, parameters, rng)
        rng = Stream(self.seed_at(frame.index, timeline), frame.index, Purpose.TRACK)
        return tracker.step(previous, frame, parameters, rng)

    def diagnose(self, frame: Frame, state: TrackState, timeline: Timeline, step_ms: float) -> Diagnostics:
        """Return the numbers of a frame.

        Args:
            frame: What the source shows.
            state: That of the frame.
            timeline: Of the run.
            step_ms: How long the tracker took, ms.
        """
        tracker, parameters = self._tracker(frame, timeline), timeline.parameters_at(frame.index)
        beside = self.setup.beside
        look = None if beside is None else lambda: beside(frame, state, parameters)
        return diagnose(
            frame,
            state,
            judge_state(self.experiment, state, frame.target, parameters),
            step_ms,
            scale=self.experiment.scale,
            searching=tracker.searching(state) if tracker.searching else None,
            series=measurements(self.experiment, self._declared, tracker, frame, state, look),
        )

    def step(self, frame: Frame, state: TrackState, row: Diagnostics, timeline: Timeline) -> Step:
        """Return a frame of a run as it is shown: what was seen, what is believed, and the numbers of both."""
        name = timeline.tracker_at(frame.index)
        title = self.experiment.trackers[name].title
        return Step(frame, state, row, timeline.parameters_at(frame.index), name, title)

    def agrees(self, previous: TrackState, row: Diagnostics, timeline: Timeline) -> bool:
        """Return whether the step from a state comes to the estimate of the frame after it.

        Args:
            previous: A state that another version of the program may have computed.
            row: The numbers of the frame after it.
            timeline: Of the run.
        """
        try:
            state = self.state(self.frame(row.frame, timeline), previous, timeline)
        except Exception:  # noqa: BLE001 - it was made for another version, and may fail in any way
            return False
        return tuple((self.experiment.scale * state.estimate).tolist()) == row.estimate

    def _tracker(self, frame: Frame, timeline: Timeline) -> Tracker:
        return self.experiment.trackers[timeline.tracker_at(frame.index)]


BUDGET_BYTES = 32 * 1024 * 1024


class Keyframes:
    """States at regular intervals, as many as the memory budget allows; the interval doubles when it is used up.

    The newest state is kept beside them, so that coming back from the past repeats no step at all.
    """

    def __init__(self, interval: int = 8, budget_bytes: int = BUDGET_BYTES) -> None:
        """Begin with a state every `interval` frames."""
        self._interval = interval
        self._budget_bytes = budget_bytes
        self._states: dict[int, TrackState] = {}
        self._newest: dict[int, TrackState] = {}
        self._bytes = 0

    def offer(self, frame: int, state: TrackState) -> None:
        """Keep the state if its frame is due, as frame 0 always is, or until a newer one comes; once for each frame."""
        if frame >= max(self._newest, default=0):
            self._newest = {frame: state}
        if frame % self._interval or frame in self._states:
            return
        self._states[frame] = state
        self._bytes += state.nbytes
        while self._bytes > self._budget_bytes and len(self._states) > 1:
            self._interval *= 2
            self._states = {index: kept for index, kept in self._states.items() if index % self._interval == 0}
            self._bytes = sum(kept.nbytes for kept in self._states.values())

    def latest(self, frame: int) -> tuple[int, TrackState]:
        """Return the newest state that is kept at or before a frame, and its number."""
        states = self.states
        index = max(kept for kept in states if kept <= frame)
        return index, states[index]

    def until(self, frame: int) -> "Keyframes":
        """Return the keyframes up to a frame; the states are shared."""
        twin = Keyframes(self._interval, self._budget_bytes)
        for index, state in self.states.items():
            if index <= frame:
                twin.offer(index, state)
        return twin

    @property
    def states(self) -> dict[int, TrackState]:
        """All states that are kept, by ascending frame."""
        return self._states | self._newest
