"""Many points that are followed at once, each for itself: trajectories.

- `target`: what is true of them, and which of them is looked at;
- `scene`: simulated tracks, measured with noise that now and then is far off; `reference`: one such track in numbers;
- `recorded`: tracks of a file, as another program has followed them.
"""

__all__: list[str] = []
