"""The glossary: one meaning for each word, and none missing for what pages say of a frame."""

import re
from pathlib import Path
from typing import Any

import pytest

from pftrack.core.model.glossary import GLOSSARY, Section, Term, read_glossary
from pftrack.experiments import EXPERIMENTS

SHARED = [term for section in GLOSSARY for term in section.terms]


def forms(*sections: Section) -> list[str]:
    """All forms in which the words of sections are written."""
    return [form.lower() for section in sections for term in section.terms for form in (term.name, *term.also)]


def test_a_word_has_one_meaning() -> None:
    """No form is that of two words, among those that all share and among those of an experiment."""
    for sections in (GLOSSARY, *([each.glossary] for each in EXPERIMENTS.values())):
        found = forms(*sections)
        assert sorted(found) == sorted(set(found))


def test_a_meaning_is_one_sentence_without_its_end() -> None:
    """So it can stand in a table, and after the word."""
    own = [term for each in EXPERIMENTS.values() for term in each.glossary.terms]
    assert [term.name for term in [*SHARED, *own] if not term.meaning or term.meaning.endswith(".")] == []


@pytest.mark.parametrize("name", EXPERIMENTS.own)
def test_every_reading_is_explained(name: str) -> None:
    """A line of figures has no sentence of its own, as a plot and a measure have: the glossary has a word of it."""
    experiment = EXPERIMENTS[name]
    known = forms(*GLOSSARY, experiment.glossary)
    unknown = [
        reading.title
        for reading in experiment.display.readings
        if not any(re.search(rf"(?<![\w-]){re.escape(form)}(?![\w-])", reading.title.lower()) for form in known)
    ]
    assert unknown == []


@pytest.mark.parametrize("blank", [{"name": " "}, {"meaning": ""}, {"also": ("",)}])
def test_no_term_is_blank(blank: dict[str, Any]) -> None:
    """A form without a letter would be found between all letters of a page."""
    with pytest.raises(ValueError, match="a term needs a name, a meaning and no blank form"):
        Term(**{"name": "ESS", "meaning": "effective sample size", **blank})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("A:\n  word: it\nB:\n  other: {also: [others]}\n", "line 3: B must map words to a meaning"),
        ("A: word\n", "line 1: A must map words to a meaning"),
        ("- word\n", "must map names to what they declare, got list"),
        ("A: [\n", "is not YAML"),
    ],
)
def test_a_glossary_that_cannot_be_read_is_refused(tmp_path: Path, text: str, message: str) -> None:
    """The sentence names the file, and the line of the section."""
    path = tmp_path / "glossary.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        read_glossary(path)
