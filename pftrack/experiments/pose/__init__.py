"""What experiments on the pose of a solid have in common.

- `series`: what they measure; `calibration`: what is said of their bands; `sketch`: how they are drawn.
"""

__all__: list[str] = []
