"""Lessons: twelve steps from probability to a tracker of colours, and those that lecturers add.

Each lesson of the course is a module of `course` and a name in its registry, found when it is asked for. A lecturer's
lesson is a Markdown file, in a data directory or in a package. Every lesson asks for a prediction, shows, says how far
off it was, and checks itself against what is exact.
"""

from pftrack.teaching.lessons.figure import Figure
from pftrack.teaching.lessons.lesson import (
    Check,
    Demonstration,
    Lesson,
    Number,
    Outcome,
    Question,
    Scenario,
    Shown,
    Verdict,
    judge,
)
from pftrack.teaching.lessons.registry import LESSONS, find

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
