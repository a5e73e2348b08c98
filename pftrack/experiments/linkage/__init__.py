"""A chain of three links seen by one camera: its pose and its lengths at once, by what joints and lengths may be.

- `experiment`: the wiring and what is plotted; `parameters`: what can be turned; `presets`: starting points;
- `scene`: the simulated chain; `recording`: points that a person marks or a table gives;
- `shape`: chains before a camera; `state`: what all trackers believe; `trackers`: the trackers by name;
- `gaussians`, `linearised`, `model`: Kalman filters; `particles`, `sampled`: the particle filter;
- `set_trackers` and `sets`: regions that hold the truth;
- `draw`: the chain in the picture, in depth and by its lengths; `quality`: errors, bands and the probability of a loss.
"""

__all__: list[str] = []
