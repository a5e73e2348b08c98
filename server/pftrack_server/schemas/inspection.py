"""What is found in the frame that a session shows, where somebody looks into it, and why a target was lost."""

from typing import Literal, TypeAlias

from pydantic import BaseModel, Field

from pftrack.core.model.likelihood import Amount, Contributions, Histograms, Residual
from pftrack.core.model.series import Known
from pftrack.runs.inspection import Course, ParticleFinding


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
    particle: ParticleFinding | None
    update: list[PartPublic] = Field(description="What the tracker's step of this frame was made of")
    courses: tuple[Course, ...]
    genealogy: GenealogyPublic | None
