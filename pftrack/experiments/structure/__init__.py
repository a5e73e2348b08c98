"""The shape of a rigid body from where its points are seen (Bando 2007, ch. 4 section 5).

- `experiment`: the wiring, the parameters and what is measured;
- `truth`: how far a shape and a pose are from the true ones; `calibration`: where what is said of that is not so;
- `sketch`: the points in the picture; `world`: the shape in a space of its own.
"""

__all__: list[str] = []
