"""Symbols in what people read: set as formulas, or said in words, never as they stand in a program."""

import re

from pftrack.core.model.glossary import GLOSSARY
from pftrack.experiments import EXPERIMENTS
from pftrack.teaching.lessons import LESSONS

LITERAL = re.compile(r"""'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*\"""")
FORMULA_OR_CODE = re.compile(r"\$+[^$]+\$+|`[^`]+`")
SUBSCRIPT = re.compile(r"(?<![^\W\d_])[^\W\d_]_[{\w]")


def test_a_symbol_with_a_subscript_is_a_formula() -> None:
    """The z_t of a program stands in no sentence of a lesson, an experiment with its failures, or the glossary.

    A text of one word is a name of the program.
    """
    declared = repr([GLOSSARY, *(EXPERIMENTS[name] for name in EXPERIMENTS.own), *LESSONS.values()])
    sentences = {text for text in LITERAL.findall(declared) if " " in text}
    assert len(sentences) > 1000
    assert [each for each in sentences if SUBSCRIPT.search(FORMULA_OR_CODE.sub("", each))] == []
