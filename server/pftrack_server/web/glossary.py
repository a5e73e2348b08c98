"""The glossary: what the words on the pages mean."""

from fastapi import APIRouter

from pftrack.core.model.glossary import GLOSSARY, Section
from pftrack.experiments import EXPERIMENTS
from pftrack_server.schemas.glossary import SectionPublic, TermPublic

router = APIRouter(prefix="/glossary", tags=["experiments"])


@router.get("")
def show_glossary() -> list[SectionPublic]:
    """List all words with their meaning: those that all experiments share, then those of each."""
    own = [_public(each.glossary, each.id) for each in EXPERIMENTS.values()]
    return [*(_public(section) for section in GLOSSARY), *own]


def _public(section: Section, experiment: str | None = None) -> SectionPublic:
    terms = [TermPublic.model_validate(term) for term in section.terms]
    return SectionPublic(title=section.title, experiment=experiment, terms=terms)
