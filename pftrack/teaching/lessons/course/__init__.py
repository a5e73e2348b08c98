"""The course: a module for each lesson, from probability to a tracker of colours.

Each module has a `LESSON`, and is imported by the registry when its lesson is asked for.
"""
