"""Runs: sources folded through trackers, watched or by the thousand, judged and kept.

- `run`: one run, which can seek, rewind and branch; `keyframes`: the states that it keeps for that;
- `recursion`: how each state comes out of the one before;
- `diagnostics`: the numbers of one frame; `scoring`: what they amount to over a run;
- `coverage` and `consistency`: whether a tracker is as sure as it may be;
- `batch`: many runs of one condition at once, to the same numbers;
- `record`: a run as a file.
"""

__all__: list[str] = []
