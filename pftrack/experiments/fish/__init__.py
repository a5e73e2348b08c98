"""A fish that bends as it turns, simulated or on a recording, by guided diffusion (Mitsugami et al. 2009).

- `experiment`: the wiring; `scene` and `swimming`: the simulated tank; `recording`: a fish that a person has marked;
- `model`: the outline and its likelihood; `step`: the trackers by name; `trackers`: their state and their compiled
  frame;
- `parameters`: all that can be set; `draw`: pictures and worlds; `quality`: bands and the probability of a loss.
"""
