"""A tank of goldfish from above: they swim, bend and turn as fish do (docs/methods/diffusion.md).

- `swimming`: how they move, and which clips are fit;
- `painting`: what the camera sees;
- `parameters`: what can be turned;
- `truth`, `source`: pose and silhouette of every frame, and the frames themselves.
"""

from pftrack.experiments.fish.scene.parameters import FishSceneParameters
from pftrack.experiments.fish.scene.source import FishSource
from pftrack.experiments.fish.scene.truth import FishTarget

__all__ = ["FishSceneParameters", "FishSource", "FishTarget"]
