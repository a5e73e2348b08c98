"""Presets, references and the glossary are read from YAML, and mistakes are named with file and line."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from pftrack.core.model.glossary import GLOSSARY, REFERENCES, Reference, Section, cite, read_glossary
from pftrack.core.model.preset import Preset, Tour, read_failures, read_presets
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


FAILURE = """
a: {title: A, kind: weights, diagnosis: D., tracker: apf, frame: 3, cause: unclear, cure: {text: It., values: {n: 1}},
    timeline: [{frame: 3, values: {}}]}
"""


@pytest.mark.parametrize(
    ("read", "text", "old", "new", "message"),
    [
        (read_presets, TEXT, "title: works", "titel: works", "line 3: first has an unknown field 'titel'"),
        (read_presets, TEXT, "  tracker: apf\n", "", "line 7: second lacks 'tracker'"),
        (read_failures, FAILURE, ", values: {n: 1}", "", "line 2: a.cure lacks 'values'"),
        (read_failures, FAILURE, FAILURE, "\na: text", "line 2: a must map fields to values, got str"),
        (read_failures, FAILURE, "3, v", "3, frames: 3, v", "line 3: a.timeline has an unknown field '0.frames'"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(
    tmp_path: Path, read: Callable[[Path], object], text: str, old: str, new: str, message: str
) -> None:
    """A mistake in a preset, or in a failure with its cure and changes, is a sentence, not a traceback."""
    read(written(tmp_path, text))
    with pytest.raises(ValueError, match=f"presets.yaml, {message}"):
        read(written(tmp_path, text.replace(old, new)))
    with pytest.raises(ValueError, match=r"presets.yaml is not YAML"):
        read(written(tmp_path, f"{text}\nb: ["))
    assert read_failures(written(tmp_path, FAILURE))[0].cure.values == {"n": 1}


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


def test_references_are_cited_as_text_and_bibtex() -> None:
    """Text has authors, title, publisher, year and place; the entry has type, key and a title that keeps capitals."""
    assert cite("bando2007").short == "Bando 2007"
    assert cite("bando2007", "chapter 3: switching").text == (
        "Takashi Bando: Adaptive Sampling Method for Real-time State Estimation in the Real World. Doctoral "
        "dissertation, Graduate School of Information Science, Nara Institute of Science and Technology, "
        "NAIST-IS-DD0461030, 2007. Chapter 3: switching."
    )
    assert Reference("a", "article", ("A B", "C D"), "T", 1988).short == "B and D 1988"
    text = cite("bando2007", "chapter 2").bibtex
    assert text.startswith("@phdthesis{bando2007,\n  author = {Takashi Bando},\n  title = {{Adaptive")
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


def forms(*sections: Section) -> list[str]:
    """All forms in which the words of sections are written."""
    return [form.lower() for section in sections for term in section.terms for form in (term.name, *term.also)]


def test_a_word_has_one_meaning_without_a_full_stop() -> None:
    """No form is that of two words, among those that all share and of an experiment; a meaning fits into a table."""
    own = [[each.glossary] for each in EXPERIMENTS.values()]
    for sections in (GLOSSARY, *own):
        assert sorted(forms(*sections)) == sorted(set(forms(*sections)))
    every = [term for sections in (GLOSSARY, *own) for section in sections for term in section.terms]
    assert [term.name for term in every if not term.meaning or term.meaning.endswith(".")] == []


@pytest.mark.parametrize("name", EXPERIMENTS.own)
def test_every_reading_is_explained(name: str) -> None:
    """A line of figures has no sentence of its own, as a plot and a measure have: the glossary has a word of it."""
    known = forms(*GLOSSARY, EXPERIMENTS[name].glossary)
    word = re.compile(rf"(?<![\w-])({'|'.join(map(re.escape, known))})(?![\w-])")
    titles = [reading.title for reading in EXPERIMENTS[name].display.readings]
    assert [title for title in titles if not word.search(title.lower())] == []


def test_a_glossary_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    """The sentence names the file, and the line of the section."""
    for text, message in (
        ("A:\n  word: it\nB:\n  other: {also: [others]}\n", "line 3: B must map words to a meaning"),
        ("- word\n", "must map names to what they declare, got list"),
    ):
        with pytest.raises(ValueError, match=message):
            read_glossary(written(tmp_path, text))
