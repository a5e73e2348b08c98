"""Tracks as a source: in each frame the positions of a body's points and the variances of their noise, and no picture.

- `table`: tables of tracks;
- `sequence`: a table as a sequence of pictures of dots, and as a source.
"""
