"""Trackers of a body's shape: where its points were seen in each frame, and what shape that makes.

- `parameters`: what can be turned; `observed`: what all methods keep of the frames;
- `methods`: the methods of `pftrack.vision.structure` behind one protocol, frame by frame;
- `placing`: a shape brought into one frame of reference, and the camera that sees it so;
- `state`: what is believed; `step`: the trackers and what they report.
"""

__all__: list[str] = []
