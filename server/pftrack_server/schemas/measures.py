"""Measures: what a whole run beside its truth comes to, as pages show it."""

from typing import Literal

from pydantic import BaseModel, Field

from pftrack.core.model.measures import How


class MeasurePublic(BaseModel):
    """The declaration of a measure."""

    name: str
    title: str
    description: str = Field(description="Its definition, one sentence")
    how: How = Field(description="A share of the frames, their median, or how many there were until one missed")
    unit: str
    better: Literal["higher", "lower"]
    source: str = Field(description="Author, title and year of whoever defined it; empty for the project's own")
