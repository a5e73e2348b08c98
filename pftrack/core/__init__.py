"""Foundations: declarations (parameters, series, marks, drawings, recipes), arithmetic, cameras and files.

- `model`: the declarations;
- `numerics`: arithmetic whose bits are the same on every processor, and cameras;
- `geometry`: rotations and polygons;
- `arrays`: names of the types of arrays, and checks of their shapes; `files`: files that are written completely or not
at all; `texts`: texts in YAML with their lines; `entry_points`: extensions by other packages; `version`.
"""
