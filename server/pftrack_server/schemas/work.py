"""All that people of this server have of their own: sessions, saved runs, comparisons, sweeps and uploads."""

from typing import Literal

from pydantic import BaseModel, Field

from pftrack_server.schemas.comparisons import SavedComparisonPublic
from pftrack_server.schemas.messages import SessionPublic
from pftrack_server.schemas.runs import RunPublic
from pftrack_server.schemas.sweep_views import SweepPublic
from pftrack_server.schemas.uploads import UploadPublic

Kind = Literal["sessions", "runs", "comparisons", "sweeps", "uploads"]


class WorkCounts(BaseModel):
    """How many there are of each kind."""

    sessions: int
    runs: int
    comparisons: int
    sweeps: int
    uploads: int


class WorkPublic(BaseModel):
    """What was found, the newest of each kind first."""

    sessions: list[SessionPublic]
    runs: list[RunPublic]
    comparisons: list[SavedComparisonPublic]
    sweeps: list[SweepPublic]
    uploads: list[UploadPublic]
    found: WorkCounts = Field(description="How many have all the words, those beyond the limit included")
    total: WorkCounts = Field(description="How many there are")
