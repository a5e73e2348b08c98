"""Recordings of beliefs: what other loops and other trackers have computed, frame by frame, as a source.

- `archive`: the file, entry by entry; `recorder`: what writes one while a loop runs;
- `adapters`: what filters of other libraries hold, said to a recorder;
- `content`: all that a file says, at hand by frame and target; `sequence`: a file as a recording;
- `selection`: which target and which components are looked at; `identities`: which truth each target belongs to;
- `recorded`: the frames of a recording as a tracker gets them; `scene`: an example that is made up.
"""

__all__: list[str] = []
