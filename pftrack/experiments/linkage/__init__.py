"""A chain of three links seen by one camera: its pose and its lengths at once, by what joints and lengths may be.

- `experiment`: the wiring, how far an estimate is off, and points that a person marks or a table gives;
- `scene`: the simulated chain;
- `model`: chains before a camera, and a Gaussian of one; `state`: what can be turned, and what all trackers believe;
- `trackers`: the trackers by name, and regions that hold the truth (`sets`);
- `gaussians`, `linearised`: Kalman filters; `particles`: the particle filter;
- `draw`: the chain in the picture, in depth and by its lengths.
"""

__all__: list[str] = []
