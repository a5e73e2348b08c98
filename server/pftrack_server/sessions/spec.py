"""Specs and snapshots: what is kept of a session, and what changes while it exists.

The worker makes a snapshot of its run and reports the fields that have changed since the last one. The web process
keeps the newest snapshot, adds its own fields, and sends the pages those that are new to them. Neither names a field
for that: every field declared here travels to the pages, where it is a signal.
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
    how: How = Field(description="Share of frames, median over frames, or number of frames until the first miss")
    unit: str
    better: Literal["higher", "lower"]
    source: str = Field(description="Author, title and year of its definition; empty for the project's own")


class TruthMark(BaseModel):
    """The kind of mark by which a person gives the truth of a picture."""

    editor: Editor
    parts: list[str] = Field(description="Paths in the mark of the values of the columns after the frame number")


class SessionDescription(PanelDescription):
    """The part of a session that does not change."""

    subject: str = Field("", description="Its clip, or the preset that it began as; empty if it has neither")
    unit: str = "px"
    target: str = "target"
    series: list[Series] = Field([])
    plots: list[Plot] = Field([])
    readings: list[Reading] = Field([])
    measures: list[MeasurePublic] = Field([])
    success_measure: str = Field("", description="Name of the measure that decides success")
    exports: list[FileKind] = Field([], description="Kinds of files to export the run or the shown frame as")
    watch: str = Field("", description="Hint on where to look, if its preset has one")
    truth_columns: list[str] = Field([], description="Columns of a truth table; empty if no truth can be given")
    truth_mark: TruthMark | None = Field(None, description="How truth is marked in pictures; null if it cannot be")
    fittable: dict[str, list[str]] = Field({}, description="Parameters that can be fitted to the data, by tracker")
    width: int
    height: int
    frame_rate_hz: float
    frames: int


FIRST = "b0"
"""Name of a session's first branch."""


class Phase(StrEnum):
    """The phase of a session; only `SessionState` derives and changes it."""

    STARTING = "starting"
    READY = "ready"
    PLAYING = "playing"
    ENDED = "ended"
    """The last frame of the run is shown."""
    SUSPENDED = "suspended"
    CRASHED = "crashed"
    CLOSED = "closed"


AWAKE = frozenset({Phase.READY, Phase.PLAYING, Phase.ENDED})
"""Phases with a worker that takes commands."""

LIVE = AWAKE | {Phase.STARTING}
"""Phases with a worker, or with one that starts."""

TRANSITIONS: Mapping[Phase, frozenset[Phase]] = {
    Phase.SUSPENDED: frozenset({Phase.STARTING, Phase.CLOSED}),
    Phase.CRASHED: frozenset({Phase.STARTING, Phase.CLOSED}),
    Phase.STARTING: AWAKE | {Phase.CRASHED, Phase.CLOSED},
    **{phase: AWAKE - {phase} | {Phase.SUSPENDED, Phase.CRASHED, Phase.CLOSED} for phase in AWAKE},
    Phase.CLOSED: frozenset(),
}
"""Allowed transitions: the phases that can follow each phase."""


class Goal(NamedTuple):
    """A run's goal: the last frame to compute, and the frame to show then, which is not later."""

    computed: int
    position: int


class ChangePublic(BaseModel):
    """A change of parameters on the timeline, with the values before it, unless the run begins with it."""

    frame: int
    values: dict[str, Value]
    before: dict[str, Value] = {}
    moved: list[str] = Field([], description="Changes made by a person, in words")


class ThresholdStep(BaseModel):
    """A threshold's value from a frame on; null while no tracker reads it."""

    frame: int
    value: float | None


class ThresholdPublic(BaseModel):
    """A threshold of the tracker, with its changes over the run."""

    name: str
    of: str
    steps: list[ThresholdStep]


class Problem(BaseModel):
    """Why a person's own filter cannot continue."""

    model_config = ConfigDict(frozen=True)

    file: str
    line: int | None = Field(description="Line of the fault, from 1; null if unknown")
    text: str


