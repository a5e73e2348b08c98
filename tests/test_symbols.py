"""Symbols in what people read: set as formulas, or said in words, never as they stand in a program."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass

from pftrack.core.model.glossary import GLOSSARY
from pftrack.experiments import EXPERIMENTS
from pftrack.teaching.lessons import LESSONS

FORMULA_OR_CODE = re.compile(r"\$+[^$]+\$+|`[^`]+`")
SUBSCRIPT = re.compile(r"(?<![^\W\d_])[^\W\d_]_[{\w]")


def texts(told: object, seen: set[int]) -> Iterator[str]:
    """Go through all that is declared, down to its sentences; what is one word is a name of the program."""
    if isinstance(told, str):
        if " " in told:
            yield told
    elif id(told) not in seen:
        seen.add(id(told))
        parts: list[object] = []
        if isinstance(told, Mapping):
            parts = list(told.values())
        elif isinstance(told, list | tuple):
            parts = list(told)
        elif is_dataclass(told) and not isinstance(told, type):
            parts = [getattr(told, field.name) for field in fields(told)]
        for part in parts:
            yield from texts(part, seen)


def test_a_symbol_with_a_subscript_is_a_formula() -> None:
    """The z_t of a program stands in no sentence of a lesson, an experiment with its failures, or the glossary."""
    declared = [GLOSSARY, *(EXPERIMENTS[name] for name in EXPERIMENTS.own), *LESSONS.values()]
    sentences = list(texts(declared, set()))
    assert len(sentences) > 1000
    assert [each for each in sentences if SUBSCRIPT.search(FORMULA_OR_CODE.sub("", each))] == []
