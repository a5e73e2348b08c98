"""Explanations of losses, as a session's page shows them."""

from pydantic import BaseModel, Field

from pftrack.core.model.measures import Witness
from pftrack.core.model.preset import CauseId


class EvidencePublic(BaseModel):
    """A column of numbers in the frames around what it shows."""

    name: str
    title: str
    unit: str
    first: int = Field(description="Frame of the first number")
    values: list[float | None] = Field(description="A number a frame; null where there is none")


class SignPublic(BaseModel):
    """That a cause is at work."""

    cause: CauseId
    title: str
    since: int = Field(description="Frame since when")
    strength: float = Field(description="How clearly, 0 to 1")
    words: str = Field(description="What was measured, a sentence with its numbers")
    numbers: dict[str, float | None]
    evidence: list[EvidencePublic]


class DiagnosisPublic(BaseModel):
    """What went wrong at a moment of a run."""

    frame: int | None = Field(description="First frame of the loss, or the one that was asked about; null if none is")
    lost: bool
    first_lost_frame: int | None = Field(description="The first of all in which the target is lost; null if none is")
    witness: Witness = Field(description="Who says whether it is lost: truth, tracker, or nobody")
    cause: CauseId = Field(description="What began first")
    sentence: str
    signs: list[SignPublic] = Field(description="By when they began")


class ExplanationPublic(BaseModel):
    """What can be said of a loss."""

    diagnosis: DiagnosisPublic
