"""The glossary and the references: one meaning for each word, and the sources of methods and studies, as data.

Words that all experiments share are in `glossary.yaml` next to this file, and an experiment declares its own
(`Experiment.terms`). The page of the glossary, the hints of pages on words, and the documentation use these
declarations. An experiment names its sources as citations, each a reference and a place in it. The references of the
project's own experiments are in `references.yaml`; an experiment of another package has its own.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pydantic import with_config

from pftrack.core.texts import CLOSED, read_as, read_texts


@dataclass(frozen=True, slots=True)
class Term:
    """A word and what it means.

    Attributes:
        name: The word as it stands in a sentence.
        meaning: Its meaning, a sentence without its full stop, for a beginner.
        also: Other forms in which pages have it, such as its plural or a symbol.
    """

    name: str
    meaning: str
    also: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a form that is found everywhere, and a word that means nothing.

        Raises:
            ValueError: The name, the meaning or another form is blank.
        """
        if not all(text.strip() for text in (self.name, self.meaning, *self.also)):
            raise ValueError(f"a term needs a name, a meaning and no blank form, got {self}")


@dataclass(frozen=True, slots=True)
class Section:
    """Terms that belong together.

    Attributes:
        title: Their subject.
        terms: In the order in which they are best read.
        experiment: Whose own words they are; None of those that all experiments share.
    """

    title: str
    terms: tuple[Term, ...]
    experiment: str | None = None


def read_glossary(path: Path) -> tuple[Section, ...]:
    """Return the sections of a YAML file: titles, and below each its terms with their meanings.

    A meaning is a text, or a mapping with `meaning` and the list `also`.

    Raises:
        ValueError: The file is not such YAML; it names the section and its line.
    """
    declared, places = read_texts(path)
    return tuple(_section(title, terms, places[title]) for title, terms in declared.items())


def _section(title: str, terms: Mapping[str, Any], place: str) -> Section:
    try:
        return Section(title, tuple(_term(name, said) for name, said in terms.items()))
    except (AttributeError, TypeError, KeyError) as error:
        raise ValueError(f"{place}: {title} must map words to a meaning, or to `meaning` and `also`") from error


def _term(name: str, said: str | Mapping[str, Any]) -> Term:
    return Term(name, said) if isinstance(said, str) else Term(name, said["meaning"], tuple(said["also"]))


GLOSSARY = read_glossary(Path(__file__).with_name("glossary.yaml"))
"""The words that all experiments share, by subject."""


@with_config(CLOSED)
@dataclass(frozen=True, slots=True)
class Reference:
    """A publication.

    Attributes:
        key: Its name in BibTeX.
        kind: Its type in BibTeX.
        authors: Full names, family name last.
        title: As printed.
        year: Year of publication.
        where: Further fields of BibTeX: journal, volume, number and pages of an article; booktitle and pages of a
            paper; type, school and number of a dissertation; type and institution of a report; howpublished of what is
            else ("misc").
    """

    key: str
    kind: Literal["article", "inproceedings", "misc", "phdthesis", "techreport"]
    authors: tuple[str, ...]
    title: str
    year: int
    where: Mapping[str, str] = field(default_factory=dict)

    @property
    def short(self) -> str:
        """Family names and year."""
        names = [name.split()[-1] for name in self.authors]
        shown = " and ".join(names) if len(names) < 3 else f"{names[0]} et al."
        return f"{shown} {self.year}"

    @property
    def text(self) -> str:
        """The whole reference as plain text."""
        authors = " and ".join(filter(None, (", ".join(self.authors[:-1]), self.authors[-1])))
        return f"{authors}: {self.title}. {self._publication}, {self.year}."

    def bibtex(self, note: str = "") -> str:
        """Return the entry of BibTeX.

        Args:
            note: The cited part, if not all.
        """
        fields = {
            "author": " and ".join(self.authors),
            "title": f"{{{self.title}}}",
            **self.where,
            "year": str(self.year),
            **({"note": note} if note else {}),
        }
        lines = "".join(f"  {name} = {{{value}}},\n" for name, value in fields.items())
        return f"@{self.kind}{{{self.key},\n{lines}}}\n"

    @property
    def _publication(self) -> str:
        where = dict(self.where)
        if self.kind != "article":
            return ", ".join(where.values()).replace("--", "-")
        volume = " ".join(filter(None, (where.get("journal"), where.get("volume"))))
        issue = f"({where['number']})" if "number" in where else ""
        pages = f", {where['pages'].replace('--', '-')}" if "pages" in where else ""
        return f"{volume}{issue}{pages}"


@dataclass(frozen=True, slots=True)
class Citation:
    """A place in a publication.

    Attributes:
        reference: The publication.
        place: Chapter or section with its title; all of it if empty.
    """

    reference: Reference
    place: str = ""

    @property
    def short(self) -> str:
        """Family names, year and place."""
        return ", ".join(filter(None, (self.reference.short, self.place)))

    @property
    def text(self) -> str:
        """The whole citation as plain text."""
        return f"{self.reference.text} {self.place[:1].upper()}{self.place[1:]}." if self.place else self.reference.text

    @property
    def bibtex(self) -> str:
        """The entry of BibTeX, with the place as its note."""
        return self.reference.bibtex(self.place[:1].upper() + self.place[1:])

    def as_dict(self) -> dict[str, str]:
        """Return all forms of it by name."""
        return {"key": self.reference.key, "short": self.short, "text": self.text, "bibtex": self.bibtex}


REFERENCES = {each.key: each for each in read_as(Reference, Path(__file__).with_name("references.yaml"), "key")}
"""The sources of the project's own experiments, by key."""


def cite(key: str, place: str = "") -> Citation:
    """Return a citation of one of `REFERENCES`.

    Args:
        key: Key of the reference.
        place: Chapter or section with its title; all of it if empty.

    Raises:
        ValueError: The reference is unknown.
    """
    if key not in REFERENCES:
        raise ValueError(f"unknown reference {key!r}; references.yaml has {', '.join(REFERENCES)}")
    return Citation(REFERENCES[key], place)
