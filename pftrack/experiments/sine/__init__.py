"""A signal in noise: the Kalman filter and the particle filter (Bando 2007, ch. 2)."""

__all__: list[str] = []
