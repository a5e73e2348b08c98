"""Trackers of a ball by its colour (document 1, ch. 3).

- `step`: the trackers by name, and those that share a loop over frames; `loop`: that loop, compiled; `likelihood`: what
  it weighs particles by; `centroid`: trackers that measure the whole picture; `common`: how all of them begin;
- `motion`: the dynamics, learned or given; `parameters`: all that can be set, in parts for other families.
"""

__all__: list[str] = []
