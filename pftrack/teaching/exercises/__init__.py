"""Exercises: filters that a student writes into one file, checked property by property while they are written.

An exercise is a Markdown file as a lecturer's lesson is: a head that says what is checked and for how many points, a
text, and the file to begin with as its last block of code. A solution is a file as `filter_files` takes them, so that
it can be watched at work as well. There are no solutions here.

- `exercise`, `head` and `library`: what an exercise is, and all that there are;
- `submission`: a file that answers one, with all that its functions are called with;
- `properties`: what a file should do, each a function that returns a verdict with numbers and the seed that shows it;
- `checking`: all checks of an exercise on one file; `grading`: on a folder of files, each in a confined process;
- `reports`: what came of it, as graders of courses take it.
"""

from pftrack.teaching.exercises.grading import Report, check, check_text, grade
from pftrack.teaching.exercises.library import Exercises, exercise_named_in, read_exercises
from pftrack.teaching.exercises.submission import Check, Exercise
from pftrack.teaching.exercises.verdict import Verdict

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
