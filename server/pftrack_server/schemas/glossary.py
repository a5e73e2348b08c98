"""The glossary as pages have it."""

from pydantic import BaseModel, ConfigDict, Field


class TermPublic(BaseModel):
    """A word and what it means."""

    model_config = ConfigDict(from_attributes=True)

    name: str
    meaning: str
    also: list[str] = Field(description="Other forms in which pages have it")


class SectionPublic(BaseModel):
    """Words that belong together."""

    title: str
    experiment: str | None = Field(description="Whose own words they are; null of those that all experiments share")
    terms: list[TermPublic]
