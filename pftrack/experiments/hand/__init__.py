"""The pose of a hand from its silhouette, simulated or on a recording (Shimada 1997, chapter 2).

- `experiment`: the wiring; `scene`: the simulated hand; `recording`: recordings, and how near to the truth a hand is;
- `silhouette`, `fingers`: what is seen; `shape`: the model of a hand; `first_pose`, `raised_fingers`: where a run
  begins;
- `trackers`: the trackers by name; `beams` and `particles`: one frame of each; `candidates`: what the search tries;
  `likelihood`: how well it fits;
- `state`: what is believed; `parameters`: all that can be set; `draw`: the picture, and the hand in space.
"""
