"""The glossary and the references: one meaning for each word, and where methods and studies come from, as data.

Words that all experiments share stand in `glossary.yaml` beside this file, and an experiment declares those of its own
(`Experiment.terms`). The page of the glossary, what pages say of a word that is pointed at, and the documentation are
made of these declarations. An experiment names what it comes from as citations, each a reference and a place in it. The
references that the project's own experiments share stand here; an experiment of another package brings its own.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pftrack.core.texts import read_texts


@dataclass(frozen=True, slots=True)
class Term:
    """A word and what it means.

    Attributes:
        name: The word as it stands in a sentence.
        meaning: What it means, a sentence without its full stop, for somebody who hears it for the first time.
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
        title: What they are about.
        terms: In the order in which they are best read.
    """

    title: str
    terms: tuple[Term, ...]


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
"""What all experiments share, by what it is about."""


@dataclass(frozen=True, slots=True)
class Reference:
    """A publication.

    Attributes:
        key: Its name in BibTeX.
        kind: Its type in BibTeX.
        authors: Full names, family name last.
        title: As printed.
        year: In which it appeared.
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
        return f"{_join_names(self.authors)}: {self.title}. {self._publication}, {self.year}."

    def bibtex(self, note: str = "") -> str:
        """Return the entry of BibTeX.

        Args:
            note: What is cited of it, if that is not all.
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


def _join_names(names: tuple[str, ...]) -> str:
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


BANDO = Reference(
    "bando2007",
    "phdthesis",
    ("Takashi Bando",),
    "Adaptive Sampling Method for Real-time State Estimation in the Real World",
    2007,
    {
        "type": "Doctoral dissertation",
        "school": "Graduate School of Information Science, Nara Institute of Science and Technology",
        "number": "NAIST-IS-DD0461030",
    },
)
"""In Japanese with an English abstract."""

BANDO_2006 = Reference(
    "bando2006",
    "article",
    ("Takashi Bando", "Tomohiro Shibata", "Kenji Doya", "Shin Ishii"),
    "Switching particle filters for efficient visual tracking",
    2006,
    {"journal": "Robotics and Autonomous Systems", "volume": "54", "number": "10", "pages": "873--884"},
)

KAGAMI = Reference(
    "kagami2012",
    "misc",
    ("Shingo Kagami",),
    "Image tracking (3): Bayesian estimation and particle filters",
    2012,
    {"howpublished": "Lecture slides, Tohoku University"},
)
"""In Japanese."""

PEREZ = Reference(
    "perez2002",
    "inproceedings",
    ("Patrick Pérez", "Carine Hue", "Jaco Vermaak", "Michel Gangnet"),
    "Color-based probabilistic tracking",
    2002,
    {"booktitle": "European Conference on Computer Vision", "pages": "661--675"},
)

TOMASI = Reference(
    "tomasi1992",
    "article",
    ("Carlo Tomasi", "Takeo Kanade"),
    "Shape and motion from image streams under orthography: a factorization method",
    1992,
    {"journal": "International Journal of Computer Vision", "volume": "9", "number": "2", "pages": "137--154"},
)

BERNARDIN = Reference(
    "bernardin2008",
    "article",
    ("Keni Bernardin", "Rainer Stiefelhagen"),
    "Evaluating multiple object tracking performance: the CLEAR MOT metrics",
    2008,
    {"journal": "EURASIP Journal on Image and Video Processing", "volume": "2008", "pages": "246309"},
)

ICHIMURA = Reference(
    "ichimura2000",
    "techreport",
    ("Naoyuki Ichimura", "Norikazu Ikoma"),
    "Filtering of time series of feature point coordinates using non-Gaussian state space model",
    2000,
    {
        "type": "Technical report in Japanese",
        "institution": "Electrotechnical Laboratory and Kyushu Institute of Technology",
    },
)
"""It bears no year: it cites work of 1999, and the laboratory went by another name from 2001 on."""

KITAGAWA = Reference(
    "kitagawa1996",
    "article",
    ("Genshiro Kitagawa",),
    "Monte Carlo filter and smoother for non-Gaussian nonlinear state space models",
    1996,
    {"journal": "Journal of Computational and Graphical Statistics", "volume": "5", "number": "1", "pages": "1--25"},
)

MITSUGAMI = Reference(
    "mitsugami2009",
    "misc",
    ("Ikuhisa Mitsugami", "Koh Kakusho", "Michihiko Minoh"),
    "Efficient particle filtering for a non-rigid object based on PCA about changes of its shape and motion",
    2009,
    {"howpublished": "Journal paper in Japanese"},
)
"""In Japanese with an English abstract."""

SHIMADA = Reference(
    "shimada1997",
    "phdthesis",
    ("Nobutaka Shimada",),
    "Estimating the three-dimensional shape and pose of articulated objects from monocular image sequences",
    1997,
    {"type": "Doctoral dissertation in Japanese", "school": "Osaka University"},
)
"""In Japanese."""
