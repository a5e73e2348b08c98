"""Trackers of a fish that bends, by the edges of what has its colour (Mitsugami et al. 2009).

- `step`: the trackers by name: ordinary, with constant velocity, and guided by learned changes;
- `loop`: a frame of any of them, compiled: draw parents, move, weigh by look-ups in the distance image, estimate;
- `motion`: with which numbers particles are moved; `learned`: what was learned of the tank's fish;
- `state`: what is carried from frame to frame; `parameters`: all that can be set.
"""

__all__: list[str] = []
