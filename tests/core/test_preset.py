"""Presets, references and the glossary are read from YAML, and mistakes are named with file and line."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pftrack.core.model.glossary import GLOSSARY, REFERENCES, Reference, Section, Term, cite, read_glossary
from pftrack.core.model.preset import Preset, Tour, read_failures, read_presets
from pftrack.core.texts import read_as
from pftrack.experiments import EXPERIMENTS, find

TEXT = """
first:
  title: works
  tracker: h-spf
  parameters: {sample_count: 40}
  about: [gamma_px]
second:
  title: breaks
  tracker: apf
  seed: 3
  tour: {begin: See., reason: Because., plot: ess, frame: 16}
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "presets.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_presets_are_read_in_their_order(tmp_path: Path) -> None:
    """Lists become tuples, what is left out has its default, and each preset knows its line."""
    first, second = read_presets(written(tmp_path, TEXT))
    assert first == Preset("first", "works", "h-spf", {"sample_count": 40}, about=("gamma_px",))
    assert second == Preset("second", "breaks", "apf", seed=3, tour=Tour("See.", "Because.", "ess", 16))
    assert second.origin.endswith("presets.yaml, line 7")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "title: works",
            "titel: works",
            r"presets.yaml, line 3: first has an unknown field 'titel'",
        ),
        ("  tracker: apf\n", "", r"presets.yaml, line 7: second lacks 'tracker'"),
        ("[gamma_px]", "[gamma_px", r"presets.yaml is not YAML"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    """A mistake of a person who mends a sentence is a sentence, not a traceback."""
    assert old in TEXT
    with pytest.raises(ValueError, match=message):
        read_presets(written(tmp_path, TEXT.replace(old, new)))


FAILURE = """
a: {title: A, kind: weights, diagnosis: D., tracker: apf, frame: 3, cause: unclear, cure: {text: It., values: {n: 1}},
    timeline: [{frame: 3, values: {}}]}
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (", values: {n: 1}", "", "line 2: a.cure lacks 'values'"),
        ("{frame: 3, v", "{frame: 3, frames: 3, v", "line 3: a.timeline has an unknown field '0.frames'"),
    ],
)
def test_what_is_wrong_with_a_failure_is_named_with_its_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    """Failures are read in the same way, with their cures and changes; a value of the wrong kind is refused, too."""
    assert read_failures(written(tmp_path, FAILURE))[0].cure.values == {"n": 1}
    with pytest.raises(ValueError, match=message):
        read_failures(written(tmp_path, FAILURE.replace(old, new)))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"tracker": "apx"}, "unknown tracker 'apx'"),
        ({"parameters": {"gamma": 1}}, "unknown parameter 'gamma'"),
        ({"about": ("gamma",)}, "unknown parameter 'gamma'"),
        ({"tour": Tour("", "", "esss", 3)}, "unknown plot 'esss'"),
    ],
)
def test_a_preset_names_what_the_experiment_has(changed: dict[str, object], message: str) -> None:
    """An experiment refuses a preset of a tracker, parameter or plot that it lacks, and names the file and line."""
    ball = find("ball")
    wrong = replace(ball.presets[0], **changed)
    with pytest.raises(ValueError, match=rf"ball/presets.yaml, line 1: works names an {message}"):
        replace(ball, presets=(wrong, *ball.presets[1:])).check_starts()


# References: whole, and the same on every page that names them.

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


# The glossary: one meaning for each word, and none missing for what pages say of a frame.

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
