"""Lecturers' lessons: a Markdown file each, with a head that says what is run, asked and right.

A lecturer writes no Python. A file comes from a folder or a package, may come from anybody, and is trusted in nothing:

- `document`: a file as values with their lines, what may stand in its head, and findings of what is wrong;
- `library`: whether a document fits an experiment or a figure, the lesson that it makes, and all files of the project,
  of packages and of folders, in `read_lessons`.
"""

from pftrack.teaching.lessons.lecturers.document import Problem
from pftrack.teaching.lessons.lecturers.library import Library, read_lesson, read_lessons

__all__ = ["Library", "Problem", "read_lesson", "read_lessons"]
