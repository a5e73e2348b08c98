"""What everything is declared with: parameters, series, marks, drawings, recipes; arithmetic, cameras and whole files.

- `model`: the declarations;
- `numerics`: arithmetic whose bits are the same on every processor;
- `geometry`: rotations and cameras;
- `files`, `entry_points`, `once`, `picture_key`, `spreadsheet`, `version`: small tools that every package uses.
"""
