"""The library of lessons: those of the course, of packages, and of the lecturers' files in a folder."""

from pathlib import Path

from pftrack.lessons import LESSONS, Lesson, find
from pftrack.lessons.lecturers import read_lessons

__all__ = ["lesson_of"]


def lesson_of(folder: Path, wanted: str) -> Lesson:
    """Return a lesson by its id or number; no file is read for one of the course.

    Args:
        folder: Where lecturers' files are.
        wanted: The id or number.

    Raises:
        LookupError: There is none; the sentence lists those that there are.
    """
    if wanted in LESSONS or wanted.isdecimal():
        return find(wanted)
    return find(wanted, read_lessons(folder).lessons)
