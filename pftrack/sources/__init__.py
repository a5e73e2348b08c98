"""Sources: random access to frames, from a camera's recording, a table or what others have computed.

A source answers `frame(index, history)`: what is to be seen at that instant, given what the scene's parameters were up
to then. The simulated scenes stand with their experiments. The rest is:

- `truth`: tables of what is true of a recording;
- `sequence`: any frame of a video, a folder of pictures, a table or beliefs, by `video`, `images`, `decoder` and
  `formats` within `limits`;
- `tracks`: tables of points; `beliefs`: what other loops have computed; `results`: boxes of other trackers.
"""
