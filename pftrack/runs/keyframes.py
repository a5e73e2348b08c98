"""Keyframes: whole states kept now and then, so that seeking repeats few steps."""

from pftrack.core.model.tracker import TrackState

__all__ = ["Keyframes"]

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
