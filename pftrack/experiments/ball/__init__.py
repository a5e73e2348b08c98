"""The ball behind an occluder, simulated or on a recording (Bando 2007, ch. 3)."""

__all__: list[str] = []
