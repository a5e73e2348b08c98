"""Trackers of a hand's pose by its silhouette (Shimada 1997, chapter 2).

- `step`: the trackers by name, a beam of hands and a particle filter with the same likelihood;
- `beams`: a frame of the beam: predictions of every kept hand, the hands near them, and which are kept;
- `search`: hands near predictions, compiled: palms around each, fingers for each palm, whole hands;
- `candidates`: how far steps go, and which palms and fingers are tried;
- `likelihood`: how well palms, fingers along a protrusion and hidden fingers fit; `assignment`: which finger is which;
- `ranking`: whole hands compared with the silhouette, and brought nearer to it;
- `particles`: a frame of the particle filter;
- `waiting`: what happens while no hand can be followed, and how it is found again;
- `view`, `picture_tables`: a frame as the search sees it, and what it looks up there;
- `state`: what is carried from frame to frame; `parameters`: all that can be set, `settings`: the same for compiled
  code; `reports`: what is told of a state.
"""

__all__: list[str] = []
