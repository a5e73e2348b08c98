"""What everything is declared with: parameters, series, marks, drawings, recipes; arithmetic, cameras and whole files.

- `model`: the declarations;
- `numerics`: arithmetic whose bits are the same on every processor, and cameras;
- `geometry`: rotations and polygons;
- `arrays`: names of the types of arrays, and checks of their shapes; `files`: files that appear whole; `texts`: texts
  in YAML with their lines; `entry_points`: what other packages provide; `version`.
"""
