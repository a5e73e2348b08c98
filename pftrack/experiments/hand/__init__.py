"""The pose of a hand from its silhouette, simulated or on a recording (Shimada 1997, chapter 2).

- `experiment`: the wiring, the picture, and the hand in space; `scene`: the simulated hand; `recording`: recordings,
  and how near to the truth a hand is;
- `silhouette`, `fingers`: what is seen; `shape`: the model of a hand; `first_pose`: where a run begins;
- `trackers`: the trackers by name, and a frame of the particle filter; `beams`: a frame of the beam; `candidates`: what
  the search tries; `likelihood`: how well it fits;
- `model`: all that can be set, how probable a hand is beforehand, and what is believed.
"""
