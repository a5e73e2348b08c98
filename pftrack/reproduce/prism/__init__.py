"""The tables of Bando 2007, ch. 4 section 3: the pose of the prism (`pose`), from its trials (`trials`)."""

__all__: list[str] = []
