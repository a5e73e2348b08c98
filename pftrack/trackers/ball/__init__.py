"""Trackers of a ball by its colour (document 1, ch. 3).

- `step`: the trackers by name; `loop`: the compiled loop over frames that most of them share;
- `motion`: the dynamics, learned or given; `parameters`: all that can be set.
"""

__all__: list[str] = []
