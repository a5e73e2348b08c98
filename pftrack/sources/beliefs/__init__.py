"""Recordings of beliefs: what other loops and other trackers have computed, frame by frame, as a source.

- `content`: the file, and all that it says, at hand by frame and target; `recorder`: what writes one while a loop runs,
  and adapters for filters of other libraries;
- `sequence`: a file with its clip as a recording.
"""

__all__: list[str] = []
