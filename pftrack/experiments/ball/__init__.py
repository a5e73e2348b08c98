"""The ball behind an occluder, simulated or on a recording (document 1, ch. 3)."""

__all__: list[str] = []
