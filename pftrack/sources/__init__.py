"""Sources: random access to frames, from a camera's recording, a table or a recording of beliefs.

A source answers `frame(index, history)`: the picture at that instant, given the history of the scene's parameters.
Simulated scenes are with their experiments. The other sources are:

- `truth`: tables of true values for a recording;
- `sequence`: any frame of a video, a folder of pictures, a table or beliefs, by `video`, `images`, `decoder` and
  `formats` within `limits`;
- `tracks`: tables of points; `beliefs`: beliefs recorded by other loops; `results`: boxes of other trackers.
"""
