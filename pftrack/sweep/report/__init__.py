"""Reports: the result of a sweep for people. Tables, figures as PNG or SVG, and one self-contained page.

`study` selects the content and computes its numbers; `files` draws them, and writes both, with the page.
"""
