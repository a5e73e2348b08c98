"""The library: exercises of the project and of folders, and all problems of files there."""

import ast
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from pftrack.core.model.parameters import revise
from pftrack.experiments import find as find_experiment
from pftrack.experiments.own.code import FUNCTIONS
from pftrack.teaching.exercises.properties import PROPERTIES
from pftrack.teaching.exercises.submission import Check, Exercise, ExerciseHead
from pftrack.teaching.lessons.document import (
    Document,
    DocumentError,
    Findings,
    Problem,
    ask,
    decode,
    document_of,
    near,
    read_folders,
)

SHIPPED: Final = Path(__file__).parent / "shipped"
PAGE: Final = "docs/how-to/exercises.md"
BLOCK: Final = re.compile(r"^```python\n(.*?)^```\s*\Z", re.DOTALL | re.MULTILINE)
NAMED: Final = re.compile(r"^EXERCISE\s*=\s*(['\"][^'\"\n]*['\"])", re.MULTILINE)


@dataclass(frozen=True)
class Exercises:
    """The exercises and problems.

    Attributes:
        exercises: By id.
        problems: Problems of other files.
    """

    exercises: Mapping[str, Exercise]
    problems: tuple[Problem, ...]


def read_exercises(*folders: Path) -> Exercises:
    """Read the exercises of the project, and those of folders."""
    places = [(SHIPPED, "pftrack: "), *((folder, "") for folder in folders)]
    known, problems = read_folders(places, _exercise_of)
    return Exercises(known, tuple(problems))


def exercise_named_in(text: str) -> str | None:
    """Return the id of the exercise that a file names; the file is not executed for that."""
    found = NAMED.search(text)
    return str(ast.literal_eval(found[1])) if found else None


def _exercise_of(data: bytes, origin: str) -> Exercise | list[DocumentError]:
    """Return the exercise of a file's content, or all that is wrong with it.

    Raises:
        DocumentError: It is not a text with a head.
    """
    document = document_of(decode(data))
    head = ask(document, ExerciseHead, "an exercise", PAGE)
    if isinstance(head, list):
        return head
    found = Findings(document)
    _check_scene(head, found)
    for number, name in enumerate(head.functions):
        if name not in FUNCTIONS:
            found.add(("functions", number), f"a filter's file has no function {name}; {near(name, FUNCTIONS)}")
    for number, check in enumerate(head.checks):
        _check_options(check, number, found)
    block = BLOCK.search(document.text + "\n")
    _check_skeleton(block[1] if block else "", head, document, found)
    if found.problems or block is None:
        return found.problems
    text = document.text[: block.start()].strip()
    return Exercise(**dict(head), text=text, skeleton=block[1], origin=origin)


def _check_scene(head: ExerciseHead, found: Findings) -> None:
    experiment = found.attempt(("experiment",), lambda: find_experiment(head.experiment))
    if experiment is None:
        return
    if experiment.model is None:
        found.add(("experiment",), f"{experiment.id} takes no filters from files")
    found.attempt(("values",), lambda: revise(experiment.simulate().parameters, head.values))


def _check_options(check: Check, number: int, found: Findings) -> None:
    place = ("checks", number)
    known = PROPERTIES.get(check.property)
    if known is None:
        found.add((*place, "property"), f"there is no property {check.property}; {near(check.property, PROPERTIES)}")
        return
    for name, value in check.options.items():
        if name not in known.options:
            found.add((*place, "options", name), f"{known.name} has no option {name}; {near(name, known.options)}")
        elif isinstance(known.options[name], str) != isinstance(value, str):
            kind = "a text" if isinstance(known.options[name], str) else "a number"
            found.add((*place, "options", name), f"`{name}` must be {kind}, got {value!r}")
    for name, default in known.options.items():
        if default == "" and name not in check.options:
            found.add(place, f"{known.name} needs the option {name}")


def _check_skeleton(skeleton: str, head: ExerciseHead, document: Document, found: Findings) -> None:
    if not skeleton:
        message = "the text ends with the file to begin with, between ```python and ```"
        found.problems.append(DocumentError(document.text_line, message))
    elif exercise_named_in(skeleton) != head.id:
        message = f'the file to begin with has a line EXERCISE = "{head.id}", which names its exercise'
        found.problems.append(DocumentError(document.text_line, message))
