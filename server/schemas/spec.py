"""The spec: what has to be known of a session to make it again, to the bit, in a new worker or after a restart.

Seed, timeline and position are enough, since a run is a pure fold of them. The web process always holds the newest
spec, so a worker may die at any moment, and the store holds it too, so the server may.
"""

from typing import Annotated, Any

from pydantic import BaseModel, Field, field_validator

from pftrack.parameters import Value
from pftrack.runs.run import Change, Timeline

__all__ = [
    "LARGEST_SEED",
    "Bookmark",
    "Box",
    "BranchSpec",
    "ChangeModel",
    "Points",
    "SessionSpec",
    "as_models",
    "as_timeline",
]

LARGEST_SEED = 2**53 - 1
"""Largest whole number that a browser holds exactly."""

Place = Annotated[float, Field(ge=0, le=100_000, allow_inf_nan=False)]
Extent = Annotated[float, Field(ge=1, le=100_000, allow_inf_nan=False)]
Box = tuple[Place, Place, Extent, Extent]
Coordinate = Annotated[float, Field(ge=-100_000, le=100_000, allow_inf_nan=False)]
Points = Annotated[dict[Annotated[str, Field(max_length=64)], tuple[Coordinate, Coordinate]], Field(max_length=100)]
TruthRow = tuple[Coordinate, Coordinate, Coordinate, Coordinate] | tuple[Coordinate, Coordinate, Coordinate]


class ChangeModel(BaseModel):
    """A change on the timeline: from this frame on, these values."""

    frame: int = Field(ge=0)
    values: dict[str, Any]


class BranchSpec(BaseModel):
    """One branch: where it left which other, and all that makes it again."""

    id: str
    title: str
    parent: str | None = None
    frame: int = 0
    tracker: str
    first_tracker: str | None = None
    first_values: dict[str, Value] = {}
    timeline: list[ChangeModel] = []
    head: int = 0
    position: int = 0


class Bookmark(BaseModel):
    """A frame that somebody wants to find again."""

    id: str
    frame: int
    note: str = ""
    branch: str


class SessionSpec(BaseModel):
    """Everything that is kept of a session."""

    id: str
    experiment: str
    seed: int = 0
    frames: int | None = None
    sweep: str | None = None
    upload: str | None = None
    upload_name: str | None = None
    box: Box | None = None
    points: Points | None = None
    start: int = 0
    truth: dict[int, TruthRow] | None = None
    speed: float = 1.0
    branch: str = "b0"
    second: str | None = None  # the branch that is drawn beside the active one
    branches: dict[str, BranchSpec] = {}
    branches_made: int = 1
    bookmarks: list[Bookmark] = []
    created: str = ""
    card: dict[str, Any] | None = None
    values: dict[str, Value] = {}

    @field_validator("card")
    @classmethod
    def _migrate(cls, card: dict[str, Any] | None) -> dict[str, Any] | None:
        """Take layers in the form in which earlier versions stored them, by name with whether they are shown."""
        if card is None or not isinstance(card.get("layers"), dict):
            return card
        return {**card, "layers": [{"name": name, "shown": shown} for name, shown in card["layers"].items()]}

    @property
    def active(self) -> BranchSpec:
        """The active branch."""
        return self.branches[self.branch]

    def next_branch(self) -> str:
        """Return a name that no branch had before."""
        return f"b{self.branches_made}"


def as_timeline(changes: list[ChangeModel]) -> Timeline:
    """Return the library's timeline."""
    return tuple(Change(change.frame, dict(change.values)) for change in changes)


def as_models(timeline: Timeline) -> list[ChangeModel]:
    """Return a timeline as the API and the store carry it."""
    return [ChangeModel(frame=change.frame, values=dict(change.values)) for change in timeline]
