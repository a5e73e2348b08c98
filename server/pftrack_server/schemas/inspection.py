"""What is found in the frame that a session shows, where somebody looks into it, and why a target was lost."""

from typing import Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

from pftrack.core.model.likelihood import Amount, Contributions, Histograms, Residual
from pftrack.core.model.measures import Witness
from pftrack.core.model.preset import CauseId
from pftrack.core.model.series import Known
from pftrack.runs.inspection import Course


class PatchesPublic(BaseModel):
    """A piece of the picture beside the one expected, as addresses of PNG data; null where it is outside."""

    kind: Literal["patches"] = "patches"
    title: str
    expected: str | None
    found: str | None


PartPublic: TypeAlias = Amount | Residual | Histograms | PatchesPublic | Contributions


class StateValue(BaseModel):
    """One coordinate of the state that is looked at."""

    name: str
    unit: str
    value: Known


class ParticlePublic(BaseModel):
    """A particle, where it comes from and what became of it."""

    model_config = ConfigDict(from_attributes=True)

    particle: int
    filter: str = Field(description="What has drawn it, where several filters have; the numbers are of that one")
    number: int = Field(description="Its place among the particles of that filter")
    count: int
    weight: float
    rank: int
    sampler: str
    ancestors: list[int] = Field(description="Its parent in the frame before, the parent of that, and so on")
    begins: int | None = Field(
        description="The frame in which its line begins, without a parent; null if not so far back"
    )
    descendants: list[int] = Field(description="How many in each of the frames after, as far as they were computed")


class GenealogyPublic(BaseModel):
    """The ancestors of the particles of the frame."""

    first: int = Field(description="The oldest frame")
    counts: list[int] = Field(description="How many different ancestors there are in each frame from there on")
    coalesced: int | None = Field(description="The newest frame in which one particle is the ancestor of all")
    lines: list[list[Known]] = Field(
        description="The heights of lines, 0 to 1, in each frame, null before a line begins; lines meet, never cross"
    )


class InspectionPublic(BaseModel):
    """What is found in the frame that is shown."""

    frame: int
    subject: Literal["estimate", "place", "particle", "gone"] = Field(
        description="What was looked at; gone is a particle that has no descendants here"
    )
    place: tuple[float, float] | None
    title: str = Field(description="What the likelihood compares; empty for a tracker that cannot be asked")
    has_map: bool = Field(description="Whether the likelihood can lie over the picture")
    scale: tuple[float, float] | None = Field(description="The log likelihoods of the darkest and the lightest colour")
    log_likelihood: Known | None = Field(description="Null where it cannot be asked, or is impossible")
    impossible: bool
    parts: list[PartPublic]
    state: list[StateValue]
    particle: ParticlePublic | None
    update: list[PartPublic] = Field(description="What the tracker's step of this frame was made of")
    courses: tuple[Course, ...]
    genealogy: GenealogyPublic | None


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
