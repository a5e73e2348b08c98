"""Trajectories of many points, whose measurements now and then are far off: what the law of the noise does about it.

- `experiment`: the wiring and the parameters; `presets`: starting points that show something; `plots`: what is plotted;
- `calibration`: where what is said of the error of a track is not so;
- `truth`: how far all tracks are from the truth, and how far they move where nothing does;
- `sketch`: trajectories in the picture and through time; `exports`: tables of them;
- `search`: how the selected corner was looked for; `scales`: what is believed of the scales of its noise and motion.
"""

__all__: list[str] = []
