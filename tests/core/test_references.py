"""References: whole, and the same on every page that names them."""

from pathlib import Path

import pytest

from pftrack.core.model.glossary import REFERENCES, Reference, cite
from pftrack.core.texts import read_as
from pftrack.experiments import EXPERIMENTS

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "references.md"


def test_a_dissertation_and_an_article_as_text() -> None:
    """Plain text has authors, title, where it was published, year and the place that is cited."""
    assert cite("bando2007").short == "Bando 2007"
    assert cite("bando2007", "chapter 3: switching").text == (
        "Takashi Bando: Adaptive Sampling Method for Real-time State Estimation in the Real World. Doctoral "
        "dissertation, Graduate School of Information Science, Nara Institute of Science and Technology, "
        "NAIST-IS-DD0461030, 2007. Chapter 3: switching."
    )
    assert Reference("a", "article", ("A B", "C D"), "T", 1988).short == "B and D 1988"


def test_bibtex_is_one_entry() -> None:
    """The entry has its type, key, the place as its note, and a title whose capitals are kept."""
    text = cite("bando2007", "chapter 2").bibtex
    assert text.startswith("@phdthesis{bando2007,\n  author = {Takashi Bando},\n  title = {{Adaptive")


def test_what_is_wrong_with_a_reference_is_named(tmp_path: Path) -> None:
    """A field that is missing or unknown is named with file and line, and an unknown key with those that are known."""
    path = tmp_path / "references.yaml"
    wrong = {
        "a: {kind: misc, authors: [A B], titel: T, year: 1988}": "has an unknown field 'titel'",
        "a: {kind: misc, authors: [A B], year: 1988}": "lacks 'title'",
        "a: text": "must map fields to values, got str",
    }
    for text, problem in wrong.items():
        path.write_text(f"\n{text}\n", encoding="utf-8")
        with pytest.raises(ValueError, match=rf"references.yaml, line 2: a {problem}"):
            read_as(Reference, path, "key")
    with pytest.raises(ValueError, match=r"unknown reference 'bando2008'; references.yaml has bando2007, bando2006"):
        cite("bando2008")


def test_the_page_has_every_reference_and_every_experiment() -> None:
    """The documentation has the text of each reference, and where each experiment comes from."""
    page = PAGE.read_text(encoding="utf-8")
    for reference in REFERENCES.values():
        assert f"| `{reference.key}` | {reference.text} |" in page
    for name in EXPERIMENTS.own:
        shown = "; ".join(citation.short for citation in EXPERIMENTS[name].texts.references)
        assert f"| `{name}` | {shown} |" in page
