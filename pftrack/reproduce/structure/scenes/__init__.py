"""Tracks of simulated bodies whose shape is known (Bando 2007, ch. 4 sections 5.3 and 5.4).

- `prism`: fourteen points of the turning prism, some of which are always hidden;
- `head`: eleven points of a driver's face, with noise by how much each looks as it does from the front.
"""

from pftrack.reproduce.structure.scenes.head import head_tracks
from pftrack.reproduce.structure.scenes.prism import prism_tracks
from pftrack.reproduce.structure.scenes.simulated import SimulatedTracks

__all__ = ["SimulatedTracks", "head_tracks", "prism_tracks"]
