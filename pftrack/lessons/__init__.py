"""Lessons: twelve steps from probability to a tracker of colours, and those that lecturers add.

Each lesson is a module here and a line of the list below, found when it is asked for. A lecturer's lesson is a
Markdown file, in a data directory or in a package. Every lesson asks for a prediction, shows, says how far off it was,
and checks itself against what is exact.
"""

from pftrack.lessons.figure import Figure
from pftrack.lessons.judging import Verdict, judge
from pftrack.lessons.lesson import Check, Demonstration, Lesson, Number, Outcome, Question, Scenario, Shown

__all__ = [
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
    "judge",
]
