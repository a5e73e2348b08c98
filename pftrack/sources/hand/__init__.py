"""A simulated hand before a dark background, seen as a silhouette (docs/methods/hands.md).

- `motion`: the three motions, as poses frame by frame;
- `painting`: the silhouette with an edge that is not quite that of the model, and the picture;
- `parameters`: what can be turned;
- `truth`, `source`: pose and tips of every frame, and the frames themselves.
"""

from pftrack.sources.hand.parameters import HandSceneParameters
from pftrack.sources.hand.source import HandSource
from pftrack.sources.hand.truth import HandTarget

__all__ = ["HandSceneParameters", "HandSource", "HandTarget"]
