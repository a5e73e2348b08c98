"""Snapshots: what moves of a session while it lives.

The worker makes a snapshot of its run and tells what has changed of it since the last time. The web process keeps the
newest one, adds what it alone knows, and tells the pages which of the fields are new to them. Neither knows a field by
name for that: what is declared here and set where it is known travels to the pages, where each field is a signal.
"""

from collections.abc import Mapping
from enum import StrEnum
from typing import Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field

from pftrack.core.model.marks import Editor
from pftrack.core.model.measures import How
from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Recipe
from pftrack.core.model.series import Plot, Reading, Series
from pftrack.output.exports.formats import FileKind
from pftrack_server.core.panel import PanelDescription


class MeasurePublic(BaseModel):
    """The declaration of a measure."""

    name: str
    title: str
    description: str = Field(description="Its definition, one sentence")
    how: How = Field(description="A share of the frames, their median, or how many there were until one missed")
    unit: str
    better: Literal["higher", "lower"]
    source: str = Field(description="Author, title and year of its definition; empty for the project's own")


class TruthMark(BaseModel):
    """The kind of mark by which a person says what is true of a picture."""

    editor: Editor
    parts: list[str] = Field(description="Where in the mark the values of the columns after the frame's number stand")


class SessionDescription(PanelDescription):
    """What is fixed of a session while it lives."""

    subject: str = Field("", description="Its clip, or the preset that it began as; empty if it is neither")
    unit: str = "px"
    target: str = "target"
    series: list[Series] = Field([])
    plots: list[Plot] = Field([])
    readings: list[Reading] = Field([])
    measures: list[MeasurePublic] = Field([])
    success_measure: str = Field("", description="Name of the measure that decides on success")
    exports: list[FileKind] = Field([], description="Files that can be made of the run, or of the frame that is shown")
    watch: str = Field("", description="What to look at, where it began as a preset that says so")
    truth_columns: list[str] = Field([], description="Of a table of truth that can be given; empty if none can")
    truth_mark: TruthMark | None = Field(None, description="How truth is marked in pictures; null if it cannot be")
    fittable: dict[str, list[str]] = Field({}, description="Numbers that can be fitted to what was seen, by tracker")
    width: int
    height: int
    frame_rate_hz: float
    frames: int


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


class Goal(NamedTuple):
    """Where a run is on its way to: the furthest frame to compute, and the frame to show then, which is no later."""

    computed: int
    position: int


class ChangePublic(BaseModel):
    """A change of parameters on the timeline, with what was in force before it, unless the run begins with it."""

    frame: int
    values: dict[str, Value]
    before: dict[str, Value] = {}
    moved: list[str] = Field([], description="What a person has moved, in words")


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
    doubts: dict[str, str] = Field({}, description="How error bands are off in the next frame, each in a sentence")
    timeline: list[ChangePublic] = []
    thresholds: list[ThresholdPublic] = []
    restarts: int = Field(0, description="How often it was restarted, which drops its past")
    position: int = Field(0, description="Frame that is shown")
    computed: int = Field(0, description="Furthest frame computed")
    branch_point: int | None = Field(None, description="Frame where a change branches off; null if it makes no branch")
    goal: int | None = Field(None, description="Frame to which it is computing, while it is; a pause stops it")
    goal_position: int | None = Field(None, description="Frame that it shows when it has come to its goal")
    playing: bool = False
    speed: float = Field(1.0, description="Times real time; 0 is as fast as possible")
    behind_s: float = Field(0.0, description="How far a frame is behind its time, s, since it plays at this speed")
    stop_at: float | None = Field(None, description="P(lost), 0 to 1, from which on it stops playing; null for never")
    stopped: str = Field("", description="Why it has stopped playing by itself, a few words")
    compiling: int | None = Field(None, description="While it compiles what it uses first: how many functions so far")
    problem: Problem | None = Field(None, description="What is wrong in the file of a filter, where something is")
    look: str = Field("", description="How the target separates from its surroundings where it is, and since when")
    measured: dict[str, float | None] = Field({}, description="Measures of the branch so far, by name")

    @property
    def bound(self) -> Goal:
        """Where it is on its way to, or where it is: a run that is made again goes there."""
        if self.goal is None or self.goal_position is None:
            return Goal(self.computed, self.position)
        return Goal(self.goal, self.goal_position)

    def phase(self, frames: int) -> Phase:
        """Return the phase of a session whose worker holds this run of so many frames."""
        if self.playing:
            return Phase.PLAYING
        return Phase.ENDED if self.position >= frames - 1 else Phase.READY


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


def differences(before: BaseModel, after: BaseModel) -> dict[str, Any]:
    """Return the fields of a snapshot that have changed since an earlier one, with their values."""
    return {name: value for name, value in after if value != getattr(before, name)}


class BranchSpec(BaseModel):
    """One branch: where it left which other, and all that makes it again.

    Attributes:
        title: What people call it.
        parent: The branch that it left.
        frame: Where it left that.
        run: Its run as it was told of last, without the truth, which the session keeps.
    """

    title: str
    parent: str | None = None
    frame: int = 0
    run: RunSnapshot


class SessionSpec(BaseModel):
    """Everything that is kept of a session.

    Attributes:
        id: Its name.
        name: What a person called it; empty if nobody did.
        sweep: Name of the sweep that it is a run of.
        upload: Name of the upload that its footage is.
        follow: Name of the class whose follower has it; it ends with that.
        truth: Of the footage, once for all branches, since it may have a row for each of thousands of frames.
        branch: The active branch.
        branches: By name.
        branches_made: How many there ever were, so that no name comes twice.
        bookmarks: In the order of their frames.
        created: When.
        remark: What a person should know of it, such as that it came to other numbers than the run that was saved.
        description: What is fixed of it, as its worker reported it; None before the first one has.
    """

    id: str
    name: str = ""
    sweep: str | None = None
    upload: str | None = None
    follow: str | None = None
    truth: dict[int, tuple[float, ...]] | None = None
    branch: str = FIRST
    branches: dict[str, BranchSpec]
    branches_made: int = 1
    bookmarks: list[Bookmark] = []
    created: str = ""
    remark: str | None = None
    description: SessionDescription | None = None

    @property
    def active(self) -> BranchSpec:
        """The active branch."""
        return self.branches[self.branch]

    @property
    def run(self) -> RunSnapshot:
        """What moves of the active branch, as it was told of last."""
        return self.active.run

    @property
    def recipe(self) -> Recipe:
        """The recipe of the active branch, without the truth."""
        return self.run.recipe

    def next_branch(self) -> str:
        """Return a name that no branch had before."""
        return f"b{self.branches_made}"
