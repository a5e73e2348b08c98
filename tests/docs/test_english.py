"""Strings, docstrings, comments and pages keep the rules of English: no turn translated word by word."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HELD = ("server", "frontend_static", "tools", "benchmarks", "examples", "docs", "pftrack", "tests")
VENDORED = "vendor"
"""Name of folders with others' work."""

SUFFIXES = frozenset({".css", ".html", ".js", ".md", ".py", ".ts", ".yaml"})
REFUSED = {
    r"\bis no [a-z]": "is not a",
    r"\bof which\b": "a new sentence, or the noun",
    r"\b[Ww]hoever\b": "a person or program that",
    r"\bthat (?:is|are) told\b": "reported, shown or known",
    r"\bcomes to\b": "equals, gives or reaches",
    r'\b(?:description|help)=f?"(?:Of|What|Where to) ': "a text that begins with a noun",
    r'(?:^|\n) *(?:\w+: |""")Of ': "a docstring that begins with a noun",
}
"""Patterns, and what to write instead; a line break within a sentence counts as a space."""

ALLOWED = {
    "there is no": "it states that something does not exist",
    "is no longer": "it states an end",
    "is no more": "it states a limit",
    "is no further": "it states a limit",
    "each of which": "an ordinary relative clause on the members of a set",
}
"""Phrases that the patterns would find, and the reason why they are right."""

BREAK = re.compile(r"[ \t]*\n[ \t]*(?:#|//|\*(?!/))?[ \t]*(?=[a-z])")


def found(text: str) -> list[str]:
    """Return the refused passages of a text, each with what to write instead."""
    plain = re.sub("|".join(ALLOWED), "", BREAK.sub(" ", text), flags=re.IGNORECASE)
    return [
        f"{plain[max(0, hit.start() - 40) : hit.end() + 40]!r}: write {better}"
        for pattern, better in REFUSED.items()
        for hit in re.finditer(pattern, f"{text}\n" if pattern.startswith("(?:^") else plain)
    ]


@pytest.mark.parametrize("folder", HELD)
def test_no_refused_turn_stands_in(folder: str) -> None:
    """Every file that a person reads or edits is searched; vendored ones are others' work."""
    paths = sorted(
        path
        for path in (ROOT / folder).rglob("*")
        if path.suffix in SUFFIXES and VENDORED not in path.parts and path != Path(__file__)
    )
    assert paths
    assert [f"{path.relative_to(ROOT)}: {hit}" for path in paths for hit in found(path.read_text("utf-8"))] == []


def test_refused_turns_are_found() -> None:
    """Also across the lines of a comment, and at the beginning of a description; the allowed phrases pass."""
    wrong = [
        "# The text is no\n    # number.",
        "colours, two of\n * which are dark",
        "Whoever asks first",
        "all that is told of it",
        "The sum comes to 1.",
        'Field(description="Of the run")',
        'help="Where to write it."',
        '    """Of one frame."""',
        "        width: Of the picture.",
    ]
    right = ["There is no\nroom.", "It is no longer here.", "Two ends, each of which moves."]
    assert [len(found(sentence)) for sentence in (*wrong, *right)] == [1] * len(wrong) + [0] * len(right)
