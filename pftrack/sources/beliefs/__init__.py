"""Recordings of beliefs: what other loops and other trackers have computed, frame by frame, as a source.

- `archive`: the file, entry by entry; `recorder`: what writes one while a loop runs, and adapters for filters of other
  libraries;
- `content`: all that a file says, at hand by frame and target, with its clip and its true targets; `sequence`: a file
  as a recording;
- `recorded`: the frames of a recording as a tracker gets them, and an example that is made up.
"""

__all__: list[str] = []
