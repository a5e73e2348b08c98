"""Snapshots: what moves of a session while it lives.

The worker makes a snapshot of its run and tells what has changed of it since the last time. The web process keeps the
newest one, adds what it alone knows, and tells the pages which of the fields are new to them. Neither knows a field by
name for that: what is declared here and set where it is known travels to the pages, where each field is a topic.
"""

from collections.abc import Mapping
from enum import StrEnum
from typing import Any, NamedTuple, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Recipe

FIRST = "b0"
"""Name of a session's first branch."""


class Phase(StrEnum):
    """What a session does; `SessionState` derives it and is the one who changes it."""

    STARTING = "starting"
    READY = "ready"
    PLAYING = "playing"
    ENDED = "ended"
    """The last frame of the run is shown."""
    SUSPENDED = "suspended"
    CRASHED = "crashed"
    CLOSED = "closed"


AWAKE = frozenset({Phase.READY, Phase.PLAYING, Phase.ENDED})
"""There is a worker that listens."""
LIVE = AWAKE | {Phase.STARTING}
"""There is a worker, or there is about to be one."""
TRANSITIONS: Mapping[Phase, frozenset[Phase]] = {
    Phase.SUSPENDED: frozenset({Phase.STARTING, Phase.CLOSED}),
    Phase.CRASHED: frozenset({Phase.STARTING, Phase.CLOSED}),
    Phase.STARTING: AWAKE | {Phase.CRASHED, Phase.CLOSED},
    **{phase: AWAKE - {phase} | {Phase.SUSPENDED, Phase.CRASHED, Phase.CLOSED} for phase in AWAKE},
    Phase.CLOSED: frozenset(),
}
"""To which phases each leads; nothing else is ever made of a session."""


Snapshot = TypeVar("Snapshot", bound=BaseModel)


class Goal(NamedTuple):
    """Where a run is on its way to: the furthest frame to compute, and the frame to show then, which is no later."""

    computed: int
    position: int


class ChangePublic(BaseModel):
    """A change of parameters on the timeline, with what was in force before it, unless the run begins with it."""

    frame: int
    values: dict[str, Value]
    before: dict[str, Value] = {}


class ThresholdStep(BaseModel):
    """From this frame on a threshold has this value; null while no tracker reads it."""

    frame: int
    value: float | None


class ThresholdPublic(BaseModel):
    """What the tracker compares something with, as it changed in the course of the run."""

    name: str
    of: str
    steps: list[ThresholdStep]


class Problem(BaseModel):
    """Why a person's own filter cannot go on."""

    model_config = ConfigDict(frozen=True)

    file: str
    line: int | None = Field(description="Where it shows, from 1; null where no line can be named")
    text: str


class RunSnapshot(BaseModel):
    """What moves of a run, the active branch of a session; also where a worker has to begin."""

    model_config = ConfigDict(frozen=True)

    branch: str = FIRST
    second: str | None = Field(None, description="Branch that is drawn beside the active one")
    recipe: Recipe
    tracker: str = Field(description="In force for the next frame")
    parameters: dict[str, Value] = Field({}, description="In force for the next frame")
    doubts: dict[str, str] = Field(
        {}, description="Ways in which error bands are off in the next frame, with a sentence"
    )
    timeline: list[ChangePublic] = []
    thresholds: list[ThresholdPublic] = []
    restarts: int = Field(0, description="How often it was restarted, which drops its past")
    position: int = Field(0, description="Frame that is shown")
    computed: int = Field(0, description="Furthest frame computed")
    branch_point: int | None = Field(
        None, description="Frame at which a change leaves this branch; null where it counts from its next frame on"
    )
    goal: int | None = Field(None, description="Frame to which it is computing, while it is; a pause stops it")
    goal_position: int | None = Field(None, description="Frame that it shows when it has come to its goal")
    playing: bool = False
    speed: float = Field(1.0, description="Times real time; 0 is as fast as possible")
    behind_s: float = Field(0.0, description="How far a frame is behind its time, s, since it plays at this speed")
    stop_at: float | None = Field(
        None, description="Probability, 0 to 1, that the target is lost, from which on it stops playing; null for never"
    )
    stopped: str = Field("", description="Why it has stopped playing by itself, a few words")
    compiling: int | None = Field(None, description="While it compiles what it uses first: how many functions so far")
    problem: Problem | None = Field(None, description="What is wrong in the file of a filter, where something is")
    look: str = Field("", description="How the target separates from its surroundings where it is, and since when")
    measured: dict[str, float | None] = Field({}, description="Measures of the branch so far, by name")

    @property
    def bound(self) -> Goal:
        """Where it is on its way to, or where it is: whoever makes the run again goes there."""
        if self.goal is None or self.goal_position is None:
            return Goal(self.computed, self.position)
        return Goal(self.goal, self.goal_position)

    def phase(self, frames: int) -> Phase:
        """Return the phase of a session whose worker holds this run of so many frames."""
        if self.playing:
            return Phase.PLAYING
        return Phase.ENDED if self.position >= frames - 1 else Phase.READY

    @property
    def is_moving(self) -> bool:
        """Whether it goes on by itself."""
        return self.playing or self.goal is not None


class BranchPublic(BaseModel):
    """A branch as the page lists it."""

    id: str
    title: str
    parent: str | None
    frame: int
    tracker: str
    colour: str


class Bookmark(BaseModel):
    """A frame that somebody wants to find again."""

    id: str
    frame: int
    note: str = ""
    branch: str


class SessionSnapshot(RunSnapshot):
    """What moves of a session: that of its run, and what the web process alone knows."""

    state: Phase
    message: str | None = Field(None, description="Why it is in this state, where there is something to say")
    name: str = Field("", description="As a person called it, or its clip, preset or experiment")
    remark: str | None = Field(None, description="What a person should know of it, a sentence")
    branches: list[BranchPublic]
    bookmarks: list[Bookmark]


def differences(before: Snapshot, after: Snapshot) -> dict[str, Any]:
    """Return the fields of a snapshot that have changed since an earlier one, with their values."""
    return {name: value for name, value in after if value != getattr(before, name)}
