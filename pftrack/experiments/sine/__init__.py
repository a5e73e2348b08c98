"""A signal in noise: the Kalman filter beside the particle filter (document 1, ch. 2)."""

__all__: list[str] = []
