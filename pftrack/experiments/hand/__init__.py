"""The pose of a hand from its silhouette, simulated or on a recording (Shimada 1997, chapter 2).

- `experiment`: the wiring, the picture, and the hand in space; `scene`: the simulated hand; `recording`: recordings,
  and the error of a hand;
- `silhouette`, `fingers`: the measurements; `shape`: the model of a hand; `first_pose`: the start of a run;
- `trackers`: the trackers by name, and a frame of the particle filter; `beams`: a frame of the beam; `candidates`:
  candidates of the search; `likelihood`: their fit;
- `model`: parameters, the prior of a hand, and the belief.
"""
