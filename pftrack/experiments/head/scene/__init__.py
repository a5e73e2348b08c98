"""The simulated driver's head: procedural, textured, self-occluding, with changes of light (docs/methods/heads.md).

Bando's videos of drivers are not to be had, so their place is taken by a head that is drawn from a face model:

- `parameters`: what can be turned, most of it live;
- `motion`: the script of turns, nods and rolls;
- `texture`: the face's albedo, painted from the eleven points;
- `rasteriser`: a depth-buffered drawing of the mesh;
- `background`, `occluders`: what is behind the head and what passes in front of it;
- `sensor`: noise and rounding;
- `truth`, `source`: pose, features and visibility of every frame, and the frames themselves.
"""

from pftrack.experiments.head.scene.parameters import HeadSceneParameters
from pftrack.experiments.head.scene.source import HeadSource
from pftrack.experiments.head.scene.truth import HeadTarget

__all__ = ["HeadSceneParameters", "HeadSource", "HeadTarget"]
