"""Trackers of a head by templates of its features (document 1, ch. 4 section 4).

- `step`: the trackers by name; `memory`: templates and size of the face; `parameters`: all that can be set.
"""

__all__: list[str] = []
