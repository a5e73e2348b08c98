"""Exercises: filters that a student writes into one file, checked property by property while they are written.

An exercise is a Markdown file like a lecturer's lesson: a head with the checks and their points, a text, and the first
file as its last block of code. A solution is a file for `pftrack.experiments.own`, so it can also be watched at work.
Solutions are not kept here.

- `library`: the content of an exercise's file, and all exercises;
- `submission`: an exercise, a file that answers it with the arguments of its functions, and a verdict on it;
- `properties`: requirements on a file, each a function that returns a verdict with numbers and a seed;
- `grading`: all checks on one file, or on a folder of files, each in a confined process, and reports for graders.
"""

from pftrack.teaching.exercises.grading import Report, check, check_text, grade
from pftrack.teaching.exercises.library import Exercises, exercise_named_in, read_exercises
from pftrack.teaching.exercises.submission import Check, Exercise, Verdict

__all__ = [
    "Check",
    "Exercise",
    "Exercises",
    "Report",
    "Verdict",
    "check",
    "check_text",
    "exercise_named_in",
    "grade",
    "read_exercises",
]
