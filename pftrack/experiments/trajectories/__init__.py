"""Trajectories of many points, whose measurements now and then are far off: what the law of the noise does about it.

- `experiment`: the wiring, the presets, and where bands are not to be believed; `draw`: pictures, plots and tables;
- `scene`: simulated tracks, tracks of a file and a simulated sequence; `corners`: its corners, followed by block
  matching;
- `trackers`: parameters, beliefs and methods; `step`: the trackers by name; `whole`: estimates with other seeds;
- `inspection`: the measurement and the particles of the selected track; `recording`: how it was looked for, the scales,
  and how far tracks are from the truth.
"""

__all__: list[str] = []
