"""The pose of a head, simulated or on a recording (Bando 2007, ch. 4 section 4).

- `experiment`: the wiring and the drawing; `recording`: a recording with a face; `start`: where a face is looked for;
- `sketch`: the head as lines and surface; `calibration`: where what is said of the error is not so.
"""

__all__: list[str] = []
