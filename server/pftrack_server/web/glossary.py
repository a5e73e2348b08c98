"""The glossary: what the words on the pages mean."""

from fastapi import APIRouter

from pftrack.core.model.glossary import GLOSSARY, Section
from pftrack.experiments import EXPERIMENTS

router = APIRouter(prefix="/glossary", tags=["experiments"])


@router.get("")
def show_glossary() -> list[Section]:
    """List all words with their meaning: those that all experiments share, then those of each."""
    return [*GLOSSARY, *(each.glossary for each in EXPERIMENTS.values())]
