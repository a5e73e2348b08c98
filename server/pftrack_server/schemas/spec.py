"""The spec: what has to be known of a session to make it again, to the bit, in a new worker or after a restart.

Recipe and position of each branch are enough, since a run is a pure fold of its recipe. The web process always holds
the newest spec, so a worker may die at any moment, and the store holds it too, so the server may.
"""

from pydantic import BaseModel

from pftrack.core.model.recipe import Recipe
from pftrack_server.schemas.description import SessionDescription
from pftrack_server.schemas.snapshot import FIRST, Bookmark, RunSnapshot


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
        sweep: Name of the sweep of which it is a run.
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
