"""The pose of a head, simulated or on a recording (Bando 2007, ch. 4 section 4).

- `experiment`: the wiring, the drawing and the world of the head; `draw`: pieces of drawings, and files of the
  head;
- `scene` and `painting`: the simulated driver; `recording`: how a face is found, marked and judged;
- `trackers`: the trackers by name; `first_sight`: models made from the first picture; `appearance`: templates and
  memory;
- `parameters`: all parameters, and learning the face from a frame.
"""

__all__: list[str] = []
