"""A chain of three links seen by one camera: its pose and its lengths at once, from bounds on joints and lengths.

- `experiment`: the wiring, errors of estimates, and points from a user's marks or a table;
- `scene`: the simulated chain;
- `model`: chains before a camera, and a Gaussian of one; `state`: parameters, and the common belief of all trackers;
- `trackers`: the trackers by name, and regions that hold the truth (`sets`);
- `gaussians`, `linearised`: Kalman filters; `particles`: the particle filter;
- `draw`: the chain in the picture, in depth and by its lengths.
"""

__all__: list[str] = []
