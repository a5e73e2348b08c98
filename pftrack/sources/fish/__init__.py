"""A tank of goldfish from above: they swim, bend and turn as fish do (docs/methods/diffusion.md).

- `swimming`: how they move, and which clips are fit;
- `painting`: what the camera sees;
- `parameters`: what can be turned;
- `truth`, `source`: pose and silhouette of every frame, and the frames themselves.
"""

from pftrack.sources.fish.parameters import FishSceneParameters
from pftrack.sources.fish.source import FishSource
from pftrack.sources.fish.truth import FishTarget

__all__ = ["FishSceneParameters", "FishSource", "FishTarget"]
