"""Trackers of a head by templates of its features (document 1, ch. 4 section 4).

- `step`: the trackers by name; `parameters`: all that can be set
- `memory`: templates and size of the face; `templates`: how large they are cut
"""

__all__: list[str] = []
