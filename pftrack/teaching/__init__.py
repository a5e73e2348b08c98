"""Lessons, the course, lecturers' own files, exercises and their grading."""
