"""The glossary, from the declarations of the library and of the experiments."""

from pftrack.core.model.glossary import GLOSSARY, Section
from pftrack.experiments import EXPERIMENTS

__all__ = ["markdown"]


def markdown() -> str:
    """Return the glossary as Markdown: tables of shared words by subject, and one table per experiment."""
    sections = (*GLOSSARY, *(EXPERIMENTS[name].glossary for name in EXPERIMENTS.own))
    return "\n\n".join(_table(section) for section in sections)


def _table(section: Section) -> str:
    rows = (f"| **{term.name}** | {term.meaning} |".replace("\n", " ") for term in section.terms)
    return f"## {section.title}\n\n| word | meaning |\n|---|---|\n" + "\n".join(rows)