class RunSnapshot(BaseModel):
    """The changing part of a run, the active branch of a session; a worker begins from it."""

    model_config = ConfigDict(frozen=True)

    branch: str = FIRST
    second: str | None = Field(None, description="Branch that is drawn together with the active one")
    recipe: Recipe
    tracker: str = Field(description="Tracker for the next frame")
    parameters: dict[str, Value] = Field({}, description="Parameters for the next frame")
    doubts: dict[str, str] = Field({}, description="Why error bands of the next frame may be wrong, each in a sentence")
    timeline: list[ChangePublic] = []
    thresholds: list[ThresholdPublic] = []
    restarts: int = Field(0, description="Number of restarts; each drops the past")
    position: int = Field(0, description="The shown frame")
    computed: int = Field(0, description="Furthest frame computed")
    branch_point: int | None = Field(None, description="Frame where a change branches off; null if it does not")
    goal: int | None = Field(None, description="Last frame to compute, while it computes; a pause stops it")
    goal_position: int | None = Field(None, description="Frame to show when the goal is reached")
    playing: bool = False
    speed: float = Field(1.0, description="Times real time; 0 is as fast as possible")
    behind_s: float = Field(0.0, description="Delay of the shown frame since it plays at this speed, s")
    stop_at: float | None = Field(None, description="P(lost), 0 to 1, at which playing stops; null for never")
    stopped: str = Field("", description="Why playing stopped by itself, a few words")
    compiling: int | None = Field(None, description="Functions compiled so far, while it compiles")
    problem: Problem | None = Field(None, description="Fault in the filter file, if any")
    look: str = Field("", description="How well the target stands out from its surroundings, and since when")
    measured: dict[str, float | None] = Field({}, description="Measures of the branch so far, by name")

    @property
    def bound(self) -> Goal:
        """Its goal, or its present place: a run that is made again computes up to there."""
        if self.goal is None or self.goal_position is None:
            return Goal(self.computed, self.position)
        return Goal(self.goal, self.goal_position)

    def phase(self, frames: int) -> Phase:
        """Return the phase of a session whose worker holds this run of `frames` frames."""
        if self.playing:
            return Phase.PLAYING
        return Phase.ENDED if self.position >= frames - 1 else Phase.READY


class BranchPublic(BaseModel):
    """A branch in the page's list."""

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
    """The changing part of a session: its run's, and the fields of the web process."""

    state: Phase
    message: str | None = Field(None, description="Why it is in this phase, if there is a reason")
    name: str = Field("", description="Name given by a person, or its clip, preset or experiment")
    remark: str | None = Field(None, description="Remark on the session, a sentence")
    branches: list[BranchPublic]
    bookmarks: list[Bookmark]


def differences(before: BaseModel, after: BaseModel) -> dict[str, Any]:
    """Return the fields of a snapshot that differ from an earlier one, with their new values."""
    known = vars(before)
    return {name: value for name, value in vars(after).items() if value is not known[name] and value != known[name]}


class BranchSpec(BaseModel):
    """One branch: its parent, where it left that, and everything to make it again.

    Attributes:
        title: Its title.
        parent: The branch that it left.
        frame: Frame where it left its parent.
        run: The last reported snapshot of its run, without the truth, which the session keeps.
    """

    title: str
    parent: str | None = None
    frame: int = 0
    run: RunSnapshot


class SessionSpec(BaseModel):
    """The stored part of a session.

    Attributes:
        id: Its name.
        name: Name given by a person, or empty.
        sweep: Name of the sweep that the run belongs to.
        upload: Name of the upload that holds its footage.
        follow: Name of the class whose follower owns it; it ends with the class.
        truth: Truth of the footage, once for all branches, since it may have thousands of rows.
        branch: The active branch.
        branches: Branches by name.
        branches_made: Number of branches ever made, so that no name is used twice.
        bookmarks: Bookmarks in the order of their frames.
        created: When it was created.
        remark: Remark on it, such as that its numbers differ from those of the saved run.
        description: Its unchanging part, as the worker reported it; None before the first worker has.
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
        """The last reported snapshot of the active branch."""
        return self.active.run

    @property
    def recipe(self) -> Recipe:
        """The recipe of the active branch, without the truth."""
        return self.run.recipe

    def next_branch(self) -> str:
        """Return a new name for a branch."""
        return f"b{self.branches_made}"
