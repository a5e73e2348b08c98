"""The tables of Bando 2007, ch. 4 section 4: the pose of a driver's head (`pose`), from its trials (`trials`)."""

__all__: list[str] = []
