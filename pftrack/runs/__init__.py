"""Runs: sources folded through trackers, watched or by the thousand, judged and kept.

- `run`: one run, which can seek, rewind and branch; `recursion`: how each state comes out of the one before, and the
  states that a run keeps;
- `scoring`: what the numbers of its frames amount to; `loss_probability`: how probable it is that the target is lost;
- `coverage`: whether a tracker is as sure as it may be;
- `batch`: many runs of one condition at once, to the same numbers; `continuation`: one run with other seeds;
- `comparison`: runs beside each other; `inspection`: a look into one frame of a run;
- `record`, `checkpoint`, `manifest`, `table`: a run as files; `reproduction`: whether it has the saved numbers
  again.
"""

__all__: list[str] = []
