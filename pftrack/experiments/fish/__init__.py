"""A fish that bends as it turns, simulated or on a recording, by guided diffusion (Mitsugami et al. 2009).

- `experiment`: the wiring, pictures and worlds; `scene` and `swimming`: the simulated tank, and a fish that the user
  has marked;
- `model`: the outline and its likelihood; `trackers`: the trackers by name, their state and their compiled frame;
- `parameters`: all parameters.
"""
