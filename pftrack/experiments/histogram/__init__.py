"""A window followed by the histogram of its colours, simulated or on a recording (Kagami 2012)."""

__all__: list[str] = []
