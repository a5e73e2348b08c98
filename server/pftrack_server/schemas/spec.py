"""The spec: what has to be known of a session to make it again, to the bit, in a new worker or after a restart.

Recipe and position of each branch are enough, since a run is a pure fold of its recipe. The web process always holds
the newest spec, so a worker may die at any moment, and the store holds it too, so the server may.
"""

from typing import NamedTuple

from pydantic import BaseModel

from pftrack.model.parameters import Value
from pftrack.model.recipe import Recipe
from pftrack_server.schemas.description import SessionDescription

__all__ = ["BEGINNING", "FIRST", "Bookmark", "BranchSpec", "Goal", "SessionSpec"]

FIRST = "b0"
"""Name of a session's first branch."""


class Goal(NamedTuple):
    """Where a run is on its way to: the furthest frame to compute, and the frame to show then."""

    computed: int
    position: int


BEGINNING = Goal(0, 0)


class BranchSpec(BaseModel):
    """One branch: where it left which other, and all that makes it again.

    Attributes:
        id: Name within the session.
        title: What people call it.
        parent: The branch that it left.
        frame: Where it left that.
        recipe: What makes its run; the truth is kept by the session.
        tracker: In force for the next frame.
        first_values: Parameters at frame 0.
        computed: Furthest frame computed.
        position: Frame that is shown.
        goal: Where it is on its way to, while it is; whoever makes the run again goes on to there.
    """

    id: str
    title: str
    parent: str | None = None
    frame: int = 0
    recipe: Recipe
    tracker: str
    first_values: dict[str, Value] = {}
    computed: int = 0
    position: int = 0
    goal: Goal | None = None

    @property
    def bound(self) -> Goal:
        """Where it is on its way to, or where it is."""
        return self.goal or Goal(self.computed, self.position)


class Bookmark(BaseModel):
    """A frame that somebody wants to find again."""

    id: str
    frame: int
    note: str = ""
    branch: str


class SessionSpec(BaseModel):
    """Everything that is kept of a session.

    Attributes:
        id: Its name.
        sweep: Name of the sweep of which it is a run.
        upload: Name of the upload that its footage is.
        follow: Name of the class whose follower has it; it ends with that.
        truth: Of the footage, once for all branches, since it may have a row for each of thousands of frames.
        speed: Times real time; 0 is as fast as possible.
        branch: The active branch.
        second: The branch that is drawn beside the active one.
        branches: By name.
        branches_made: How many there ever were, so that no name comes twice.
        bookmarks: In the order of their frames.
        created: When.
        remark: What a person should know of it, such as that it came to other numbers than the run that was saved.
        description: What is fixed of it, as its worker reported it; None before the first one has.
        values: Parameters in force for the next frame.
    """

    id: str
    sweep: str | None = None
    upload: str | None = None
    follow: str | None = None
    truth: dict[int, tuple[float, ...]] | None = None
    speed: float = 1.0
    branch: str = FIRST
    second: str | None = None
    branches: dict[str, BranchSpec]
    branches_made: int = 1
    bookmarks: list[Bookmark] = []
    created: str = ""
    remark: str | None = None
    description: SessionDescription | None = None
    values: dict[str, Value] = {}

    @property
    def active(self) -> BranchSpec:
        """The active branch."""
        return self.branches[self.branch]

    @property
    def recipe(self) -> Recipe:
        """The recipe of the active branch, without the truth."""
        return self.active.recipe

    def next_branch(self) -> str:
        """Return a name that no branch had before."""
        return f"b{self.branches_made}"
