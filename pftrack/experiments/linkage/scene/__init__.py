"""A chain of three links seen by one orthographic camera: in the plane by a camera of one line, or in space.

- `paths`: how the joints move, as data; `truth`: what is true of a chain, and where its points are seen;
- `lines`: links that are seen as lines, without their ends;
- `parameters`: what can be turned; `source`: the measured points, frame by frame; `painting`: what the camera sees.
"""

__all__: list[str] = []
