"""Runs: sources folded through trackers, watched or by the thousand, judged and kept.

- `recursion`: how each state comes out of the one before, and the states that a run keeps;
- `loss`: in which frames the target is lost, and who says so; `scoring`: what a run's numbers amount to;
  `loss_probability`: how probable it is that the target is lost; `coverage`: whether a tracker is as sure as it may be;
- `table`, `record`, `checkpoint`, `manifest`: a run as files; `reproduction`: a run from a file or
  a recipe, and whether it has the saved numbers again;
- `run`: one run, which can seek, rewind and branch; `many`: many runs at once, to the same numbers;
- `comparison`: runs beside each other; `inspection`: a look into one frame of a run.
"""

__all__: list[str] = []
