"""The shape of a rigid body from where its points are seen (Bando 2007, ch. 4 section 5).

- `experiment`: the wiring, what is drawn and measured, and where bands are not to be believed;
- `scene`: a simulated body;
- `trackers`: the trackers by name, and a shape in one frame of reference; `methods`: the methods, frame by frame.
"""

__all__: list[str] = []
