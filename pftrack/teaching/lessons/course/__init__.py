"""The course, from probability to a tracker of colours: each lesson is a file with texts and a module that computes.

Each module has `COMPUTED`, and is imported by the registry when its lesson is asked for.
"""
