"""The library of lessons: those of the course, and those that lecturers have added."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pftrack.lessons import LESSONS, Lesson, find

__all__ = ["Library", "Problem", "lesson_of", "read"]


@dataclass(frozen=True, slots=True)
class Problem:
    """What is wrong with a lecturer's file.

    Attributes:
        origin: The file or package.
        line: Where in it; None where it is no line's fault.
        message: What is wrong and what to do, one sentence.
    """

    origin: str
    line: int | None
    message: str


@dataclass(frozen=True, slots=True)
class Library:
    """All lessons that there are.

    Attributes:
        lessons: By id, those of the course first and in its order.
        problems: Of files that could not be read.
    """

    lessons: Mapping[str, Lesson]
    problems: tuple[Problem, ...] = ()


def read(folder: Path) -> Library:
    """Read all lessons.

    Args:
        folder: Where lecturers' files are.
    """
    del folder
    return Library(LESSONS)


def lesson_of(folder: Path, wanted: str) -> Lesson:
    """Return a lesson by its id or number.

    Raises:
        LookupError: There is none; the sentence lists those that there are.
    """
    return find(wanted, read(folder).lessons)
