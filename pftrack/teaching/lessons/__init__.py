"""Lessons: twelve steps from probability to a tracker of colours, and those that lecturers add.

Each lesson of the course is a Markdown file in `course`, a module beside it that computes, and a name in `LESSONS`; it
is read when it is asked for. A lecturer's lesson is such a file in a data directory or in a package. Every lesson asks
for a prediction, shows the result and the error of the prediction, and checks itself against exact values.
"""

from collections.abc import Iterable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Final

from pftrack.core.refusal import ParameterError
from pftrack.teaching.lessons.figure import Figure, Number, Shown
from pftrack.teaching.lessons.lesson import (
    Check,
    Demonstration,
    Lesson,
    Outcome,
    Question,
    Scenario,
    Verdict,
    judge,
)

__all__ = [
    "LESSONS",
    "Check",
    "Demonstration",
    "Figure",
    "Lesson",
    "Number",
    "Outcome",
    "Question",
    "Scenario",
    "Shown",
    "Verdict",
    "find",
    "judge",
]


class Course(Mapping[str, Lesson]):
    """Lessons by id, in order.

    The texts of `monte-carlo` stand in the package's `monte-carlo.md`, and what is computed for it is `COMPUTED` of the
    module `monte_carlo`.

    Attributes:
        package: Package of these files.
        made: The lessons that were asked for.
    """

    def __init__(self, package: str, ids: Iterable[str]) -> None:
        """List lessons without importing any.

        Args:
            package: Package of their modules.
            ids: Ids of the lessons, in the order of the course.
        """
        self.package = package
        self._ids = tuple(ids)
        self.made: dict[str, Lesson] = {}

    def __getitem__(self, lesson_id: str) -> Lesson:
        if lesson_id not in self._ids:
            raise KeyError(lesson_id)
        if lesson_id not in self.made:
            from pftrack.teaching.lessons.library import course_lesson  # noqa: PLC0415 - it lists the course

            module = import_module(f"{self.package}.{lesson_id.replace('-', '_')}")
            path = Path(str(module.__file__)).with_name(f"{lesson_id}.md")
            self.made[lesson_id] = course_lesson(path, module.COMPUTED, self._ids.index(lesson_id) + 1)
        return self.made[lesson_id]

    def __iter__(self) -> Iterator[str]:
        return iter(self._ids)

    def __len__(self) -> int:
        return len(self._ids)


LESSONS: Final = Course(
    "pftrack.teaching.lessons.course",
    (
        "probability",
        "joint",
        "bayes",
        "estimate",
        "recursion",
        "kalman",
        "monte-carlo",
        "importance",
        "sir",
        "resampling",
        "outliers",
        "colour",
    ),
)
"""The lessons of the course, by id."""


def find(wanted: str, lessons: Mapping[str, Lesson] = LESSONS) -> Lesson:
    """Return a lesson by its id, or by its number in the course.

    Args:
        wanted: The id, or the number as text.
        lessons: Lessons to search; those of lecturers may be added.

    Raises:
        ParameterError: The lesson is unknown; the sentence lists all of them.
    """
    if wanted in lessons:
        return lessons[wanted]
    numbered = {lesson.number: lesson for lesson in lessons.values() if lesson.number}
    if wanted.isdecimal() and int(wanted) in numbered:
        return numbered[int(wanted)]
    known = [f"{lesson.number} {name}" if lesson.number else name for name, lesson in lessons.items()]
    raise ParameterError("lesson", wanted, f"one of {', '.join(known)}")
