"""What loops and trackers of others have computed, looked at like any run of one's own.

- `experiment`: the wiring and the parameters; `measures`: what is compared with the truth;
- `sketch`: what is drawn in the picture, or in the plane of two components.
"""

__all__: list[str] = []
