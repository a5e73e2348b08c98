"""The figures of Bando 2007, ch. 4 section 5: shape errors (`shape`) of single reconstructions (`trials`)."""

__all__: list[str] = []
