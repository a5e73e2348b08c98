"""Reports: the result of a sweep for people. Tables, figures as PNG or SVG, and one page that needs nothing else.

`study` says what is looked at and has its numbers; `files` draws it, and writes both, with the page.
"""
