"""The shape of a rigid body from its points' positions in pictures (Bando 2007, ch. 4 section 5).

- `experiment`: the wiring, drawings and measures, and settings with unreliable bands;
- `scene`: a simulated body;
- `trackers`: the trackers by name, and a shape in one frame of reference; `methods`: the methods, frame by frame.
"""

__all__: list[str] = []
