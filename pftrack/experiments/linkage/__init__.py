"""A chain of three links seen by one camera: its pose and its lengths at once, by what joints and lengths may be.

- `experiment`: the wiring; `parameters`: what can be turned; `presets`: starting points that show something;
- `failures`: ways in which its trackers go wrong; `calibration`: where what they say of their error is not to be
  believed;
- `plots`: what is plotted; `truth`: errors of directions, whether the truth is contained, and what a run comes to;
- `beliefs`: Gaussians, regions and particles in one form that is drawn; `sketch`: the chain in the picture;
- `depth`: the chain and all hypotheses in depth; `lengths`: what is believed of the three lengths;
- `recording`: a clip whose joints a person has marked, or a table of their tracks.
"""

__all__: list[str] = []
