"""A signal in noise: the Kalman filter beside the particle filter (Bando 2007, ch. 2)."""

__all__: list[str] = []
