"""Trajectories of many points, whose measurements are sometimes far off: the effect of the law of the noise.

- `experiment`: the wiring, the presets, and settings with unreliable bands; `draw`: pictures, plots and tables;
- `scene`: simulated tracks, tracks of a file and a simulated sequence; `corners`: its corners, followed by block
  matching;
- `trackers`: parameters, beliefs and methods; `step`: the trackers by name; `whole`: estimates with other seeds;
- `inspection`: the measurement and the particles of the selected track; `recording`: the search for it, the scales, and
the errors of tracks.
"""

__all__: list[str] = []
