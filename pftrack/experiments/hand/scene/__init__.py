"""A simulated hand before a dark background, seen as a silhouette (docs/methods/hands.md).

- `motion`: the three motions, as poses frame by frame;
- `painting`: the silhouette with an edge that is not quite that of the model, and the picture;
- `parameters`: what can be turned;
- `truth`, `source`: pose and tips of every frame, and the frames themselves.
"""

from pftrack.experiments.hand.scene.parameters import HandSceneParameters
from pftrack.experiments.hand.scene.source import HandSource
from pftrack.experiments.hand.scene.truth import HandTarget

__all__ = ["HandSceneParameters", "HandSource", "HandTarget"]
