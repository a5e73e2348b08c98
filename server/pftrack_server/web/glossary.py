"""The glossary: what the words on the pages mean."""

from fastapi import APIRouter
from pydantic import BaseModel, ConfigDict, Field

from pftrack.core.model.glossary import GLOSSARY, Section
from pftrack.experiments import EXPERIMENTS


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


router = APIRouter(prefix="/glossary", tags=["experiments"])


@router.get("")
def show_glossary() -> list[SectionPublic]:
    """List all words with their meaning: those that all experiments share, then those of each."""
    own = [_public(each.glossary, each.id) for each in EXPERIMENTS.values()]
    return [*(_public(section) for section in GLOSSARY), *own]


def _public(section: Section, experiment: str | None = None) -> SectionPublic:
    terms = [TermPublic.model_validate(term) for term in section.terms]
    return SectionPublic(title=section.title, experiment=experiment, terms=terms)
