"""Exercises: filters that a student writes into one file, checked property by property while they are written.

An exercise is a Markdown file as a lecturer's lesson is: a head that says what is checked and for how many points, a
text, and the file to begin with as its last block of code. A solution is a file as `pftrack.experiments.own` takes
them, so that it can be watched at work as well. Solutions are not kept here.

- `library`: what stands in the file of an exercise, and all exercises that there are;
- `submission`: an exercise, a file that answers it with all that its functions are called with, and a verdict on it;
- `properties`: what a file should do, each a function that returns a verdict with numbers and a seed;
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
