"""Recordings of beliefs: results of other loops and other trackers, frame by frame, as a source.

- `content`: the file and its content, by frame and target; `recorder`: writes one while a loop runs, with adapters for
  filters of other libraries;
- `sequence`: a file with its clip as a recording.
"""

__all__: list[str] = []
